#pragma once

#include <filesystem>

namespace depthservo {

/// Writes `report.html` into a run folder, made from its run.json, frames.csv, features.csv and,
/// where they exist, first.png, last.png and the pictures of film. One file that loads nothing from
/// elsewhere; replaces an older one. \throw InputError a file is missing, malformed or contradicts another; the folder
/// is not writable
void writeReport(const std::filesystem::path& runFolder);

/// Writes the pages of two runs side by side, with one moment for both, into a new file.
/// \throw InputError as above; the file is there already, or cannot be written
void writeReportOfTwo(const std::filesystem::path& one, const std::filesystem::path& other,
                      const std::filesystem::path& file);

}  // namespace depthservo
