// What every estimator, observer and feature promises, whatever it is called with, in any order: nothing that is
// not finite, no Z <= 0, no exception, and a status that says what the number is worth.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <set>

#include "depthservo/depth/ConsistencyMonitor.h"
#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/FocalLengthObserver.h"
#include "depthservo/depth/InverseDepthFilterBatch.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NoiseLearner.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/depth/TwoFrameLeastSquares.h"
#include "depthservo/depth/WindowDepthEstimator.h"
#include "depthservo/features/FeatureDepth.h"
#include "depthservo/features/FeatureEllipse.h"
#include "depthservo/features/FeatureLine.h"
#include "depthservo/features/FeatureMoments.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/features/FeaturePointPolar.h"
#include "depthservo/features/FeatureSegment.h"
#include "depthservo/pose/VisualMotionObserver.h"
#include "depthservo/visp/using.h"
#include "support/CallSequence.h"

namespace depthservo {
namespace {

using test::Call;
using test::Callable;

constexpr std::size_t kCapacity = 4;
const DepthRange kRange{.1, 50};

Twist twistOf(const Call& call) {
  return {{call.v[0], call.v[1], call.v[2]}, {call.v[3], call.v[4], call.v[5]}};
}

/// dt of usual frame rates, unless what was drawn is odd.
double dtOf(double v) { return v >= -1 && v <= 1 && v != 0 ? std::abs(v) / 10 : v; }

Motion motionOf(const Call& call) { return Motion::fromTwist(twistOf(call), dtOf(call.v[6])); }

std::string textOf(const DepthEstimate& e) {
  return fmt::format("x {} y {} chi {} sigma_chi {} sigma_xy {} excitation {} {}", e.x, e.y, e.chi,
                     e.sigma_chi, e.sigma_xy, e.excitation, toString(e.status));
}

std::string faultIn(const DepthEstimate& e, const DepthRange& range) {
  const bool isFinite = std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.chi) &&
                        std::isfinite(e.sigma_chi) && std::isfinite(e.excitation) &&
                        std::isfinite(e.sigma_Z()) && std::isfinite(e.sigma_xy);
  if (!isFinite) return "not finite: " + textOf(e);
  if (!(e.Z() >= range.Z_min * (1 - 1e-12) && e.Z() <= range.Z_max * (1 + 1e-12))) {
    return "out of range: " + textOf(e);
  }
  if (!(e.sigma_chi >= 0 && e.sigma_xy >= 0 && e.excitation >= 0)) return "negative: " + textOf(e);
  const auto interval = e.interval();
  if (!(interval.low > 0 && interval.low <= e.Z() * (1 + 1e-12) && interval.high >= e.Z() * (1 - 1e-12))) {
    return fmt::format("interval [{}, {}]: ", interval.low, interval.high) + textOf(e);
  }
  if (!(e.cautiousZ() > 0 && std::isfinite(e.cautiousZ()))) return "no cautious Z: " + textOf(e);
  if (e.status == DepthStatus::valid && !range.isFound(e.chi, e.sigma_chi)) {
    return "valid, and is not: " + textOf(e);
  }
  return "";
}

/// Whether a status says that the point is measured at present.
bool saysMeasured(DepthStatus status) {
  return status == DepthStatus::converging || status == DepthStatus::valid ||
         status == DepthStatus::unexcited;
}

/// What is left of an object whose contents were taken away can still be used.
template <class T>
void takeAway(T& object) {
  const T taken(std::move(object));
}

/// What an unknown motion must not do: make a depth better known. A point that was lost begins anew.
std::string shrinking(const DepthEstimate& before, const DepthEstimate& after) {
  if (before.status == DepthStatus::lost) return "";
  constexpr double kRounding = 1e-6;  // of covariances that motions have made ill-conditioned
  const double least = std::min(before.sigma_chi, DepthPrior::kWideSigma_chi) * (1 - kRounding);
  if (after.status == DepthStatus::lost || after.sigma_chi >= least) return "";
  return "sigma shrank from " + textOf(before) + " to " + textOf(after);
}

template <class Estimator>
class OnePoint : public Callable {
 public:
  explicit OnePoint(const Estimator& prototype) : estimator_(prototype) {}

  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"reset", 5, false},       {"predict", 7, false},
                                         {"correct", 3, false},     {"predict", 7, false},
                                         {"correct", 3, false},     {"correctDepth", 2, false},
                                         {"predictUnknown", 6, false}, {"correctUnknown", 6, false},
                                         {"predictRaw", 7, false},  {"copy", 0, false},
                                         {"takeAway", 0, false}};
    return all;
  }

  std::string call(const Call& c) override {
    const DepthEstimate before = estimator_.estimate();
    const PointMeasurement z{c.v[0], c.v[1], c.v[2] / 100};
    std::string fault;
    switch (c.method) {
      case 0:
        estimator_.reset(z, {c.v[3] * 5, c.v[4]});
        if (z.isUsable()) state_ = State::measured;
        break;
      case 1:
      case 3:
        predict(motionOf(c));
        break;
      case 2:
      case 4:
        estimator_.correct(z);
        if (z.isUsable() && state_ == State::moved) state_ = State::measured;
        break;
      case 5:
        estimator_.correctDepth({c.v[0] * 5, c.v[1]});
        break;
      case 6:
      case 7: {
        const Motion unknown = Motion::notKnown({dtOf(c.v[3]), std::abs(c.v[4]), std::abs(c.v[5])});
        if (!unknown.isUsable()) break;
        predict(unknown);
        fault = shrinking(before, estimator_.estimate());
        if (c.method == 6 || !fault.empty()) break;
        estimator_.correct(z);
        if (z.isUsable() && state_ == State::moved) state_ = State::measured;
        fault = shrinking(before, estimator_.estimate());
        break;
      }
      case 8: {
        Motion motion = motionOf(c);
        motion.dt = c.v[0];
        motion.dt2 = c.v[1];
        motion.within = {c.v[2], c.v[3]};
        motion.t.x() = c.v[4];
        predict(motion);
        break;
      }
      case 9: {
        const Estimator copy(estimator_);
        estimator_ = copy;
        break;
      }
      default:
        takeAway(estimator_);
        state_ = State::any;
    }
    const DepthEstimate now = estimator_.estimate();
    if (fault.empty()) fault = faultIn(now, kRange);
    if (!fault.empty()) return fault;
    if (state_ == State::unset && now.status != DepthStatus::unset) return "set by nothing: " + textOf(now);
    if (state_ == State::moved && saysMeasured(now.status)) return "measured by nothing: " + textOf(now);
    return "";
  }

 private:
  void predict(const Motion& motion) {
    estimator_.predict(motion);
    if (motion.isUsable() && state_ == State::measured) state_ = State::moved;
  }

  enum class State { unset, measured, moved, any };  // moved: and not measured since
  Estimator estimator_;
  State state_ = State::unset;
};

