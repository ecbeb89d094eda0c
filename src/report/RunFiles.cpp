#include "report/RunFiles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <fstream>

#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

std::string columnName(const std::string& commandName) {
  std::string column = commandName.substr(0, commandName.find(" ["));
  std::replace_if(
      column.begin(), column.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return column;
}

}  // namespace

const std::vector<std::string>& featureColumns() {
  static const std::vector<std::string> columns = {
      "timestamp", "id",    "u",      "v",          "measured",      "Z", "sigma_Z", "status",
      "Z_true",    "Z_low", "Z_high", "excitation", "frames_to_5pct"};
  return columns;
}

std::vector<std::string> frameColumns(const std::vector<std::string>& commandNames) {
  std::vector<std::string> columns = {"timestamp", "error_px", "measured"};
  for (const char* kind : {"command_", "applied_"}) {
    for (const std::string& name : commandNames) columns.push_back(kind + columnName(name));
  }
  for (const char* name :
       {"vx", "vy", "vz", "wx", "wy", "wz", "robot_x", "robot_y", "robot_theta"}) {
    columns.emplace_back(name);
  }
  return columns;
}

std::string headerLine(const std::vector<std::string>& columns) {
  return fmt::format("{}\n", fmt::join(columns, ","));
}

void writeFile(const std::filesystem::path& file, std::string_view contents) {
  std::ofstream stream(file, std::ios::binary);
  const bool opened = stream.is_open();
  stream.write(contents.data(), static_cast<std::streamsize>(contents.size()));
  stream.close();
  if (stream) return;
  std::error_code ignored;
  if (opened) std::filesystem::remove(file, ignored);
  throw InputError({file.string(), 0, ""}, "cannot be written");
}

}  // namespace depthservo
