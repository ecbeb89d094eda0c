#include "cli/Tool.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "support/TemporaryFolder.h"

namespace depthservo::test {

namespace {

/// \param place takes the two files of what it says
std::string shellCommand(const std::string& arguments, const TemporaryFolder& place) {
  return DEPTHSERVO_TOOL " " + arguments + " >" + (place / "out").string() + " 2>" +
         (place / "err").string() + " </dev/null";
}

}  // namespace

Result depthservo(const std::string& arguments, const std::string& environment) {
  const TemporaryFolder place;
  const int status = std::system((environment + " " + shellCommand(arguments, place)).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, place.read("out"), place.read("err")};
}

Result depthservoInterrupted(const std::string& arguments, int signal,
                             const std::function<bool()>& isDue) {
  const TemporaryFolder place;
  const std::string command = "exec " + shellCommand(arguments, place);
  const pid_t child = fork();
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    usleep(2000);
    if (!isDue()) continue;
    kill(child, signal);  // once: a second one ends it at once, whatever it leaves
    waitpid(child, &status, 0);
    break;
  }
  const int exitCode = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return {exitCode, place.read("out"), place.read("err")};
}

void record(const std::string& arguments, const std::string& sequence) {
  const Result result = depthservo("record " + arguments + " " + sequence);
  ASSERT_EQ(result.exitCode, 0) << result.err;
}

void expectRefused(const Result& result, const std::vector<std::string>& words) {
  EXPECT_EQ(result.exitCode, 2) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_LE(result.err.size(), 1001u);
  for (const std::string& word : words) {
    EXPECT_NE(result.err.find(word), std::string::npos) << "no '" << word << "' in: " << result.err;
  }
}

void expectSameEstimates(const std::string& a, const std::string& b, double tolerance) {
  const auto one = readCsv(a + "/features.csv"), other = readCsv(b + "/features.csv");
  ASSERT_EQ(one.at("id"), other.at("id"));
  EXPECT_EQ(one.at("status"), other.at("status"));
  EXPECT_EQ(one.at("measured"), other.at("measured"));
  const double origin = std::stod(one.at("timestamp")[0]) - std::stod(other.at("timestamp")[0]);
  for (std::size_t i = 0; i < one.at("id").size(); ++i) {
    constexpr double kEpochResolution_s = 1e-6;
    ASSERT_NEAR(std::stod(one.at("timestamp")[i]) - std::stod(other.at("timestamp")[i]), origin,
                kEpochResolution_s);
  }
  for (const char* column : {"u", "v", "Z", "sigma_Z"}) {
    for (std::size_t i = 0; i < one.at(column).size(); ++i) {
      const double x = std::stod(one.at(column)[i]), y = std::stod(other.at(column)[i]);
      ASSERT_NEAR(x, y, tolerance * std::max(1.0, std::abs(x))) << column << ", row " << i;
    }
  }
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