class Odometry {
 public:
  const MotionBuffer& rows() const { return rows_; }
  double time() const { return time_s_; }

  /// A row now, and then the time goes on.
  void go(const Call& c) {
    rows_.push(time_s_, twistOf(c));
    time_s_ += std::abs(c.v[6]) <= 1 ? std::abs(c.v[6]) / 10 : 0.1;
  }
  void goUnknown(double dt) {
    rows_.pushUnknown(time_s_);
    time_s_ += std::abs(dt) <= 1 ? std::abs(dt) : 10;
  }

 private:
  MotionBuffer rows_{16};
  double time_s_ = 100;
};

template <class Estimator>
class PointSet : public Callable {
 public:
  explicit PointSet(const Estimator& prototype) : estimator_(prototype) {}

  static std::vector<Method> common() {
    return {{"go", 7, false},           {"advance", 0, false},     {"see", 3, true},
            {"see", 3, true},           {"see", 3, true},          {"correct", 0, false},
            {"advanceTo", 1, false},    {"goUnknown", 1, false},   {"correctDepth", 2, true},
            {"setPrior", 2, true},      {"retire", 0, true},       {"setNoise", 6, false},
            {"estimateAt", 1, true},    {"reset", 0, false},       {"copy", 0, false},
            {"takeAway", 0, false},     {"goAndCorrect", 7, false}};
  }
  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all = common();
    return all;
  }

  std::string call(const Call& c) override {
    std::string fault;
    switch (c.method) {
      case 0:
        odometry_.go(c);
        break;
      case 1:
        advance(odometry_.time());
        break;
      case 2:
      case 3:
      case 4:
        seen_.push_back({c.id, {c.v[0], c.v[1], c.v[2] / 100}});
        break;
      case 5:
        correct();
        break;
      case 6:
        advance(std::abs(c.v[0]) < 1 ? odometry_.time() + c.v[0] : c.v[0]);
        break;
      case 7:
        odometry_.goUnknown(c.v[0]);
        break;
      case 8:
        estimator_.correctDepth(c.id, {c.v[0] * 5, c.v[1]});
        break;
      case 9:
        if (estimator_.setPrior(c.id, {c.v[0] * 5, c.v[1]})) fresh_[c.id] = true;
        break;
      case 10:
        if (estimator_.retire(c.id)) known_.erase(c.id);
        break;
      case 11:
        estimator_.setNoise({{c.v[0], {c.v[1], c.v[2]}}, {c.v[3], {c.v[4], c.v[2]}}, {c.v[5], {}}});
        break;
      case 12:
        fault = faultIn(estimator_.estimate(c.id, odometry_.rows(),
                                            std::abs(c.v[0]) < 1 ? odometry_.time() + c.v[0] : c.v[0]),
                        estimator_.range());
        break;
      case 13:
        estimator_.reset();
        known_.clear();
        break;
      case 14: {
        const Estimator copy(estimator_);
        fault = same(copy);
        break;
      }
      case 15:
        takeAway(estimator_);
        isWhole_ = false;
        break;
      default:
        odometry_.go(c);
        advance(odometry_.time());
        correct();
    }
    if (!fault.empty()) return fault;
    for (const int id : {c.id, -1, 0, 1, 2, 3, 4, 5}) {
      const DepthEstimate e = estimator_.estimate(id);
      fault = faultIn(e, estimator_.range());
      if (!fault.empty()) return fmt::format("point {}: {}", id, fault);
      if (!isWhole_) continue;
      if (known_.count(id) == 0 && e.status != DepthStatus::unset) {
        return fmt::format("point {} set by nothing: {}", id, textOf(e));
      }
      if (!fresh_[id] && saysMeasured(e.status)) {
        return fmt::format("point {} measured by nothing: {}", id, textOf(e));
      }
    }
    return "";
  }

 private:
  void advance(double time_s) {
    const double before_s = estimator_.time();
    estimator_.advance(odometry_.rows(), time_s);
    // What was seen before the first image's time was told is of that image.
    if (estimator_.time() != before_s && !std::isnan(before_s)) fresh_.clear();
  }
  void correct() {
    estimator_.correct(seen_);
    for (const PointObservation& o : seen_) {
      if (!o.measurement.isUsable()) continue;
      known_.insert(o.id);
      fresh_[o.id] = true;
    }
    seen_.clear();
  }
  std::string same(const Estimator& copy) const {
    for (int id = 0; id < 6; ++id) {
      const std::string here = textOf(estimator_.estimate(id)), there = textOf(copy.estimate(id));
      if (here != there) return "a copy says " + there + " instead of " + here;
    }
    return "";
  }

  Estimator estimator_;
  Odometry odometry_;
  std::vector<PointObservation> seen_;
  std::set<int> known_;
  std::map<int, bool> fresh_;  // measured since the last advance
  bool isWhole_ = true;
};

