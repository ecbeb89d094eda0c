# Headers, libraries, the tool, its scenarios, the CMake package and the pkg-config files. The installed
# tree holds no absolute path: it may be moved.

include(CMakePackageConfigHelpers)

install(FILES ${PROJECT_SOURCE_DIR}/include/depthservo/api.h
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/depthservo)
foreach(room visp motion camera depth pose features robots target text tracking simulation sequence
             observation rig servo)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/depthservo/${room}
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/depthservo)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/data/scenarios ${PROJECT_SOURCE_DIR}/data/servo
                  ${PROJECT_SOURCE_DIR}/data/sweeps ${PROJECT_SOURCE_DIR}/data/sequences
        DESTINATION ${CMAKE_INSTALL_DATADIR}/depthservo COMPONENT tool)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE TYPE DOC COMPONENT license)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md TYPE DOC COMPONENT doc)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/doc TYPE DOC COMPONENT doc)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/apps/examples DESTINATION ${CMAKE_INSTALL_DOCDIR}/apps COMPONENT doc)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/python/examples DESTINATION ${CMAKE_INSTALL_DOCDIR}/python COMPONENT doc)

if(DEPTHSERVO_APPS)
  file(RELATIVE_PATH bin_to_lib /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
  set_target_properties(depthservo_tool PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
endif()

# find_package(depthservo [COMPONENTS core features robots visp vision servo])
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/depthservo)
foreach(layer core features robots visp vision servo)
  set_target_properties(depthservo_${layer} PROPERTIES INSTALL_RPATH "$ORIGIN")
  install(EXPORT depthservo-${layer} NAMESPACE depthservo:: FILE depthservo-${layer}-targets.cmake
          DESTINATION ${package_dir})
endforeach()
configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/depthservo-config.cmake.in depthservo-config.cmake
  INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(depthservo-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/depthservo-config.cmake
              ${PROJECT_BINARY_DIR}/depthservo-config-version.cmake
              ${PROJECT_SOURCE_DIR}/cmake/DepthservoFindVisp.cmake
        DESTINATION ${package_dir})

# pkg-config --cflags --libs depthservo-<layer>
set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH prefix_to_pkgconfig / /${pkgconfig_dir})
string(REGEX REPLACE "[^/]+" ".." pkgconfig_to_prefix ${prefix_to_pkgconfig})

# depthservo_pkgconfig(<package> <description> LIBS ... REQUIRES ... [STATIC ...])
#   STATIC: what only the code inside the library needs, which the user links when it is static.
function(depthservo_pkgconfig package description)
  cmake_parse_arguments(arg "" "" "LIBS;REQUIRES;STATIC" ${ARGN})
  if(NOT BUILD_SHARED_LIBS)
    list(APPEND arg_REQUIRES ${arg_STATIC})
  endif()
  list(JOIN arg_REQUIRES " " requires)
  list(JOIN arg_LIBS " " libs)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/depthservo.pc.in ${package}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${package}.pc DESTINATION ${pkgconfig_dir})
endfunction()

if(NOT BUILD_SHARED_LIBS)
  set(bzip2 -lbz2)  # has no pkg-config file
endif()
depthservo_pkgconfig(depthservo-core "Depth observers (Eigen only)"
                     LIBS -ldepthservo_core REQUIRES eigen3)
depthservo_pkgconfig(depthservo-features "ViSP features with observed depth"
                     LIBS -ldepthservo_features REQUIRES depthservo-core visp)
depthservo_pkgconfig(depthservo-robots "Robots that carry a camera"
                     LIBS -ldepthservo_robots REQUIRES depthservo-core visp)
depthservo_pkgconfig(depthservo-visp "depthservo-features and depthservo-robots"
                     REQUIRES depthservo-features depthservo-robots)
depthservo_pkgconfig(depthservo-vision "Trackers, synthetic camera and recorded sequences"
                     LIBS -ldepthservo_vision ${bzip2} REQUIRES depthservo-core visp
                     STATIC yaml-cpp fmt apriltag libpng libjpeg zlib liblz4 libzstd sqlite3)
depthservo_pkgconfig(depthservo-servo "Observers of simulated, recorded and live rigs; closed servo loops"
                     LIBS -ldepthservo_servo REQUIRES depthservo-visp depthservo-vision
                     STATIC yaml-cpp fmt apriltag libpng libjpeg zlib liblz4 libzstd sqlite3)
depthservo_pkgconfig(depthservo "What an existing ViSP program needs: depthservo-visp"
                     REQUIRES depthservo-visp)
