#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace depthservo {

/// Columns of features.csv, in order.
const std::vector<std::string>& featureColumns();

/// Columns of frames.csv, in order, for the robot velocities of these names ("v [m/s]" is column
/// "v").
std::vector<std::string> frameColumns(const std::vector<std::string>& commandNames);

/// Header line of a CSV file.
std::string headerLine(const std::vector<std::string>& columns);

/// Writes a file, or leaves none. \throw InputError naming it
void writeFile(const std::filesystem::path& file, std::string_view contents);

}  // namespace depthservo