class Batch : public Callable {
 public:
  static constexpr std::size_t kPoints = 11;
  explicit Batch(InverseDepthFilterBatch::Instructions instructions)
      : batch_(kPoints, {}, kRange, instructions) {}

  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"reset", 5, true},       {"predict", 7, false},
                                         {"correct", 7, true},     {"correctDepth", 2, true},
                                         {"predict", 7, false},    {"correct", 7, true},
                                         {"resetAll", 5, false},   {"copy", 0, false},
                                         {"takeAway", 0, false}};
    return all;
  }
  std::string call(const Call& c) override {
    const std::size_t i = static_cast<std::size_t>(std::abs(c.id)) % kPoints;
    switch (c.method) {
      case 0:
        batch_.reset(i, {c.v[0], c.v[1], c.v[2] / 100}, {c.v[3] * 5, c.v[4]});
        break;
      case 1:
      case 4:
        batch_.predict(motionOf(c));
        break;
      case 2:
      case 5: {
        std::array<double, kPoints> x, y, sigma;
        for (std::size_t k = 0; k < kPoints; ++k) {
          x[k] = k == i ? c.v[3] : c.v[0] + double(k) / 100;
          y[k] = k == i ? c.v[4] : c.v[1];
          sigma[k] = (k == i ? c.v[5] : std::abs(c.v[2])) / 100;
        }
        batch_.correct(x.data(), y.data(), sigma.data());
        break;
      }
      case 3:
        batch_.correctDepth(i, {c.v[0] * 5, c.v[1]});
        break;
      case 6:
        for (std::size_t k = 0; k < kPoints; ++k) {
          batch_.reset(k, {c.v[0] + double(k) / 100, c.v[1], std::abs(c.v[2]) / 100}, {c.v[3] * 5, c.v[4]});
        }
        break;
      case 7: {
        const InverseDepthFilterBatch copy(batch_);
        batch_ = copy;
        break;
      }
      default:
        takeAway(batch_);
    }
    for (std::size_t k = 0; k < kPoints; ++k) {
      const std::string fault = faultIn(batch_.estimate(k), kRange);
      if (!fault.empty()) return fmt::format("point {}: {}", k, fault);
    }
    return "";
  }

 private:
  InverseDepthFilterBatch batch_;
};

