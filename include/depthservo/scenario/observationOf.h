#pragma once

#include <string>

#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// How a file says that depth shall be observed, the defaults for what it does not say. \throw
/// InputError
ObservationOptions observationOf(const ReplaySection& section);
ObservationOptions observationOf(const Sequence& sequence);

/// The same as the keys of a section `replay`, a line of YAML each.
std::string replayYaml(const ObservationOptions& options);

/// A file with the keys of ErrorProfile (doc/formats.md). \throw InputError
ErrorProfile readErrorProfile(const std::string& file);

}  // namespace depthservo
