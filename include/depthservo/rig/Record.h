#pragma once

#include <string>

#include "depthservo/observation/RunLog.h"
#include "depthservo/scenario/Scenario.h"
#include "depthservo/servo/ServoLoop.h"

namespace depthservo {

/// Runs a scenario and writes what its sensors gave as a sequence: images (or tracks.csv, when the
/// scenario has none), odometry, true depths and camera poses. A replay of it with the same
/// estimator gives the same estimates. Nothing is left behind when the folder cannot be written.
/// \param watcher may be null \throw InputError
RunLog record(const Scenario& scenario, const std::string& folder, RunWatcher* watcher = nullptr);

}  // namespace depthservo
