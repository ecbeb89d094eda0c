#pragma once

#include <CLI/CLI.hpp>

namespace depthservo {

/// Exit codes of the tool.
constexpr int kMet = 0;           ///< as expected; without an expectation: converged or timeout
constexpr int kNotMet = 1;        ///< an expectation or a baseline is not met
constexpr int kBadInput = 2;      ///< arguments or files that cannot be used; nothing was written
constexpr int kOtherOutcome = 3;  ///< without an expectation: any other outcome

/// Each adds its subcommand; when it is the one called, it runs and leaves its exit code.
void addRun(CLI::App& app, int& exitCode);
void addReplay(CLI::App& app, int& exitCode);
void addRecord(CLI::App& app, int& exitCode);
void addReport(CLI::App& app, int& exitCode);
void addReproduce(CLI::App& app, int& exitCode);
void addCompare(CLI::App& app, int& exitCode);
void addGains(CLI::App& app, int& exitCode);
void addLive(CLI::App& app, int& exitCode);
void addTarget(CLI::App& app, int& exitCode);
void addNoise(CLI::App& app, int& exitCode);

}  // namespace depthservo
