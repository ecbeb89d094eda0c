#include "report/RunFiles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>

#include "depthservo/text/NewFolder.h"

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
      "timestamp",      "id",      "u",      "v",     "measured", "Z",
      "sigma_Z",        "status",  "Z_true", "Z_low", "Z_high",   "excitation",
      "frames_to_5pct", "sigma_uv"};
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

OutputFile::OutputFile(std::filesystem::path file)
    : file_(std::move(file)), stream_(file_, std::ios::binary) {
  if (!stream_) throw notWritten(file_);
}

OutputFile::~OutputFile() {
  if (isWhole_) return;
  std::error_code ignored;
  stream_.close();
  std::filesystem::remove(file_, ignored);
}

void OutputFile::write(std::string_view text) {
  stream_.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream_) throw notWritten(file_);
}

void OutputFile::close() {
  stream_.close();
  if (!stream_) throw notWritten(file_);
  isWhole_ = true;
}

void writeFile(const std::filesystem::path& file, std::string_view contents) {
  OutputFile output(file);
  output.write(contents);
  output.close();
}

}  // namespace depthservo
