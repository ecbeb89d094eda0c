#include "depthservo/sequence/TwistStream.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "text/TextFile.h"

namespace depthservo {
namespace {

using detail::Range;

constexpr std::size_t kLongestLine = 4096;                  // bytes
constexpr std::size_t kMostAtATime = std::size_t{1} << 20;  // bytes
constexpr Range kSpeeds{-1e3, 1e3};                         // m/s or rad/s

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

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

TwistStream::TwistStream(const std::string& path)
    : last_s_(-std::numeric_limits<double>::infinity()) {
  const bool isInput = path == "-";
  file_ = isInput ? dup(STDIN_FILENO) : open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  struct stat status {};
  if (file_ < 0 || fstat(file_, &status) != 0) {
    const int error = errno;
    if (file_ >= 0) close(file_);
    throw InputError({path, 0, ""}, fmt::format("cannot be read: {}", std::strerror(error)));
  }
  isRegular_ = S_ISREG(status.st_mode);
  if (S_ISDIR(status.st_mode)) {
    close(file_);
    throw InputError({path, 0, ""}, "is a folder, expected a pipe or a file of twists");
  }
}

TwistStream::~TwistStream() { close(file_); }

std::vector<OdometryRow> TwistStream::read(double wait_s) {
  std::vector<OdometryRow> rows;
  std::array<char, 65536> bytes;
  // After its writer has gone, poll says at once that a pipe is readable, for ever.
  int wait_ms = isEnded_ ? 0 : static_cast<int>(std::ceil(1000 * std::max(0.0, wait_s)));
  for (std::size_t total = 0; total < kMostAtATime;) {
    pollfd state{file_, POLLIN, 0};
    const int ready = poll(&state, 1, wait_ms);
    wasInterrupted_ = ready < 0 && errno == EINTR;
    if (ready <= 0 || !(state.revents & (POLLIN | POLLHUP))) break;
    wait_ms = 0;
    const ssize_t count = ::read(file_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) break;
    if (count == 0) {
      endOfWriter(rows);
      break;
    }
    isEnded_ = false;
    take(bytes.data(), static_cast<std::size_t>(count), rows);
    total += static_cast<std::size_t>(count);
  }
  return rows;
}

void TwistStream::take(const char* bytes, std::size_t count, std::vector<OdometryRow>& rows) {
  for (std::string_view rest(bytes, count); !rest.empty();) {
    const std::size_t end = rest.find('\n');
    const std::string_view part = rest.substr(0, end);
    if (!isOverlong_) line_ += part;
    if (line_.size() > kLongestLine && !isOverlong_) {
      isOverlong_ = true;
      ++counts_.malformed;
      note(fmt::format("a line is longer than {} characters", kLongestLine));
      line_.clear();
    }
    if (end == std::string_view::npos) return;
    if (!isOverlong_) takeLine(trimmed(line_), rows);
    line_.clear();
    isOverlong_ = false;
    rest.remove_prefix(end + 1);
  }
}

void TwistStream::takeLine(std::string_view line, std::vector<OdometryRow>& rows) {
  if (line.empty() || line.front() == '#' || line == "timestamp,vx,vy,vz,wx,wy,wz") return;
  const auto row = parsed(line);
  if (!row) {
    ++counts_.malformed;
    const auto time = detail::toNumber(trimmed(line.substr(0, line.find(','))));
    note(fmt::format("expected timestamp,vx,vy,vz,wx,wy,wz, got {}{}", detail::quoted(line),
                     time ? detail::unitHint(*time) : ""));
  } else if (!(row->time_s > last_s_)) {
    ++counts_.notLater;
    note(fmt::format("one of {} s comes after one of {} s", row->time_s, last_s_));
  } else {
    ++counts_.rows;
    last_s_ = row->time_s;
    rows.push_back(*row);
  }
}

/// The last line of a file is whole without an end of line; that of a pipe may have lost digits.
void TwistStream::endOfWriter(std::vector<OdometryRow>& rows) {
  isEnded_ = true;
  if (isRegular_) {
    takeLine(trimmed(line_), rows);
  } else if (!line_.empty()) {
    ++counts_.torn;
    note(fmt::format("the writer went away within the line {}", detail::quoted(line_)));
  }
  line_.clear();
  isOverlong_ = false;
}

void TwistStream::note(std::string fault) {
  constexpr std::size_t kMost = 10;
  if (faults_.size() < kMost) faults_.push_back(std::move(fault));
}

}  // namespace depthservo
