#pragma once

#include <filesystem>
#include <fstream>
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

/// A file that is written bit by bit, and is gone again unless it was written whole.
class OutputFile {
 public:
  /// \throw InputError naming it: it cannot be opened
  explicit OutputFile(std::filesystem::path file);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// \throw InputError naming it: not all could be written
  void write(std::string_view text);
  void close();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
  bool isWhole_ = false;
};

/// Writes a file, or leaves none. \throw InputError naming it
void writeFile(const std::filesystem::path& file, std::string_view contents);

}  // namespace depthservo
