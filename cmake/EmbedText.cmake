# cmake -D "PARTS=page=a.html;style=b.css,c.css" -D OUTPUT=a.cpp -D TYPE=EmbeddedReport -D HEADER=a.h -P EmbedText.cmake
# Writes the parts, each the concatenation of its files, as the strings of embeddedReport(). References to
# source maps are cut out: a browser would look for them beside the report.

set(members "")
foreach(part IN LISTS PARTS)
  string(REGEX MATCH "^([A-Za-z0-9]+)=(.*)$" matched "${part}")
  set(name ${CMAKE_MATCH_1})
  string(REPLACE "," ";" files "${CMAKE_MATCH_2}")
  string(APPEND members "      /*${name}=*/")
  foreach(file IN LISTS files)
    file(READ "${file}" text)
    string(REGEX REPLACE "//# sourceMappingURL=[^\n]*" "" text "${text}")
    string(REGEX REPLACE "/\\*# sourceMappingURL=[^*]*\\*/" "" text "${text}")
    string(APPEND members "R\"~embedded~(${text})~embedded~\"\n")
  endforeach()
  string(APPEND members "      ,\n")
endforeach()
string(REGEX REPLACE "^E" "e" function "${TYPE}")
file(WRITE "${OUTPUT}" "#include \"${HEADER}\"

namespace depthservo {

const ${TYPE}& ${function}() {
  static const ${TYPE} embedded = {
${members}  };
  return embedded;
}

}  // namespace depthservo
")
