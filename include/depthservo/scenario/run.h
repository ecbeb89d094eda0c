#pragma once

#include <string>

#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/rig/SimulatedRig.h"
#include "depthservo/rig/observe.h"
#include "depthservo/scenario/Scenario.h"

namespace depthservo {

/// What the observer of a scenario is told. \param rig of this scenario
ObservationOptions observationOf(const Scenario& scenario, const SimulatedRig& rig);

/// Runs a scenario to its end. \param watcher may be null \param keep with the last frames alone
/// the log has outcome and reason, but neither a configuration nor what needs all frames; the run is
/// the same \throw InputError a point is not in the image at the start or at the goal, or the law
/// cannot have this goal
RunLog run(const Scenario& scenario, RunWatcher* watcher = nullptr, Keep keep = Keep::everything);

/// Runs a scenario and writes what its sensors gave as a sequence, of which `replay` gives the same
/// estimates. \param folder must not exist; whole or not at all \throw InputError
RunLog record(const Scenario& scenario, const std::string& folder, RunWatcher* watcher = nullptr);

}  // namespace depthservo
