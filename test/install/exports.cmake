# cmake -D nm=<nm> -D libraries=<shared libraries> -P exports.cmake
#   Fails on a library that exports a name outside the namespace depthservo, or one of some that are hidden
#   inside, or next to nothing.

cmake_policy(VERSION 3.16)
set(inside "(depthservo::predictPoint|depthservo::detail::predictPoint|depthservo::OutcomeJudge::|depthservo::World::|depthservo::detail::openMcap|fmt::|nlohmann::|YAML::)")
set(faults "")

function(exported file result)
  execute_process(COMMAND ${nm} -DC --defined-only ${file} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX REPLACE "[][;]" "_" text "${text}")
  string(STRIP "${text}" text)
  string(REPLACE "\n" ";" lines "${text}")
  set(names "")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^[0-9a-f]+ [A-Za-z] " "" name "${line}")
    list(APPEND names "${name}")
  endforeach()
  set(${result} "${names}" PARENT_SCOPE)
endfunction()

foreach(library IN LISTS libraries)
  exported(${library} names)
  list(LENGTH names count)
  if(count LESS 20)
    string(APPEND faults "${library}: exports ${count} names only\n")
  endif()
  foreach(name IN LISTS names)
    if(NOT name MATCHES "^((non-virtual |virtual )thunk to |(vtable|VTT|typeinfo|typeinfo name) for )?depthservo::"
       OR name MATCHES "^${inside}")
      string(APPEND faults "${library}: ${name}\n")
    endif()
  endforeach()
  message(STATUS "${library}: ${count} names")
endforeach()
if(faults)
  message(FATAL_ERROR "exported, but no part of the interface:\n${faults}")
endif()