class Focal : public Callable {
 public:
  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"reset", 4, false},   {"predict", 7, false}, {"correct", 3, false},
                                         {"resume", 3, false},  {"predict", 7, false}, {"correct", 3, false},
                                         {"takeAway", 0, false}};
    return all;
  }
  std::string call(const Call& c) override {
    const CentredPixel z{c.v[0] * 300, c.v[1] * 300, std::abs(c.v[2])};
    switch (c.method) {
      case 0:
        observer_.reset(z, c.v[3] * 1000);
        break;
      case 1:
      case 4:
        observer_.predict(motionOf(c));
        break;
      case 2:
      case 5:
        observer_.correct(z);
        break;
      case 3:
        observer_.resume(z);
        break;
      default:
        takeAway(observer_);
    }
    const FocalEstimate e = observer_.estimate();
    const double all[] = {e.y1, e.y2, e.focal_px, e.inverseFocal, e.sigma_focal_px, e.eta1,
                          e.eta2, e.sigma_min, e.decayRate, e.consistency()};
    for (const double value : all) {
      if (!std::isfinite(value)) return fmt::format("not finite: {}", fmt::join(all, " "));
    }
    const bool isPositive = e.focal_px >= 0 && e.inverseFocal >= 0 && e.sigma_focal_px >= 0;
    return isPositive ? "" : fmt::format("negative: {}", fmt::join(all, " "));
  }

 private:
  FocalLengthObserver observer_;
};

