# A report is one file that loads nothing: its templates and the charting library dygraphs are
# compiled into depthservo::servo.
#
# depthservo_embed_report(<target>): adds embeddedReport(), declared in src/report/EmbeddedReport.h.

find_path(DYGRAPHS_DIR dygraph.min.js PATHS /usr/share/javascript/dygraphs /usr/share/javascript
          PATH_SUFFIXES dygraphs DOC "Folder with dygraph.min.js, dygraph.min.css and extras/")
if(NOT DYGRAPHS_DIR)
  message(FATAL_ERROR "The charting library dygraphs is missing: apt-get install libjs-dygraphs, "
                      "or give the folder of dygraph.min.js by -DDYGRAPHS_DIR=...")
endif()

function(depthservo_embed_report target)
  set(template ${PROJECT_SOURCE_DIR}/src/report/page)
  set(parts page=${template}/report.html
            style=${DYGRAPHS_DIR}/dygraph.min.css,${template}/report.css
            script=${DYGRAPHS_DIR}/dygraph.min.js,${DYGRAPHS_DIR}/extras/synchronizer.js,${template}/report.js
            sheet=${template}/sheet.html)
  string(REGEX REPLACE "[a-z]+=|;[a-z]+=" ";" files "${parts}")
  string(REPLACE "," ";" files "${files}")
  list(REMOVE_ITEM files "")
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/EmbeddedReport.cpp)
  set(generator ${PROJECT_SOURCE_DIR}/cmake/EmbedText.cmake)
  add_custom_command(
    OUTPUT ${generated}
    COMMAND ${CMAKE_COMMAND} -D "PARTS=${parts}" -D "OUTPUT=${generated}" -P ${generator}
    DEPENDS ${files} ${generator}
    COMMENT "Embedding the report template and dygraphs" VERBATIM)
  target_sources(${target} PRIVATE ${generated})
endfunction()
