# cmake -D source=<tree> -P arrows.cmake
#   Fails on an include that points upwards in the house (doc/development.md), on a room that is not in
#   it, and on what belongs to some rooms only.

cmake_policy(VERSION 3.16)

# Rows from the lowest. A room includes rooms of lower rows only.
set(rows
  "visp"
  "motion|camera"
  "depth"
  "pose"
  "target|text"
  "tracking|simulation|sequence|features|robots"
  "observation"
  "rig"
  "servo"
  "report|scenario"
  "experiments"
  "papers")
set(eigen_only motion camera depth pose)        # no ViSP, no OpenCV
set(knows_scenarios scenario experiments papers)
set(never_for_report servo rig scenario)

set(rooms "")
set(height 0)
foreach(row IN LISTS rows)
  string(REPLACE "|" ";" members "${row}")
  foreach(room IN LISTS members)
    set(height_of_${room} ${height})
    list(APPEND rooms ${room})
  endforeach()
  math(EXPR height "${height} + 1")
endforeach()

set(faults "")
file(GLOB found RELATIVE ${source} ${source}/src/* ${source}/include/depthservo/*)
foreach(folder IN LISTS found)
  get_filename_component(room ${folder} NAME)
  if(IS_DIRECTORY ${source}/${folder} AND NOT room IN_LIST rooms)
    string(APPEND faults "${folder}: not a room of the house\n")
  endif()
endforeach()

foreach(room IN LISTS rooms)
  if(NOT EXISTS ${source}/src/${room}/README.md)
    string(APPEND faults "src/${room}: no README.md\n")
  endif()
  file(GLOB_RECURSE files RELATIVE ${source} ${source}/src/${room}/*.h ${source}/src/${room}/*.cpp
       ${source}/include/depthservo/${room}/*.h)
  foreach(file IN LISTS files)
    file(STRINGS ${source}/${file} includes REGEX "^#include [<\"]")
    foreach(include IN LISTS includes)
      string(REGEX MATCH "[<\"](.*)[>\"]" name "${include}")
      string(REGEX REPLACE "^depthservo/" "" name "${CMAKE_MATCH_1}")
      if(room IN_LIST eigen_only AND name MATCHES "^(visp3|opencv2)/")
        string(APPEND faults "${file}: includes ${name}, ${room} has Eigen only\n")
      endif()
      if(NOT name MATCHES "^([a-z]+)/[^/]+\\.h$" OR NOT CMAKE_MATCH_1 IN_LIST rooms)
        continue()
      endif()
      set(other ${CMAKE_MATCH_1})
      if(other STREQUAL room)
        continue()
      endif()
      if(NOT height_of_${other} LESS height_of_${room})
        string(APPEND faults "${file}: includes ${name}, an arrow that does not point downwards\n")
      endif()
      if(room STREQUAL "report" AND other IN_LIST never_for_report)
        string(APPEND faults "${file}: includes ${name}; a report knows the log only\n")
      endif()
    endforeach()
    if(NOT room IN_LIST knows_scenarios)
      file(STRINGS ${source}/${file} mentions REGEX "[^a-zA-Z]Scenario[^a-zA-Z]")
      if(mentions)
        string(APPEND faults "${file}: names Scenario\n")
      endif()
    endif()
  endforeach()
endforeach()

if(faults)
  message(FATAL_ERROR "\n${faults}")
endif()
