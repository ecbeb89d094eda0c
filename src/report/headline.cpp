#include "report/headline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <vector>

#include "motion/median.h"

namespace depthservo {
namespace {

using Json = nlohmann::ordered_json;

/// A depth is known when 2 sigma are less than this share of it.
constexpr double kKnown = 2 * kValidRelativeSigma;

/// The worst of so few points is worth a word; of more, the median.
constexpr std::size_t kFew = 32;

/// A figure of run.json; unknown when null.
double figure(const Json& object, const char* key) {
  const Json& value = object.at(key);
  return value.is_null() ? kUnknown : value.get<double>();
}

std::string nameOf(const std::string& command) {
  return command == "live" ? "Observed" : "Replayed";
}

/// How a run ended, in words, and its mood.
Headline endOf(const Json& run) {
  const double duration_s = figure(run.at("metrics"), "duration_s");
  if (!run.contains("outcome")) {
    return {"neutral",
            fmt::format("{} {} frames, {:.1f} s", nameOf(run.at("command").get<std::string>()),
                        run.at("metrics").at("frames").get<std::size_t>(), duration_s)};
  }
  struct Wording {
    const char *outcome, *mood, *words;
  };
  static constexpr Wording kWordings[] = {
      {"converged", "good", "Converged after"},
      {"stalled", "middling", "Stalled: the command faded short of the goal, after"},
      {"timeout", "middling", "Not yet at the goal when the time was up, after"},
      {"left-image", "bad", "The target left the image after"},
      {"lost", "bad", "The target was lost after"},
      {"diverged", "bad", "Diverged after"},
      {"collision", "bad", "Too close to the target after"}};
  const auto outcome = run.at("outcome").get<std::string>();
  if (outcome == "timeout" && run.at("goals").empty()) {
    return {"neutral", fmt::format("Ran for {:.1f} s without a goal", duration_s)};
  }
  const auto wording = std::find_if(std::begin(kWordings), std::end(kWordings),
                                    [&](const Wording& w) { return w.outcome == outcome; });
  const bool isKnown = wording != std::end(kWordings);
  return {isKnown ? wording->mood : "neutral",
          fmt::format("{} {:.1f} s", isKnown ? wording->words : (outcome + " after").c_str(),
                      duration_s)};
}

/// The range in which depths are reported, as far as the configuration says.
DepthRange rangeOf(const Json& run) {
  DepthRange range;
  const Json& configuration = run.at("configuration");
  const Json& depth = configuration.contains("depth") ? configuration.at("depth") : configuration;
  range.Z_min = depth.value("Z_min", range.Z_min);
  range.Z_max = depth.value("Z_max", range.Z_max);
  return range;
}

/// What is known of depths without their truth. Not known are those held at an end of their range,
/// and those whose last measurement contradicted them.
std::string knowledge(const Json& run) {
  constexpr double kAtEnd = 1e-3;  // relative
  const DepthRange range = rangeOf(run);
  const Json& points = run.at("points");
  std::vector<double> known;  // 2 sigma, relative
  for (const Json& point : points) {
    const double Z = figure(point, "Z"), share = 2 * figure(point, "sigma_Z") / Z;
    const bool isHeld = Z >= (1 - kAtEnd) * range.Z_max || Z <= (1 + kAtEnd) * range.Z_min;
    const bool isRefuted = point.at("status") == "lost" || point.at("status") == "rejected";
    if (!isRefuted && !isHeld && share < kKnown) known.push_back(share);
  }
  if (points.empty()) return "";
  if (known.empty()) return "no depth is known to better than 20 %";
  std::sort(known.begin(), known.end());
  const double worst = known.size() > kFew ? known[known.size() / 2] : known.back();
  const char* middle = known.size() > kFew ? ", half of them" : "";
  if (known.size() < points.size()) {
    return fmt::format("{} of {} depths known{} to within {} (2 sigma)", known.size(),
                       points.size(), middle, inPercent(worst));
  }
  return fmt::format("depths known{} to within {} (2 sigma)", middle, inPercent(worst));
}

std::string medianError(const Json& points) {
  std::vector<double> errors;
  for (const Json& point : points) {
    const double error = figure(point, "relative_error");
    if (point.at("status") == "valid" && std::isfinite(error)) errors.push_back(error);
  }
  if (errors.empty()) return "";
  return fmt::format("median depth error of {} valid points {}", errors.size(),
                     inPercent(detail::medianOf(errors)));
}

std::string depthsOf(const Json& run) {
  const Json& points = run.at("points");
  const double worst = figure(run.at("metrics"), "final_depth_error_max");
  if (!std::isfinite(worst)) {
    if (!run.value("observes_depth", true)) return "depths are kept as given";
    return knowledge(run);
  }
  if (run.value("truth_is_pose_of_motion", false)) {
    return fmt::format("depths agree with the pose of the target to {}; that is no accuracy",
                       inPercent(worst));
  }
  if (points.size() > kFew) return medianError(points);
  return fmt::format("worst depth error {}", inPercent(worst));
}

}  // namespace

Headline headlineOf(const Json& run) {
  Headline headline = endOf(run);
  std::vector<std::string> details;
  const double error_px = figure(run.at("metrics"), "final_error_px");
  if (std::isfinite(error_px))
    details.push_back(fmt::format("image error {:.2f} px rms", error_px));
  details.push_back(depthsOf(run));
  const char* separator = ": ";
  for (const std::string& detail : details) {
    if (detail.empty()) continue;
    headline.sentence += separator + detail;
    separator = ", ";
  }
  return headline;
}

}  // namespace depthservo
