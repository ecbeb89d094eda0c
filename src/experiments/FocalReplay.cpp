#include "depthservo/experiments/FocalReplay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "depthservo/depth/Excitation.h"

namespace depthservo {
namespace {

/// The error settles to 2 % in this share of the sequence, within limits [s].
constexpr double kSettlingShare = 0.1, kFastest_s = 0.5, kSlowest_s = 5;

/// A camera that turns less across its optical axis does not turn: rms [rad/s].
constexpr double kLeastTurnRate = 1e-3;

/// A camera that is this near the axis it turns about is on it [m].
constexpr double kOnAxis_m = 1e-3;

/// Settled estimates whose product with their inverse is this far from 1 deserve a word; settled:
/// 1 sigma, relative.
constexpr double kDisagreement = 0.05, kSettledSigma = 0.02;

double square(double a) { return a * a; }

CentredPixel centred(const PinholeCamera& camera, const FeatureRecord& feature) {
  return {feature.u - camera.cx, (feature.v - camera.cy) * camera.fx / camera.fy, feature.sigma_px};
}

bool isKnown(const Twist& twist) { return !twist.linear.isZero(0) || !twist.angular.isZero(0); }

/// Of a whole sequence.
struct Motions {
  double turnRate = 0;  ///< rms of (wx, wy) [rad/s]
  double rolling = 0;   ///< rms of wz [rad/s]
  double speed = 0;     ///< rms [m/s]
  double lever_m = kUnknown;

