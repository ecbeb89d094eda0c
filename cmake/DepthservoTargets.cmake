# depthservo_own(<target>)
#   Our own warnings and language level; never reaches a user's build.
# depthservo_inner_library(<name> SOURCES ... [PUBLIC ...] [PRIVATE ...])
#   A static library of the tool and the tests; not installed.
# depthservo_library(<name> SOURCES ... [PUBLIC ...] [PRIVATE ...])
#   A library that is installed and exported as depthservo::<name>.

function(depthservo_own target)
  target_compile_features(${target} PRIVATE cxx_std_17)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion -Woverloaded-virtual)
  target_link_options(${target} PRIVATE -Wl,--as-needed)  # ViSP's modules are many
  if(DEPTHSERVO_SANITIZED AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)  # with -fsanitize GCC takes parts of its own library for uninitialised
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
  endif()
  if(DEPTHSERVO_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# Headers that cost most of the compile time: parsed once per library.
set(depthservo_heavy_headers <Eigen/Dense> <algorithm> <array> <cmath> <functional> <limits> <memory>
                             <optional> <string> <vector>)

function(depthservo_sources target)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  depthservo_own(${target})
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_precompile_headers(${target} PRIVATE ${depthservo_heavy_headers})
  if(NOT target MATCHES "_(core|features)$")  # the estimators alone are worth more time
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O2>)
  endif()
  if(DEPTHSERVO_UNITY AND NOT target STREQUAL depthservo_papers)  # there local names are alike
    set(batch 24)  # two groups a library; those of the estimators gain nothing by being so large
    if(target STREQUAL depthservo_core)
      set(batch 6)
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)  # a group includes its sources
  endif()
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_include_directories(${target} SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
endfunction()

function(depthservo_inner_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(depthservo_${name} STATIC ${arg_SOURCES})
  add_library(depthservo::${name} ALIAS depthservo_${name})
  depthservo_sources(depthservo_${name} ${ARGN})
  if(NOT PROJECT_IS_TOP_LEVEL)
    set_target_properties(depthservo_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()

function(depthservo_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target depthservo_${name})
  add_library(${target} ${arg_SOURCES})
  add_library(depthservo::${name} ALIAS ${target})
  depthservo_sources(${target} ${ARGN})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
                        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)  # depthservo/api.h
  if(BUILD_SHARED_LIBS)
    set(map ${PROJECT_SOURCE_DIR}/cmake/exports.map)
    target_link_options(${target} PRIVATE -Wl,--version-script=${map})
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${map})
  endif()
  install(TARGETS ${target} EXPORT depthservo-${name}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT dev
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
endfunction()
