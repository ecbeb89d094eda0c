#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "depthservo/report/Metrics.h"

namespace depthservo {

/// The headline of a run's page.
struct Headline {
  std::string mood;  ///< CSS class: good | middling | bad | neutral
  std::string sentence;
};

/// "Converged after 14.2 s: image error 0.31 px rms, worst depth error 0.8 %". \param run run.json
Headline headlineOf(const nlohmann::ordered_json& run);

}  // namespace depthservo
