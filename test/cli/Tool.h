#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace depthservo::test {

/// What a call of the tool leaves.
struct Result {
  int exitCode;
  std::string out, err;

  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// Runs `depthservo <arguments>` through a shell, as typed. \param environment "NAME=value" before
/// it
Result depthservo(const std::string& arguments, const std::string& environment = "");

/// The same, with one signal as soon as `isDue`. The exit code is a shell's: 128 + the signal that
/// ended it.
Result depthservoInterrupted(const std::string& arguments, int signal,
                             const std::function<bool()>& isDue);

/// Records a run into a new folder. \param arguments the scenario and its settings
void record(const std::string& arguments, const std::string& sequence);

/// Path of a file in the repository's data folder.
std::string data(const std::string& file);

/// Refused as every bad input is: exit code 2, one line on stderr with these words, nothing on
/// stdout.
void expectRefused(const Result& result, const std::vector<std::string>& words);

/// Every estimate of a run folder equals that of another, relatively; times may have another
/// origin.
void expectSameEstimates(const std::string& a, const std::string& b, double tolerance);

/// A CSV file as columns of text.
std::map<std::string, std::vector<std::string>> readCsv(const std::string& file);

}  // namespace depthservo::test
