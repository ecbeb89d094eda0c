# Debian packages, by CPack: scripts/package configures a tree for them and makes them.
#
#   libdepthservo0.1    libraries             named after SOVERSION, which is major.minor while the major is 0
#   libdepthservo-dev   headers, CMake, pkg-config
#   depthservo          the tool, man pages, completion, scenarios, sweeps
#   python3-depthservo
#   depthservo-doc

set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME depthservo)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "the depthservo authors <maintainers@users.noreply.h-seed-8a658651.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ
    GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL runtime dev tool doc)
if(DEPTHSERVO_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src)
# What others' packages depend on by each library, and that ldconfig is to be run.
set(control ${PROJECT_BINARY_DIR}/debian/control)
set(shlibs "")
foreach(layer core features robots vision servo)
  string(APPEND shlibs "libdepthservo_${layer} ${soversion} libdepthservo${soversion} (>= ${PROJECT_VERSION})\n")
endforeach()
file(WRITE ${control}/shlibs "${shlibs}")
file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${control}/shlibs ${control}/triggers)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

# depthservo_package(<component> <package> <section> <summary> <description> [DEPENDS ...] [RECOMMENDS ...])
#   The copyright and the changelog that Debian wants in each.
function(depthservo_package component package section summary description)
  cmake_parse_arguments(arg "" "" "AFTER;DEPENDS;RECOMMENDS" ${ARGN})
  string(TOUPPER ${component} upper)
  list(JOIN arg_DEPENDS ", " depends)
  list(JOIN arg_RECOMMENDS ", " recommends)
  foreach(pair "PACKAGE_NAME=${package}" "PACKAGE_SECTION=${section}" "PACKAGE_DEPENDS=${depends}"
               "PACKAGE_RECOMMENDS=${recommends}" "DESCRIPTION=${summary}\n${description}")
    string(FIND "${pair}" "=" at)
    string(SUBSTRING "${pair}" 0 ${at} key)
    math(EXPR at "${at} + 1")
    string(SUBSTRING "${pair}" ${at} -1 value)
    set(CPACK_DEBIAN_${upper}_${key} "${value}" PARENT_SCOPE)
  endforeach()
  set(CPACK_COMPONENT_${upper}_DEPENDS ${arg_AFTER} PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
  if(NOT component STREQUAL runtime AND NOT component STREQUAL tool AND NOT component STREQUAL python)
    set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS OFF PARENT_SCOPE)
  endif()
  if(NOT DEPTHSERVO_PACKAGES)
    return()
  endif()
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian/copyright
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
  set(changelog ${PROJECT_BINARY_DIR}/debian/${package}/changelog)
  file(WRITE ${changelog} "depthservo (${PROJECT_VERSION}) bookworm; urgency=medium\n\n"
       "  * Built from source; CHANGELOG.md in depthservo-doc has what changed.\n\n"
       " -- ${CPACK_PACKAGE_CONTACT}  ${now}\n")
  execute_process(COMMAND gzip -9nf ${changelog} COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${changelog}.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  set(overrides ${PROJECT_SOURCE_DIR}/cmake/debian/${component}.lintian-overrides)
  if(EXISTS ${overrides})
    install(FILES ${overrides} RENAME ${package}
            DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides COMPONENT ${component})
  endif()
endfunction()

option(DEPTHSERVO_PACKAGES "Install what Debian packages need besides" OFF)
depthservo_package(runtime libdepthservo${soversion} libs
  "image-based visual servoing with observed depth - libraries"
  "Drop-ins for ViSP's features that observe their depth, depth estimators,\ntrackers, readers of recordings and closed servo loops.")
depthservo_package(dev libdepthservo-dev libdevel
  "image-based visual servoing with observed depth - development files"
  "Headers, CMake package and pkg-config files. The sources of examples are in\ndepthservo-doc."
  AFTER runtime DEPENDS libeigen3-dev libvisp-dev libopencv-dev)
depthservo_package(tool depthservo science
  "image-based visual servoing with observed depth - command line tool"
  "Runs servo loops on synthetic images, observes depth on recordings and live\ncameras, compares estimators, steers robots back to taught places."
  AFTER runtime RECOMMENDS gnuplot-nox visp-images-data)
depthservo_package(python python3-depthservo python
  "image-based visual servoing with observed depth - Python package"
  "Estimators from and to numpy arrays, recordings, replays, scenario runs and\nsweeps."
  AFTER runtime tool DEPENDS "python3 (>= 3.11)" "python3 (<< 3.12)" python3-numpy
  RECOMMENDS python3-pandas python3-matplotlib)
depthservo_package(doc depthservo-doc doc
  "image-based visual servoing with observed depth - documentation"
  "Guides, formats, measured figures and the sources of examples.")
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
include(CPack)
