#include "depthservo/observation/RunLog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "observation/imageError.h"

namespace depthservo {

const char* toString(Outcome outcome) {
  switch (outcome) {
    case Outcome::converged:
      return "converged";
    case Outcome::stalled:
      return "stalled";
    case Outcome::leftImage:
      return "left-image";
    case Outcome::lost:
      return "lost";
    case Outcome::diverged:
      return "diverged";
    case Outcome::collision:
      return "collision";
    case Outcome::timeout:
      return "timeout";
  }
  return "";
}

namespace {

/// No cause is no agreement: the innovations, too, must be what was declared.
bool isFarFromDeclared(const ConsistencyMonitor::Diagnosis& d) {
  constexpr double kExpected = 2, kShare = 0.25, kSurely = 5;
  const double sigma = kExpected / std::sqrt(std::max(1, d.values));
  return d.meanNis > kExpected * (1 + kShare) && d.meanNis > kExpected + kSurely * sigma;
}

}  // namespace

std::string RunDiagnosis::message() const {
  if (latest.cause == ConsistencyMonitor::Cause::none && isFarFromDeclared(latest)) {
    return fmt::format(
        "innovations are {:.1f} times the declared variance (mean NIS {:.2f} of {} values, "
        "expected 2), for no reason that could be named: sigma may be too small",
        latest.meanNis / 2, latest.meanNis, latest.values);
  }
  const bool isRange = latest.cause == ConsistencyMonitor::Cause::unit && latest.size == 0;
  if (isRange) return explanation;
  return latest.message() + (isCompensated ? "; the joint filter takes it into account" : "") +
         (explanation.empty() ? "" : ". " + explanation);
}

bool JointStates::estimates(ConsistencyMonitor::Cause cause) const {
  switch (cause) {
    case ConsistencyMonitor::Cause::latency:
      return timeOffset.isEstimated;
    case ConsistencyMonitor::Cause::gyroBias:
      return gyroBias[0].isEstimated;
    case ConsistencyMonitor::Cause::focalLength:
      return focal.isEstimated;
    default:
      return false;
  }
}

std::string sentenceOf(const MeasurementNoise& noise) {
  const auto share = [](const NoiseLevel& level) {
    return std::round(100 * std::pow(level.lasting.sigma / level.sigma(), 2));
  };
  return fmt::format(
      "{:.2f} px ({} % of the variance lasts), poses {:.2g} mm ({} %) and {:.2g} mrad ({} %), 1 "
      "sigma per axis",
      noise.pixel_px.sigma(), share(noise.pixel_px), 1e3 * noise.position_m.sigma(),
      share(noise.position_m), 1e3 * noise.angle_rad.sigma(), share(noise.angle_rad));
}

std::vector<std::string> JointStates::sentences(double focal_px) const {
  std::vector<std::string> all;
  if (timeOffset.isEstimated) {
    all.push_back(timeOffset.isObserved
                      ? fmt::format("images are {:.1f} +- {:.1f} ms late against the odometry",
                                    1e3 * timeOffset.value, 2e3 * timeOffset.sigma)
                      : "how late the images are is not known: the velocity changes too little");
  }
  if (gyroBias[0].isEstimated) {
    std::string bias, unknown;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]);
      if (gyroBias[i].isObserved) {
        bias += fmt::format("{}{} {:.4f} +- {:.4f}", bias.empty() ? "" : ", ", axis,
                            gyroBias[i].value, 2 * gyroBias[i].sigma);
      } else {
        unknown += (unknown.empty() ? "" : ", ") + axis;
      }
    }
    if (!bias.empty()) all.push_back("gyro bias [rad/s]: " + bias);
    if (!unknown.empty()) {
      all.push_back("gyro bias about " + unknown + " is not known: this motion does not show it");
    }
  }
  if (focal.isEstimated) {
    all.push_back(focal.isObserved
                      ? fmt::format("focal length {:.2f} +- {:.2f} px, {:+.2f} % of the given one",
                                    focal.value * focal_px, 2 * focal.sigma * focal_px,
                                    100 * (focal.value - 1))
                      : fmt::format("focal length is not known: this motion does not show it "
                                    "(+- {:.1f} %); turn about two axes while moving sideways",
                                    200 * focal.sigma));
  }
  return all;
}

namespace {

/// Of the goal i; most frames have all features, in order. Null: it has none.
const FeatureRecord* featureOf(const FrameRecord& frame, std::size_t i) {
  const auto& all = frame.features;
  const auto isIt = [i](const FeatureRecord& feature) { return feature.id == static_cast<int>(i); };
  if (i < all.size() && isIt(all[i])) return &all[i];
  const auto found = std::find_if(all.begin(), all.end(), isIt);
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

double meanImageError(const RunLog& log, double from_s, double to_s) {
  return imageErrorBeyondNoise(log, from_s, to_s, 0);
}

double imageErrorBeyondNoise(const RunLog& log, double from_s, double to_s, double standardErrors) {
  constexpr double kSlack_s = 1e-6;
  double squared = 0;
  int features = 0;
  for (std::size_t i = 0; i < log.goals.size(); ++i) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double squares = 0;
    int count = 0;
    for (auto frame = log.frames.rbegin();
         frame != log.frames.rend() && frame->time_s >= from_s - kSlack_s; ++frame) {
      if (frame->time_s > to_s + kSlack_s) continue;
      const FeatureRecord* feature = featureOf(*frame, i);
      if (!feature) continue;
      const Eigen::Vector2d error = Eigen::Vector2d(feature->u, feature->v) - log.goals[i];
      sum += error;
      squares += error.squaredNorm();
      ++count;
    }
    if (count == 0) continue;
    const double mean2 = (sum / count).squaredNorm();
    const double variance = std::max(0., squares / count - mean2);
    const double noise2 = standardErrors * standardErrors * variance / count;
    squared += std::max(mean2 - noise2, 0.);  // in this order a position that is none stays one
    ++features;
  }
  return features > 0 ? std::sqrt(squared / features) : kUnknown;
}

}  // namespace depthservo
