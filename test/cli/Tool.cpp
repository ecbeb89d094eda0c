#include "cli/Tool.h"

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "servo/TemporaryFolder.h"

namespace depthservo::test {

Result depthservo(const std::string& arguments, const std::string& environment) {
  const TemporaryFolder folder;
  const std::string out = folder / "out", err = folder / "err";
  const std::string command = environment + " " + DEPTHSERVO_TOOL + " " + arguments + " >" + out +
                              " 2>" + err + " </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, folder.read("out"), folder.read("err")};
}

std::string data(const std::string& file) { return std::string(DEPTHSERVO_DATA) + "/" + file; }

std::map<std::string, std::vector<std::string>> readCsv(const std::string& file) {
  std::ifstream in(file);
  std::string line, cell;
  std::vector<std::string> names;
  std::map<std::string, std::vector<std::string>> columns;
  std::getline(in, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    for (const std::string& name : names) {
      cell.clear();
      std::getline(cells, cell, ',');
      columns[name].push_back(cell);
    }
  }
  return columns;
}

}  // namespace depthservo::test
