#include "depthservo/sequence/TwistStream.h"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <optional>

#include "depthservo/motion/Motion.h"
#include "sequence/LineStream.h"
#include "sequence/twistLine.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

using detail::Range;
using detail::trimmed;

constexpr Range kSpeeds{-1e3, 1e3};  // m/s or rad/s

/// Time and twist; none when the line is not seven numbers in range.
std::optional<OdometryRow> parsed(std::string_view line) {
  std::array<double, 7> values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t comma = line.find(',');
    if ((comma == std::string_view::npos) != (i + 1 == values.size())) return std::nullopt;
    const auto value = detail::toNumber(trimmed(line.substr(0, comma)));
    if (!value || !(i == 0 ? detail::kTimes : kSpeeds).contains(*value)) return std::nullopt;
    values[i] = *value;
    line.remove_prefix(comma == std::string_view::npos ? line.size() : comma + 1);
  }
  return OdometryRow{values[0],
                     {{values[1], values[2], values[3]}, {values[4], values[5], values[6]}}};
}

}  // namespace

TwistStream::TwistStream(const std::string& path, const std::optional<RpyPose>& cameraInBase)
    : lines_(std::make_unique<detail::LineStream>(path, "twists")),
      last_s_(-std::numeric_limits<double>::infinity()) {
  if (cameraInBase) bMc_ = cameraInBase->isometry();
}

TwistStream::~TwistStream() = default;

bool TwistStream::isFile() const { return lines_->isFile(); }

bool TwistStream::isEnded() const { return lines_->isEnded(); }
bool TwistStream::wasInterrupted() const { return lines_->wasInterrupted(); }

std::vector<OdometryRow> TwistStream::read(double wait_s) {
  std::vector<OdometryRow> rows;
  lines_->read(
      wait_s, {[&](std::string_view line) { takeLine(line, rows); },
               [&](std::size_t longest) {
                 ++counts_.malformed;
                 note(fmt::format("a line is longer than {} characters", longest));
               },
               [&](std::string_view line) {
                 ++counts_.torn;
                 note(fmt::format("the writer went away within the line {}", detail::quoted(line)));
               }});
  return rows;
}

void TwistStream::takeLine(std::string_view line, std::vector<OdometryRow>& rows) {
  if (line.empty() || line.front() == '#' || line == detail::kTwistHeader) return;
  auto row = parsed(line);
  if (!row) {
    ++counts_.malformed;
    const auto time = detail::toNumber(trimmed(line.substr(0, line.find(','))));
    note(fmt::format("expected {}, got {}{}", detail::kTwistHeader, detail::quoted(line),
                     time ? detail::unitHint(*time) : ""));
  } else if (!(row->time_s > last_s_)) {
    ++counts_.notLater;
    note(fmt::format("one of {} s comes after one of {} s", row->time_s, last_s_));
  } else {
    ++counts_.rows;
    last_s_ = row->time_s;
    if (bMc_) row->twist = twistOfCamera(*bMc_, row->twist);
    rows.push_back(*row);
  }
}

void TwistStream::note(std::string fault) {
  constexpr std::size_t kMost = 10;
  if (faults_.size() < kMost) faults_.push_back(std::move(fault));
}

}  // namespace depthservo
