#pragma once

#include <CLI/CLI.hpp>

#include "exitCodes.h"

namespace depthservo {

/// Each adds its subcommand; when it is the one called, it runs and leaves its exit code.
void addRun(CLI::App& app, int& exitCode);
void addReplay(CLI::App& app, int& exitCode);
void addRecord(CLI::App& app, int& exitCode);
void addRegress(CLI::App& app, int& exitCode);
void addReport(CLI::App& app, int& exitCode);
void addReproduce(CLI::App& app, int& exitCode);
void addCompare(CLI::App& app, int& exitCode);
void addGains(CLI::App& app, int& exitCode);
void addLive(CLI::App& app, int& exitCode);
void addTarget(CLI::App& app, int& exitCode);
void addNoise(CLI::App& app, int& exitCode);
void addTeach(CLI::App& app, int& exitCode);
void addServo(CLI::App& app, int& exitCode);
void addRobot(CLI::App& app, int& exitCode);
void addCalibrate(CLI::App& app, int& exitCode);
void addSweep(CLI::App& app, int& exitCode);
void addMerge(CLI::App& app, int& exitCode);
void addKeys(CLI::App& app, int& exitCode);
void addInfo(CLI::App& app, int& exitCode);
void addNew(CLI::App& app, int& exitCode);
void addDescribe(CLI::App& app, int& exitCode);

/// In the order of --help.
constexpr void (*kSubcommands[])(CLI::App&, int&) = {
    addRun,   addRegress, addNew,  addReplay, addRecord, addReport, addCompare, addReproduce, addGains, addLive,
    addTeach, addServo,  addRobot,  addTarget, addNoise,   addCalibrate, addInfo,  addSweep,
    addMerge, addKeys,   addDescribe};

}  // namespace depthservo
