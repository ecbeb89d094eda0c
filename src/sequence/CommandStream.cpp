#include "depthservo/sequence/CommandStream.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "sequence/LineStream.h"
#include "sequence/PipeWriter.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

using detail::Range;

constexpr Range kTimeToLive = Range::above(0, 10);  // s
constexpr Range kVelocities{-1e3, 1e3};             // m/s or rad/s
constexpr std::string_view kFirstColumns = "sequence,timestamp,ttl,image";

/// The field before the next comma; takes it off the line.
std::string_view nextField(std::string_view& line) {
  const std::size_t comma = line.find(',');
  const std::string_view field = detail::trimmed(line.substr(0, comma));
  line.remove_prefix(comma == std::string_view::npos ? line.size() : comma + 1);
  return field;
}

}  // namespace

std::string shortName(const std::string& velocityName) {
  return velocityName.substr(0, velocityName.find(' '));
}

std::string commandHeader(const std::vector<std::string>& velocityNames) {
  std::string header(kFirstColumns);
  for (const std::string& name : velocityNames) header += "," + shortName(name);
  return header;
}

std::string commandLine(const CommandRow& row) {
  std::string line = fmt::format("{},{:.9f},{},", row.sequence, row.time_s, row.ttl_s);
  line += std::isnan(row.image_s) ? "nan" : fmt::format("{:.9f}", row.image_s);
  for (const double velocity : row.velocities) line += fmt::format(",{}", velocity);
  return line;
}

std::optional<CommandRow> parseCommand(std::string_view line, Eigen::Index n) {
  CommandRow row;
  const auto sequence = detail::toInteger(nextField(line));
  const auto time = detail::toNumber(nextField(line)), ttl = detail::toNumber(nextField(line));
  const std::string_view image = nextField(line);
  const auto image_s =
      image == "nan" ? std::numeric_limits<double>::quiet_NaN() : detail::toNumber(image);
  if (!sequence || *sequence < 1 || !time || !detail::kTimes.contains(*time) || !ttl ||
      !kTimeToLive.contains(*ttl) || !image_s) {
    return std::nullopt;
  }
  row.sequence = static_cast<std::uint64_t>(*sequence);
  row.time_s = *time;
  row.ttl_s = *ttl;
  row.image_s = *image_s;
  row.velocities.resize(n);
  for (double& velocity : row.velocities) {
    const auto value = detail::toNumber(nextField(line));
    if (!value || !kVelocities.contains(*value)) return std::nullopt;
    velocity = *value;
  }
  return line.empty() ? std::optional(row) : std::nullopt;
}

CommandWriter::CommandWriter(const std::string& path, const std::vector<std::string>& velocityNames)
    : pipe_(std::make_unique<detail::PipeWriter>(path)),
      header_(commandHeader(velocityNames) + "\n") {}

CommandWriter::~CommandWriter() = default;

bool CommandWriter::write(CommandRow row) noexcept try {
  using Written = detail::PipeWriter::Written;
  if (!hasHeader_) hasHeader_ = pipe_->write(header_) == Written::whole;
  row.sequence = ++sequence_;
  line_ = commandLine(row) + "\n";
  return pipe_->write(line_) == Written::whole;
} catch (...) {
  return false;
}

double CommandWriter::unread() const {
  return line_.empty() ? 0
                       : static_cast<double>(pipe_->unread()) / static_cast<double>(line_.size());
}

CommandReader::CommandReader(const std::string& path, Eigen::Index velocities)
    : lines_(std::make_unique<detail::LineStream>(path, "commands")), velocities_(velocities) {}

CommandReader::~CommandReader() = default;

bool CommandReader::isEnded() const { return lines_->isEnded(); }

std::vector<CommandRow> CommandReader::read(double wait_s) {
  std::vector<CommandRow> rows;
  const auto onLine = [&](std::string_view line) {
    if (line.empty() || line.front() == '#') return;
    if (line.substr(0, kFirstColumns.size()) == kFirstColumns) {
      last_ = 0;  // another one commands
      return;
    }
    auto row = parseCommand(line, velocities_);
    if (!row || row->sequence <= last_) {
      ++refused_;
      return;
    }
    ++rows_;
    last_ = row->sequence;
    rows.push_back(std::move(*row));
  };
  lines_->read(wait_s,
               {onLine, [&](std::size_t) { ++refused_; }, [&](std::string_view) { ++refused_; }});
  return rows;
}

}  // namespace depthservo
