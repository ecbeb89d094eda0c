#pragma once

#include <string>
#include <vector>

namespace depthservo {

constexpr const char* kScenarioHelp =
    "YAML file, run.json of a run, or name of a shipped scenario; see doc/formats.md";

/// The file that a user means: a path, or the name of a shipped scenario ("unicycle-4dots",
/// "deluca2008/arm"). \throw InputError there is neither
std::string scenarioFile(const std::string& name);

/// The same of another folder of shipped files: "sweeps". \throw InputError
std::string shippedFile(const std::string& name, const std::string& folder);

/// Names of what is shipped in this folder, ascending.
std::vector<std::string> shippedNames(const std::string& folder);

/// A path as given or, where there is nothing, what is shipped under it: "data/sequences/mire-2".
std::string pathOrShipped(const std::string& path);

}  // namespace depthservo
