# depthservo_embed(<target> <Type> <header> <member>=<file>[,<file>...] ...)
#   Compiles texts in, so that none can be missing: adds embeddedReport() for the type EmbeddedReport, whose
#   members are declared in the header.
# A report is one file that loads nothing: it has the charting library dygraphs in it.

find_path(DYGRAPHS_DIR dygraph.min.js PATHS /usr/share/javascript/dygraphs /usr/share/javascript
          PATH_SUFFIXES dygraphs DOC "Folder with dygraph.min.js, dygraph.min.css and extras/")
if(NOT DYGRAPHS_DIR)
  message(FATAL_ERROR "The charting library dygraphs is missing: apt-get install libjs-dygraphs, "
                      "or give the folder of dygraph.min.js by -DDYGRAPHS_DIR=...")
endif()

function(depthservo_embed target type header)
  set(parts ${ARGN})
  string(REGEX REPLACE "[A-Za-z0-9]+=|;[A-Za-z0-9]+=" ";" files "${parts}")
  string(REPLACE "," ";" files "${files}")
  list(REMOVE_ITEM files "")
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/${type}.cpp)
  set(generator ${PROJECT_SOURCE_DIR}/cmake/EmbedText.cmake)
  add_custom_command(
    OUTPUT ${generated}
    COMMAND ${CMAKE_COMMAND} -D "PARTS=${parts}" -D "OUTPUT=${generated}" -D "TYPE=${type}"
            -D "HEADER=${header}" -P ${generator}
    DEPENDS ${files} ${generator}
    COMMENT "Embedding ${type}" VERBATIM)
  target_sources(${target} PRIVATE ${generated})
endfunction()
