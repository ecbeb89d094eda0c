# cmake -D tool=<depthservo> -D folder=<folder> -P DescribeTool.cmake
#   Man pages (man1/*.1.gz) and completion (bash, zsh) as the tool itself has them.

function(describe file)
  execute_process(COMMAND ${tool} describe ${ARGN} OUTPUT_FILE ${folder}/${file} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${folder})
file(MAKE_DIRECTORY ${folder}/man1)
describe(bash bash)
describe(zsh zsh)
describe(man1/depthservo.1 man)
execute_process(COMMAND ${tool} describe commands OUTPUT_VARIABLE commands COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" commands "${commands}")
foreach(command IN LISTS commands)
  describe(man1/depthservo-${command}.1 man ${command})
endforeach()
file(GLOB pages ${folder}/man1/*.1)
execute_process(COMMAND gzip -9n ${pages} COMMAND_ERROR_IS_FATAL ANY)
