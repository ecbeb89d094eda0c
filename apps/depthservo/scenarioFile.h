#pragma once

#include <string>

namespace depthservo {

constexpr const char* kScenarioHelp =
    "YAML file, run.json of a run, or name of a shipped scenario; see doc/formats.md";

/// The file that a user means: a path, or the name of a shipped scenario ("unicycle-4dots",
/// "deluca2008/arm"). \throw InputError there is neither
std::string scenarioFile(const std::string& name);

/// The same of another folder of shipped files: "sweeps". \throw InputError
std::string shippedFile(const std::string& name, const std::string& folder);

}  // namespace depthservo