/// Those that say something of the robot, from what the points do.
class Judges : public Callable {
 public:
  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"predict", 7, false}, {"see", 3, true},    {"see", 3, true},
                                         {"see", 3, true},      {"correct", 0, false}, {"predictUnknown", 3, false},
                                         {"retire", 0, true},   {"forgetPoints", 0, false}, {"reset", 0, false},
                                         {"takeAway", 0, false}};
    return all;
  }
  std::string call(const Call& c) override {
    switch (c.method) {
      case 0:
        move(motionOf(c));
        break;
      case 1:
      case 2:
      case 3:
        seen_.push_back({c.id, {c.v[0], c.v[1], c.v[2] / 100}});
        break;
      case 4:
        correct();
        break;
      case 5:
        move(Motion::notKnown({dtOf(c.v[0]), c.v[1], c.v[2]}));
        break;
      case 6:
        monitor_.retire(c.id);
        break;
      case 7:
        monitor_.forgetPoints();
        break;
      case 8:
        monitor_.reset();
        break;
      default:
        takeAway(monitor_);
        takeAway(learner_);
    }
    const auto d = monitor_.diagnosis();
    const auto total = monitor_.total();
    const MeasurementNoise noise = learner_.noise();
    const double all[] = {d.size, d.evidence, d.meanNis, total.meanNis, total.rejectedShare(),
                          monitor_.varianceFactor(), learner_.pixelFactor(), noise.pixel_px.sigma(),
                          noise.position_m.sigma(), noise.angle_rad.sigma()};
    for (const double value : all) {
      if (!std::isfinite(value)) return fmt::format("not finite: {}", fmt::join(all, " "));
    }
    if (!(monitor_.varianceFactor() >= 1 && learner_.pixelFactor() > 0)) {
      return fmt::format("too small: {}", fmt::join(all, " "));
    }
    return d.message().empty() ? "no message" : "";
  }

 private:
  static SharedErrorFilterOptions typical() {
    SharedErrorFilterOptions options;
    options.errors = ErrorProfile::poses();
    return options;
  }
  void move(const Motion& motion) {
    monitor_.predict(motion);
    motion_ = motion;
  }
  void correct() {
    monitor_.correct(seen_);
    std::sort(seen_.begin(), seen_.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    time_s_ += 0.1;
    odometry_.push(time_s_ - 0.1, motion_.isUsable() ? motion_.twist() : Twist{});
    filter_.advance(odometry_, time_s_);
    filter_.correct(seen_);
    learner_.observe(motion_, seen_, filter_);
    seen_.clear();
  }

  ConsistencyMonitor monitor_{kCapacity, {}, {}, kRange};
  SharedErrorFilter filter_{kCapacity, typical(), {}, kRange};
  NoiseLearner learner_{kCapacity, typical(), 0.5};
  MotionBuffer odometry_{16};
  Motion motion_;
  double time_s_ = 0;
  std::vector<PointObservation> seen_;
};

class Buffer : public Callable {
 public:
  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"push", 7, false},      {"push", 7, false},    {"pushUnknown", 1, false},
                                         {"holdUntil", 1, false}, {"motion", 2, false},  {"meanTwist", 2, false},
                                         {"setMeaning", 0, true}, {"clear", 0, false},   {"takeAway", 0, false}};
    return all;
  }
  std::string call(const Call& c) override {
    switch (c.method) {
      case 0:
      case 1:
        last_s_ = std::abs(c.v[6]) < 1 ? last_s_ + std::abs(c.v[6]) / 10 : c.v[6];
        buffer_.push(last_s_, twistOf(c));
        break;
      case 2:
        buffer_.pushUnknown(time(c.v[0]));
        break;
      case 3:
        buffer_.holdUntil(time(c.v[0]));
        break;
      case 4: {
        const auto [motion, coverage] = buffer_.motion(time(c.v[0]), time(c.v[1]));
        if (!hasMotion(coverage) && (motion.dt != 0 || !motion.t.isZero())) return "a motion that is not known";
        break;
      }
      case 5: {
        const auto [twist, coverage] = buffer_.meanTwist(time(c.v[0]), time(c.v[1]));
        if (coverage != Coverage::complete && !twist.vector().isZero()) return "a twist that is not known";
        break;
      }
      case 6:
        buffer_.setMeaning(static_cast<RowMeaning>(std::abs(c.id) % 3));
        break;
      case 7:
        buffer_.clear();
        break;
      default:
        takeAway(buffer_);
    }
    buffer_.saysUntil(c.v[0]);
    return "";
  }

 private:
  double time(double v) const { return std::abs(v) < 1 ? last_s_ + v : v; }
  MotionBuffer buffer_{8};
  double last_s_ = 0;
};

struct Pose : PointSet<VisualMotionObserver> {
  Pose()
      : PointSet(VisualMotionObserver({{-.1, -.1, 0}, {.1, -.1, 0}, {.1, .1, 0}, {-.1, .1, .05}}, {}, kRange)) {}
};

