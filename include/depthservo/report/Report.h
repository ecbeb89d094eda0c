#pragma once

#include <filesystem>

namespace depthservo {

/// Writes `report.html` into a run folder, made from its run.json, frames.csv, features.csv and,
/// where they exist, first.png and last.png. One file that loads nothing from elsewhere; replaces
/// an older one. \throw InputError a file is missing, malformed or contradicts another; the folder
/// is not writable
void writeReport(const std::filesystem::path& runFolder);

}  // namespace depthservo
