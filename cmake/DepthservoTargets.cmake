# depthservo_library(<layer> SOURCES ... [PUBLIC ...] [PRIVATE ...])
#   One library per group of layers, exported as depthservo::<layer>.
# depthservo_own(<target>)
#   Our own warnings and language level; never reaches a user's build.

function(depthservo_own target)
  target_compile_features(${target} PRIVATE cxx_std_17)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion -Woverloaded-virtual)
  target_link_options(${target} PRIVATE -Wl,--as-needed)  # ViSP's modules are many
  if(DEPTHSERVO_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

function(depthservo_library layer)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target depthservo_${layer})
  add_library(${target} ${arg_SOURCES})
  add_library(depthservo::${layer} ALIAS ${target})
  depthservo_own(${target})
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${layer} VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  install(TARGETS ${target} EXPORT depthservo-${layer}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
endfunction()