vpColVector columns(const Call& c) {
  vpColVector v(c.id % 7 == 6 ? 5 : 6);
  for (unsigned i = 0; i < v.size(); ++i) v[i] = c.v[i];
  return v;
}

template <class Matrix>
bool isFinite(const Matrix& m) {
  return std::all_of(m.data, m.data + m.size(), [](double value) { return std::isfinite(value); });
}

/// How the numbers of a call become the place of a feature, and what is to be asked of it.
void set(FeaturePoint& s, const Call& c) {
  s.set_x(c.v[0]);
  s.set_y(c.v[1]);
}
void set(FeaturePointPolar& s, const Call& c) {
  s.set_rho(c.v[0]);
  s.set_theta(c.v[1]);
}
void set(FeatureDepth& s, const Call& c) {
  s.set_x(c.v[0]);
  s.set_y(c.v[1]);
}
void set(FeatureSegment& s, const Call& c) {
  s.setXc(c.v[0]);
  s.setYc(c.v[1]);
  s.setL(c.v[2]);
  s.setAlpha(c.v[3]);
}
void set(FeatureLine& s, const Call& c) { s.buildFrom(c.v[0], c.v[1]); }
void set(FeatureEllipse& s, const Call& c) {
  s.buildFrom(c.v[0], c.v[1], std::abs(c.v[2]) / 50, c.v[3] / 100, std::abs(c.v[4]) / 50);
}

template <class F>
auto guess(F& s, const Call& c, int) -> decltype(s.set_Z(0.)) { s.set_Z(c.v[0] * 5); }
void guess(FeatureSegment& s, const Call& c, long) {
  s.setZ1(c.v[0] * 5);
  s.setZ2(c.v[1] * 5);
}
void guess(FeatureLine& s, const Call& c, long) { s.setABCD(c.v[0], c.v[1], c.v[2], c.v[3]); }
void guess(FeatureEllipse& s, const Call& c, long) { s.setABC(c.v[0], c.v[1], c.v[2]); }

const vpCameraParameters kCamera(600, 600, 320, 240);

template <class F>
auto tell(F& s, const Call& c, int) -> decltype(s.setDepth(0., 0.)) {
  s.setDepth(c.v[0] * 5, c.v[1]);
  s.setDesiredDepth(c.v[2] * 5);
  s.setNoise(c.v[4], kCamera);
}
void tell(FeatureSegment& s, const Call& c, long) {
  s.setDesiredDepths(c.v[0] * 5, c.v[1] * 5);
  s.setNoise(c.v[4], kCamera);
}
void tell(FeatureLine& s, const Call& c, long) {
  s.setDesiredDepth(c.v[0] * 5);
  s.setNoise(c.v[1], c.v[2]);
}
void tell(FeatureEllipse& s, const Call& c, long) {
  s.setDesiredDepth(c.v[0] * 5);
  s.setNoise(c.v[4], kCamera);
}

template <class F>
std::vector<DepthEstimate> estimatesOf(const F& s) { return {s.estimate()}; }
std::vector<DepthEstimate> estimatesOf(const FeatureSegment& s) { return {s.estimate(0), s.estimate(1)}; }

template <class Feature>
class OneFeature : public Callable {
 public:
  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"set", 5, false},   {"observe", 7, true}, {"setAndObserve", 7, true},
                                         {"guess", 4, false}, {"tell", 5, false},   {"setUnknownMotion", 4, false},
                                         {"copy", 0, false},  {"takeAway", 0, false}, {"init", 0, false}};
    return all;
  }
  std::string call(const Call& c) override {
    switch (c.method) {
      case 0:
        set(s_, c);
        return "";  // as with ViSP's own, until it is observed
      case 1:
        s_.observe(columns(c), dtOf(c.v[6]));
        break;
      case 2:
        set(s_, c);
        s_.observe(columns(c), dtOf(c.v[6]));
        break;
      case 3:
        try {
          guess(s_, c, 0);
        } catch (const vpException&) {  // some of ViSP's own setters refuse Z <= 0
        }
        return "";
      case 4:
        tell(s_, c, 0);
        return "";
      case 5:
        s_.setUnknownMotion({c.v[0], c.v[1], c.v[2], c.v[3]});
        return "";
      case 6: {
        const Feature copy(s_);
        s_ = copy;
        return "";
      }
      case 7:
        takeAway(s_);
        return "";
      default:
        s_.init();
        return "";
    }
    for (const DepthEstimate& e : estimatesOf(s_)) {
      const std::string fault = faultIn(e, DepthRange{});
      if (!fault.empty()) return fault;
      if (e.status == DepthStatus::unset) return "";  // as ViSP's own until then
    }
    if (!isFinite(s_.get_s())) return "the feature is not finite";
    if (!isFinite(s_.interaction())) return "the interaction matrix is not finite";
    return "";
  }

 private:
  Feature s_;
};

