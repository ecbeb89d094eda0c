# Python with pybind11, QUIET: sets Python_FOUND and pybind11_FOUND. Debian's Python goes first, which its
# pybind11 and numpy belong to; another one by -DPython_EXECUTABLE=...

if(NOT DEFINED Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
if(Python_FOUND)
  set(PYBIND11_FINDPYTHON ON)
  find_package(pybind11 2.10 QUIET)
endif()
