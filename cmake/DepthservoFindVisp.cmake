# depthservo_find_visp([QUIET | REQUIRED] COMPONENTS <visp module>...)
#   find_package(VISP), without what it does to its caller: it adds compiler flags and sets the language
#   standard. Called within a function only its imported targets remain. They lack ViSP's own include
#   directories; visp_core gets them here. Installed with the package, hence used by users too.
function(depthservo_find_visp)
  find_package(VISP 3.5 ${ARGN})
  if(TARGET visp_core)
    target_include_directories(visp_core INTERFACE ${VISP_INCLUDE_DIRS})
  endif()
endfunction()