class Group : public Callable {
 public:
  Group() : s_(SharedErrorFilter(kCapacity, {}, {}, kRange), kCapacity), moments_(0.2) {}

  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"set", 2, true},      {"set", 2, true},      {"set", 2, true},
                                         {"set_Z", 1, true},    {"observe", 7, true},  {"observe", 7, true},
                                         {"setDepth", 2, true}, {"setUnknownMotion", 4, false}};
    return all;
  }
  std::string call(const Call& c) override {
    const std::size_t i = static_cast<std::size_t>(std::abs(c.id)) % kCapacity;
    switch (c.method) {
      case 0:
      case 1:
      case 2:
        set(s_[i], c);
        return "";
      case 3:
        s_[i].set_Z(c.v[0] * 5);
        return "";
      case 4:
      case 5:
        s_.observe(columns(c), dtOf(c.v[6]));
        break;
      case 6:
        s_.setDepth(i, c.v[0] * 5, c.v[1]);
        return "";
      default:
        s_.setUnknownMotion({c.v[0], c.v[1], c.v[2], c.v[3]});
        return "";
    }
    for (std::size_t k = 0; k < kCapacity; ++k) {
      const std::string fault = faultIn(s_[k].estimate(), kRange);
      if (!fault.empty()) return fault;
      if (!isFinite(s_[k].get_s()) || !isFinite(s_[k].interaction())) return "a feature is not finite";
    }
    moments_.update(s_);
    if (!isFinite(moments_.get_s()) || !isFinite(moments_.interaction())) return "moments are not finite";
    return "";
  }

 private:
  FeaturePointGroup s_;
  FeatureMoments moments_;
};

template <class Object, class... Arguments>
test::MakeCallable making(const Arguments&... arguments) {
  return [=] { return std::make_unique<Object>(arguments...); };
}
template <class Estimator>
test::MakeCallable onePoint(const Estimator& prototype) {
  return making<OnePoint<Estimator>>(prototype);
}
template <class Estimator>
test::MakeCallable pointSet(const Estimator& prototype) {
  return making<PointSet<Estimator>>(prototype);
}

InverseDepthFilterOptions considering() {
  InverseDepthFilterOptions options;
  options.odometryScaleSigma = 0.02;
  options.focalSigma = 0.01;
  return options;
}

JointDepthFilterOptions everything() {
  JointDepthFilterOptions options;
  options.estimateGyroBias = options.estimateFocal = true;
  options.filter.odometryScaleSigma = 0.02;
  return options;
}

SharedErrorFilterOptions typical(int places) {
  SharedErrorFilterOptions options;
  options.errors = ErrorProfile::typical();
  options.places = places;
  return options;
}

struct Kind {
  std::string name;
  test::MakeCallable make;
};

