#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace depthservo {

/// Everything the page of a run shows, as JSON that is safe within a script element: at most some
/// megabytes, however long the run and however many points it has. \param run its run.json
/// \throw InputError frames.csv or features.csv is missing, malformed or contradicts the other
std::string pageData(const nlohmann::ordered_json& run, const std::filesystem::path& folder);

}  // namespace depthservo