  explicit Motions(const RunLog& log) {
    double seconds = 0, tilting2 = 0, rolling2 = 0, speed2 = 0, lever = 0;
    for (std::size_t k = 1; k < log.frames.size(); ++k) {
      const auto& [v, w] = log.frames[k].twist;
      const double dt = log.frames[k].time_s - log.frames[k - 1].time_s;
      seconds += dt;
      tilting2 += dt * w.head<2>().squaredNorm();
      rolling2 += dt * square(w.z());
      speed2 += dt * v.squaredNorm();
      lever += dt * (v.x() * w.y() - v.y() * w.x());
    }
    if (!(seconds > 0)) return;
    turnRate = std::sqrt(tilting2 / seconds);
    rolling = std::sqrt(rolling2 / seconds);
    speed = std::sqrt(speed2 / seconds);
    if (tilting2 > 0) lever_m = lever / tilting2;
  }
};

void requireTurning(const Sequence& sequence, const Motions& motions) {
  if (motions.turnRate >= kLeastTurnRate) return;
  const Hindrance hindrance = motions.rolling >= kLeastTurnRate ? Hindrance::opticalAxisOnly
                              : motions.speed > 0               ? Hindrance::noRotation
                                                                : Hindrance::noMotion;
  throw InputError(
      {sequence.folder(), 0, ""},
      fmt::format("{}: nothing tells the focal length; turn the camera about its x or y axis",
                  describe(hindrance, 0)));
}

/// Root mean square distance of the measured points to the principal point [px].
double radius_px(const RunLog& log) {
  double sum = 0;
  std::size_t count = 0;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (!feature.measured) continue;
      const CentredPixel y = centred(log.camera, feature);
      sum += square(y.y1) + square(y.y2);
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

FocalGains designed(const RunLog& log, const Motions& motions) {
  const double duration_s = log.frames.back().time_s - log.frames.front().time_s;
  const double settling_s = std::clamp(kSettlingShare * duration_s, kFastest_s, kSlowest_s);
  return FocalGains::fromSettlingTime(settling_s, motions.turnRate, std::max(radius_px(log), 1.0));
}

/// The observers of all points.
class Observers {
 public:
  Observers(const PinholeCamera& camera, const FocalGains& gains) : camera_(camera) {
    options_.gains = gains;
  }

  /// \param motion unknown: without a duration
  void advance(const FrameRecord& frame, const Motion& motion) {
    const bool isMotionKnown = motion.dt > 0;
    if (isMotionKnown) excitation_.add(motion);
    for (const FeatureRecord& feature : frame.features) {
      const auto [found, isNew] = observers_.try_emplace(feature.id, options_);
      Observed& o = found->second;
      const CentredPixel y = centred(camera_, feature);
      const bool isStarted = o.observer.estimate().status != DepthStatus::unset;
      if (isMotionKnown) o.observer.predict(motion);
      o.hasGap = o.hasGap || !isMotionKnown;
      o.measured = feature.measured;
      if (!feature.measured) continue;
      if (!isStarted) {
        o.observer.reset(y);
      } else if (o.hasGap) {
        o.observer.resume(y);
      } else {
        o.observer.correct(y);
      }
      o.hasGap = false;
      ++o.frames;
    }
  }

  void record(double time_s, std::vector<FocalRecord>& records) const {
    for (const auto& [id, o] : observers_) {
      const FocalEstimate e = o.observer.estimate();
      if (e.status != DepthStatus::unset) records.push_back({time_s, id, o.measured, e});
    }
  }

  std::vector<FocalPoint> points() const {
    std::vector<FocalPoint> points;
    for (const auto& [id, o] : observers_) {
      const FocalEstimate e = o.observer.estimate();
      if (e.status == DepthStatus::unset) continue;
      FocalPoint point{id, e, o.frames, ""};
      if (e.status == DepthStatus::unexcited) {
        point.unexcited_because = describe(excitation_.ofFocal(e.y1, e.y2), id);
      }
      points.push_back(std::move(point));
    }
    return points;
  }

 private:
  struct Observed {
    explicit Observed(const FocalObserverOptions& options) : observer(options) {}
    FocalLengthObserver observer;
    bool measured = false;
    bool hasGap = false;  // in the odometry, since the last measurement
    std::size_t frames = 0;
  };

  PinholeCamera camera_;
  FocalObserverOptions options_;
  Excitation excitation_;
  std::map<int, Observed> observers_;
};

/// Mean of the estimates worth most, weighted by their sigma.
void combine(FocalReplay& replay) {
  for (const FocalPoint& point : replay.points) {
    const DepthStatus status = point.estimate.status;
    const bool isBetter =
        replay.status == DepthStatus::unset || status == DepthStatus::valid ||
        (status == DepthStatus::converging && replay.status != DepthStatus::valid);
    if (isBetter) replay.status = status;
  }
  double weights = 0, sum = 0;
  for (const FocalPoint& point : replay.points) {
    if (point.estimate.status != replay.status) continue;
    const double weight = 1 / std::max(square(point.estimate.sigma_focal_px), 1e-12);
    weights += weight;
    sum += weight * point.estimate.focal_px;
  }
  if (!(weights > 0)) return;
  replay.focal_px = sum / weights;
  replay.sigma_focal_px = std::sqrt(1 / weights);
  if (replay.Z)
    replay.compensated_px = compensatedFocal(replay.focal_px, replay.lever_m, *replay.Z);
}

}  // namespace

const FocalPoint* contradicted(const FocalReplay& replay) {
  for (const FocalPoint& point : replay.points) {
    const FocalEstimate& e = point.estimate;
    const bool isSettled = e.sigma_focal_px < kSettledSigma * e.focal_px;
    if (isSettled && std::abs(e.consistency() - 1) >= kDisagreement) return &point;
  }
  return nullptr;
}

std::string remark(const FocalReplay& replay) {
  std::string text;
  if (std::abs(replay.lever_m) < kOnAxis_m) {
    text = "The camera turns about its optical centre.";
  } else {
    text =
        fmt::format("The camera is {:.3g} m {} the axis it turns about: ", std::abs(replay.lever_m),
                    replay.lever_m > 0 ? "ahead of" : "behind");
    text += replay.Z ? fmt::format("without that, {:.5g} px for points at {:g} m.",
                                   replay.compensated_px, *replay.Z)
                     : fmt::format("divide by 1 {} {:.3g} m/Z, or give Z with --prior.",
                                   replay.lever_m > 0 ? '+' : '-', std::abs(replay.lever_m));
  }
  if (const FocalPoint* point = contradicted(replay)) {
    text += fmt::format(
        " Lambda and 1/lambda, estimated apart, disagree by {:.2g} % at point {}: the camera also "
        "translates, or the odometry is wrong.",
        100 * std::abs(point->estimate.consistency() - 1), point->id);
  }
  return text;
}

FocalReplay replayFocal(const Sequence& sequence, const FocalReplayOptions& options,
                        RunWatcher* watcher) {
  if (options.replay.motion == MotionSource::target ||
      (options.replay.motion == MotionSource::automatic && sequence.odometry().empty() &&
       sequence.poses().size() < 2)) {
    throw InputError(
        {sequence.folder(), 0, ""},
        "the focal length needs the camera's motion from twist.csv or groundtruth.txt: "
        "the pose of a target is computed with a focal length");
  }
  const RunLog log = replay(sequence, options.replay, watcher);
  const Motions motions(log);
  requireTurning(sequence, motions);

  FocalReplay result;
  result.name = log.name;
  result.camera = log.camera;
  result.frames = log.frames.size();
  result.duration_s = log.frames.back().time_s - log.frames.front().time_s;
  result.lever_m = motions.lever_m;
  result.Z = options.Z;
  result.gains = options.gains.value_or(designed(log, motions));
  Observers observers(log.camera, result.gains);
  for (std::size_t k = 0; k < log.frames.size(); ++k) {
    const FrameRecord& frame = log.frames[k];
    const bool isMotionKnown = k > 0 && isKnown(frame.twist);
    observers.advance(frame,
                      isMotionKnown
                          ? Motion::fromTwist(frame.twist, frame.time_s - log.frames[k - 1].time_s)
                          : Motion());
    observers.record(frame.time_s, result.records);
  }
  result.points = observers.points();
  if (result.points.empty()) {
    throw InputError({sequence.folder(), 0, ""}, "no point was ever measured");
  }
  combine(result);
  return result;
}

}  // namespace depthservo