const std::vector<Kind> kKinds{
    {"ConstantDepth", onePoint(ConstantDepth(kRange))},
    {"TwoFrameLeastSquares", onePoint(TwoFrameLeastSquares(kRange))},
    {"NonlinearDepthObserver", onePoint(NonlinearDepthObserver({}, kRange))},
    {"WindowDepthEstimator", onePoint(WindowDepthEstimator({}, kRange))},
    {"InverseDepthFilter", onePoint(InverseDepthFilter({}, kRange))},
    {"InverseDepthFilterConsidering", onePoint(InverseDepthFilter(considering(), kRange))},
    {"BatchPortable", making<Batch>(InverseDepthFilterBatch::Instructions::portable)},
    {"BatchBest", making<Batch>(InverseDepthFilterBatch::best())},
    {"PointwiseFilter", pointSet(PointwiseEstimator(InverseDepthFilter({}, kRange), kCapacity, {}, kRange))},
    {"PointwiseObserver", pointSet(PointwiseEstimator(NonlinearDepthObserver({}, kRange), kCapacity, {}, kRange))},
    {"PointwiseWindow", pointSet(PointwiseEstimator(WindowDepthEstimator({}, kRange), kCapacity, {}, kRange))},
    {"ObjectDepthObserver", pointSet(ObjectDepthObserver(kCapacity, {}, {}, kRange))},
    {"JointDepthFilter", pointSet(JointDepthFilter(kCapacity, {}, {}, kRange))},
    {"JointDepthFilterOfEverything", pointSet(JointDepthFilter(kCapacity, everything(), {}, kRange))},
    {"SharedErrorFilter", pointSet(SharedErrorFilter(kCapacity, typical(8), {}, kRange))},
    {"SharedErrorFilterOfFewPlaces", pointSet(SharedErrorFilter(kCapacity, typical(2), {}, kRange))},
    {"SeparatePoints", pointSet(SeparatePoints(SharedErrorFilter(1, typical(1), {}, kRange), kCapacity, {}))},
    {"VisualMotionObserver", making<Pose>()},
    {"FocalLengthObserver", making<Focal>()},
    {"MonitorAndLearner", making<Judges>()},
    {"MotionBuffer", making<Buffer>()},
    {"FeaturePoint", making<OneFeature<FeaturePoint>>()},
    {"FeaturePointPolar", making<OneFeature<FeaturePointPolar>>()},
    {"FeatureDepth", making<OneFeature<FeatureDepth>>()},
    {"FeatureSegment", making<OneFeature<FeatureSegment>>()},
    {"FeatureLine", making<OneFeature<FeatureLine>>()},
    {"FeatureEllipse", making<OneFeature<FeatureEllipse>>()},
    {"FeaturePointGroup", making<Group>()}};

/// ViSP says on stdout what it thinks of a feature.
class EstimatorContracts : public testing::TestWithParam<Kind> {
 protected:
  ~EstimatorContracts() override {
    std::cout.rdbuf(cout_);
    std::cerr.rdbuf(cerr_);
  }
  std::streambuf *cout_ = std::cout.rdbuf(nullptr), *cerr_ = std::cerr.rdbuf(nullptr);
};
INSTANTIATE_TEST_SUITE_P(All, EstimatorContracts, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return kind.param.name; });

/// DEPTHSERVO_CALLS: in all; scripts/test-long has ten million.
TEST_P(EstimatorContracts, hold_whatever_is_called_in_any_order) {
  const char* const given = std::getenv("DEPTHSERVO_CALLS");
#ifdef __SANITIZE_ADDRESS__
  const double calls = given ? std::atof(given) : 3e4;
#else
  const double calls = given ? std::atof(given) : 3e5;
#endif
  const auto each = static_cast<std::size_t>(calls / double(kKinds.size()));
  const std::string broken = test::brokenBy(GetParam().make, each, 1);
  EXPECT_TRUE(broken.empty()) << broken;
}

/// The machinery itself: it finds a fault, and tells it in as few calls as there can be.
class Counter : public Callable {
 public:
  const std::vector<Method>& methods() const override {
    static const std::vector<Method> all{{"add", 1, false}, {"forget", 0, false}, {"nothing", 2, true}};
    return all;
  }
  std::string call(const Call& c) override {
    if (c.method == 0 && std::isnan(c.v[0])) ++count_;
    if (c.method == 1) count_ = 0;
    return count_ < 2 ? "" : "two";
  }

 private:
  int count_ = 0;
};

TEST(CallSequence, what_breaks_a_promise_is_told_in_the_fewest_calls) {
  EXPECT_EQ(test::brokenBy(making<Counter>(), 1'000'000, 1), "  add(nan);\n  add(nan);\n  // two\n");
}

}  // namespace
}  // namespace depthservo
