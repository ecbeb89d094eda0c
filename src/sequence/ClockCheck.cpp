#include "depthservo/sequence/ClockCheck.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "depthservo/motion/MotionBuffer.h"
#include "motion/median.h"

namespace depthservo {
namespace {

struct Unit {
  const char* name;
  double perSecond;
};
constexpr std::array kUnits = {Unit{"milliseconds", 1e3}, Unit{"microseconds", 1e6},
                               Unit{"nanoseconds", 1e9}};

double medianPeriod(const std::vector<double>& times) {
  return detail::medianPeriod(times, [](double time_s) { return time_s; });
}

double longestPeriod(const std::vector<double>& times) {
  return MotionBuffer::longestHold(medianPeriod(times));
}

/// A time as a person reads it: milliseconds, no zeros at the end.
std::string text(double time_s) {
  std::string digits = fmt::format("{:.3f}", time_s);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits;
}

std::string text(const TimeSpan& span) {
  return fmt::format("from {} to {} s", text(span.from_s), text(span.to_s));
}

/// A remark on times that are farther apart, or closer together, than images and odometry are.
std::optional<std::string> unitOf(const std::string& what, const std::vector<double>& times) {
  constexpr double kLongest_s = 3, kShortest_s = 1e-5;
  const double period = medianPeriod(times);
  if (period > kLongest_s) {
    for (const Unit& unit : kUnits) {
      if (period / unit.perSecond > kLongest_s) continue;
      return fmt::format("{} are {:.3g} s apart: are their times {}? Expected seconds", what,
                         period, unit.name);
    }
  }
  if (period > 0 && period < kShortest_s) {
    return fmt::format("{} are {:.3g} s apart: are their times seconds?", what, period);
  }
  return std::nullopt;
}

/// Whether two spans are much the same.
bool agree(const TimeSpan& a, const TimeSpan& b) {
  const double common = std::min(a.to_s, b.to_s) - std::max(a.from_s, b.from_s);
  return common > 0.5 * std::max(a.to_s - a.from_s, b.to_s - b.from_s);
}

bool overlap(const TimeSpan& a, const TimeSpan& b) {
  return a.from_s <= b.to_s && b.from_s <= a.to_s;
}

void tellNoOverlap(ClockCheck& check, const std::string& name) {
  std::string finding =
      fmt::format("images {}, {} {}: they do not overlap, both need the same clock",
                  text(check.images), name, text(check.odometry));
  for (const Unit& unit : kUnits) {
    const double f = unit.perSecond;
    const TimeSpan &i = check.images, &o = check.odometry;
    if (agree(i, {o.from_s / f, o.to_s / f})) {
      finding += fmt::format(" (they would if the times of the {} were {})", name, unit.name);
    }
    if (agree({i.from_s / f, i.to_s / f}, o)) {
      finding += fmt::format(" (they would if the images' times were {})", unit.name);
    }
  }
  check.findings.push_back(finding);
}

void tellHoles(ClockCheck& check, const std::string& name) {
  constexpr std::size_t kMostTold = 3;
  for (std::size_t i = 0; i < std::min(kMostTold, check.holes.size()); ++i) {
    check.findings.push_back(
        fmt::format("no {} {}: the motion is unknown there", name, text(check.holes[i])));
  }
  if (check.holes.size() > kMostTold) {
    check.findings.push_back(
        fmt::format("no {} in {} more intervals", name, check.holes.size() - kMostTold));
  }
}

}  // namespace

std::vector<TimeSpan> holesOf(const std::vector<double>& times) {
  const double most_s = longestPeriod(times);
  std::vector<TimeSpan> holes;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] - times[i - 1] > most_s) holes.push_back({times[i - 1], times[i]});
  }
  return holes;
}

ClockCheck describeClocks(const std::vector<double>& imageTimes,
                          const std::vector<double>& odometryTimes,
                          const std::string& odometryName) {
  ClockCheck check;
  check.images = {imageTimes.front(), imageTimes.back()};
  check.odometry = {odometryTimes.front(), odometryTimes.back() + medianPeriod(odometryTimes)};
  check.overlaps = overlap(check.images, check.odometry);
  if (auto remark = unitOf("images", imageTimes)) check.findings.push_back(*remark);
  if (auto remark = unitOf("rows of " + odometryName, odometryTimes)) {
    check.findings.push_back(*remark);
  }
  if (!check.overlaps) {
    tellNoOverlap(check, odometryName);
    return check;
  }
  const double most_s = longestPeriod(odometryTimes);
  const double before_s = check.odometry.from_s - check.images.from_s;
  const double after_s = check.images.to_s - check.odometry.to_s;
  if (before_s > most_s) {
    check.missingBefore_s = before_s;
    check.findings.push_back(fmt::format("{} begins at {} s, {} s after the images", odometryName,
                                         text(check.odometry.from_s), text(before_s)));
  }
  if (after_s > most_s) {
    check.missingAfter_s = after_s;
    check.findings.push_back(fmt::format("{} ends at {} s, {} s before the images", odometryName,
                                         text(odometryTimes.back()),
                                         text(check.images.to_s - odometryTimes.back())));
  }
  for (const TimeSpan& hole : holesOf(odometryTimes)) {
    if (overlap(hole, check.images)) check.holes.push_back(hole);
  }
  tellHoles(check, odometryName);
  return check;
}

}  // namespace depthservo
