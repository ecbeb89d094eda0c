# cmake -D program=<file> -P withoutReports.cmake
#   Fails when the program loads what only reports need, or needs a program of the PATH.
execute_process(COMMAND ldd ${program} OUTPUT_VARIABLE loaded COMMAND_ERROR_IS_FATAL ANY)
if(NOT loaded MATCHES "depthservo_servo")
  message(FATAL_ERROR "${program} does not load depthservo_servo:\n${loaded}")
endif()
if(loaded MATCHES "cairo|depthservo_lab")
  message(FATAL_ERROR "${program} loads ${CMAKE_MATCH_0}:\n${loaded}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E env PATH=/nowhere ${program} COMMAND_ERROR_IS_FATAL ANY)
