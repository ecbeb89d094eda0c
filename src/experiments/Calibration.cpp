#include "depthservo/experiments/Calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/text/InputError.h"
#include "depthservo/tracking/TargetPose.h"
#include "observation/errorsOf.h"

namespace depthservo {
namespace {

/// A constant is shown where its sigma fell below this share of the prior's.
constexpr double kShown = 0.5;
/// A noise level is shown where its logarithm is known to this.
constexpr double kShownLevel = 0.5;
constexpr int kRestarts = 3;
constexpr std::array<double, 3> kSteps{0.7, 0.4, 0.25};  // of the logarithm of a level
constexpr double kLargestStep = 1.4;

struct Image {
  double time_s;
  std::vector<PointObservation> points;
};

/// What the filter is given.
struct Recording {
  MotionBuffer odometry;
  std::vector<Image> images;
  std::size_t points = 0;
  double focal_px = 1, sigma_px = 0;
  double rowScale = 0, rowOffset = 0;

  /// \param wanted a point that is used however short its track is; null: none
  Recording(const RunLog& log, std::size_t most, const int* wanted)
      : odometry(log.odometry.size() + 2) {
    odometry.setMeaning(log.rows);
    for (const OdometryRow& row : log.odometry) odometry.push(row.time_s, row.twist);
    const PinholeCamera& camera = log.camera;
    focal_px = camera.focal_px();
    rowScale = camera.fy / camera.height;
    rowOffset = camera.cy / camera.height;
    const std::vector<int> ids = seenLongest(log, most, wanted);
    points = ids.size();
    double squares = 0, count = 0;
    for (const FrameRecord& frame : log.frames) {
      Image image{frame.time_s, {}};
      for (const FeatureRecord& f : frame.features) {
        if (!f.measured || std::find(ids.begin(), ids.end(), f.id) == ids.end()) continue;
        const double sigma = f.sigma_px > 0 ? f.sigma_px : 0.5;
        squares += sigma * sigma;
        ++count;
        const Eigen::Vector2d point = camera.normalise(f.u, f.v);
        image.points.push_back({f.id, {point.x(), point.y(), sigma / focal_px}});
      }
      images.push_back(std::move(image));
    }
    if (count > 0) sigma_px = std::sqrt(squares / count);
  }

 private:
  static std::vector<int> seenLongest(const RunLog& log, std::size_t most, const int* wanted) {
    std::map<int, int> images;
    for (const FrameRecord& frame : log.frames) {
      for (const FeatureRecord& f : frame.features) images[f.id] += f.measured;
    }
    std::vector<std::pair<int, int>> order;
    for (const auto& [id, count] : images) {
      const bool isWanted = wanted && id == *wanted;
      if (count > 1) order.emplace_back(isWanted ? std::numeric_limits<int>::min() : -count, id);
    }
    std::sort(order.begin(), order.end());
    if (wanted && (order.empty() || order.front().second != *wanted)) {
      throw InputError({log.name, 0, ""},
                       fmt::format("point {} was not seen in two images", *wanted));
    }
    order.resize(std::min(order.size(), most));
    std::vector<int> ids;
    for (const auto& [count, id] : order) ids.push_back(id);
    return ids;
  }
};

/// A noise level: where it stands, and what it is called.
struct Level {
  const char* name;
  const char* unit;
  double* value;
};

/// Depths that are known without odometry.
struct KnownDepths {
  std::size_t images = 0;                 // so many were taken by then
  std::vector<std::pair<int, double>> Z;  // by id [m]; empty: none
  double sigma = 0;                       // relative, common to all
  bool isByFocal = false;                 // they grow with the true focal length

  KnownDepths(const RunLog& log, const CalibrationOptions& options) {
    if (options.distance) {
      images = log.frames.size();
      Z.push_back(*options.distance);
    } else if (options.target.points.size() >= 4) {
      for (images = log.frames.size(); images > 0; --images) {
        readTarget(log.frames[images - 1], log.camera, options.target);
        if (!Z.empty()) break;
      }
    }
  }

 private:
  /// From the pose of the target in one image. Its distance is as uncertain as its size there.
  void readTarget(const FrameRecord& frame, const PinholeCamera& camera, const DotTarget& target) {
    std::vector<TrackedPoint> points;
    Eigen::Vector2d middle(0, 0);
    for (const FeatureRecord& f : frame.features) {
      if (!f.measured || f.id >= static_cast<int>(target.points.size())) continue;
      points.push_back({f.id, f.u, f.v, f.sigma_px});
      middle += Eigen::Vector2d(f.u, f.v);
    }
    const auto pose = TargetPose(target, camera).compute(points);
    if (!pose) return;
    middle /= static_cast<double>(points.size());
    double squares = 0, noise_px = pose->residual_px;
    for (const TrackedPoint& point : points) {
      squares += (Eigen::Vector2d(point.u, point.v) - middle).squaredNorm();
      noise_px = std::max(noise_px, point.sigma_px);
      Z.emplace_back(point.id, (pose->cMo * target.points[static_cast<std::size_t>(point.id)]).z());
    }
    sigma = noise_px / std::sqrt(squares);
    isByFocal = true;
  }
};

class Fit {
 public:
  Fit(const Recording& recording, KnownDepths known, const CalibrationOptions& options)
      : recording_(recording),
        known_(std::move(known)),
        options_(options),
        errors_(options.prior) {}

  /// The filter after so many images. \param pixels factor on the sigma of measurements
  SharedErrorFilter run(const ErrorProfile& errors, double pixels, std::size_t images) const {
    SharedErrorFilterOptions filter;
    filter.errors = errors;
    filter.focal_px = recording_.focal_px;
    filter.rowScale = recording_.rowScale;
    filter.rowOffset = recording_.rowOffset;
    filter.places = recording_.points;
    filter.isCautious = false;  // what it is levels of noise that shall explain
    SharedErrorFilter result(recording_.points, filter, options_.depth, options_.range);
    std::vector<PointObservation> points;
    for (std::size_t k = 0; k < images; ++k) {
      const Image& image = recording_.images[k];
      const Coverage coverage = result.advance(recording_.odometry, image.time_s);
      if (coverage == Coverage::afterEnd || coverage == Coverage::reversed) continue;
      points = image.points;
      for (PointObservation& point : points) point.measurement.sigma *= pixels;
      result.correct(points);
    }
    return result;
  }
  SharedErrorFilter run() const { return run(errors_, pixels_, recording_.images.size()); }

  Calibration solve() {
    Calibration result;
    learnConstants();
    result.noises = learnLevels();
    const SharedErrorFilter filter = learnConstants();
    result.constants = describe(filter);
    result.nis = filter.meanNis();
    result.innovations = filter.innovations();
    result.images = recording_.images.size();
    result.points = recording_.points;
    result.pixelNoise_px = pixels_ * recording_.sigma_px;
    result.constants.push_back(scale());
    result.profile = profileOf(result.constants);
    return result;
  }

 private:
  using Shared = SharedErrorFilter::Shared;

  static bool isShown(const Shared& state) {
    return state.prior > 0 && state.sigma < kShown * state.prior;
  }
  static double shownOrExpected(const Shared& state) {
    return isShown(state) ? state.value : state.expected;
  }

  /// Starts anew from what was learnt, so that the last run is linearised there.
  SharedErrorFilter learnConstants() {
    for (int i = 0;; ++i) {
      SharedErrorFilter filter = run();
      if (i == kRestarts) return filter;
      errors_.values.latency_s = shownOrExpected(filter.latency());
      errors_.values.focal = shownOrExpected(filter.focal());
      for (int axis = 0; axis < 3; ++axis) {
        errors_.values.gyroBias_rad_s(axis) = shownOrExpected(filter.gyroBias(axis));
        errors_.values.mount_rad(axis) = shownOrExpected(filter.mount(axis));
      }
    }
  }

  std::vector<Calibrated> learnLevels() {
    pixels_ = 1;
    const std::array<Level, 6> levels{{{"pixel_noise", "px", &pixels_},
                                       {"wander", "px", &errors_.wander_px.sigma},
                                       {"slip", "", &errors_.slip.sigma},
                                       {"gyro_noise", "rad/s", &errors_.odometry.sigma_w},
                                       {"velocity_noise", "m/s", &errors_.odometry.sigma_v},
                                       {"stamp_jitter", "s", &errors_.jitter_s}}};
    std::array<double, 6> sigma{}, prior{};
    for (std::size_t i = 0; i < levels.size(); ++i) prior[i] = *levels[i].value;
    for (const double step : kSteps) {
      for (std::size_t i = 0; i < levels.size(); ++i) sigma[i] = improve(*levels[i].value, step);
    }
    std::vector<Calibrated> result;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const Level& level = levels[i];
      if (!(prior[i] > 0)) continue;
      Calibrated c{level.name, level.unit, *level.value, sigma[i] * *level.value, true, ""};
      c.isShown = sigma[i] < kShownLevel;
      if (!c.isShown) {  // what is too small to be seen
        c.missing = "hardly seen here; it is below or near what the images show";
      }
      if (level.value == &pixels_) {
        c.value *= recording_.sigma_px;
        c.sigma *= recording_.sigma_px;
      }
      result.push_back(c);
    }
    return result;
  }

  /// One step along the logarithm of a level. \return sigma of the logarithm
  double improve(double& level, double step) {
    if (!(level > 0)) return INFINITY;
    const double middle = level;
    const auto cost = [&](double by) {
      level = middle * std::exp(by);
      const SharedErrorFilter filter = run();
      return filter.cost() * filter.innovations();
    };
    const double below = cost(-step), here = cost(0), above = cost(step);
    const double slope = (above - below) / (2 * step);
    const double curvature = (above - 2 * here + below) / (step * step);
    double by = below < above ? -step : step;
    if (curvature > 0) by = std::clamp(-slope / curvature, -kLargestStep, kLargestStep);
    level = middle * std::exp(by);
    return curvature > 0 ? 1 / std::sqrt(curvature) : INFINITY;
  }

  static Calibrated constant(const std::string& name, const char* unit, const Shared& state,
                             double nis, const char* missing) {
    Calibrated c{name, unit, state.expected, state.prior, isShown(state), ""};
    if (!(state.prior > 0)) missing = "the profile at the start excludes it";
    if (state.expected != 0) missing = "known as well by the profile at the start";
    if (c.isShown) {
      c.value = state.value;
      c.sigma = state.sigma * std::sqrt(std::max(1., nis / 2));
    } else {
      c.missing = missing;
    }
    return c;
  }

  std::vector<Calibrated> describe(const SharedErrorFilter& f) const {
    const double nis = f.meanNis();
    std::vector<Calibrated> all;
    all.push_back(constant("latency", "s", f.latency(), nis,
                           "drive curves with changing speed: start, stop, turn to and fro"));
    for (int axis = 0; axis < 3; ++axis) {
      all.push_back(constant(fmt::format("gyro_bias[{}]", axis), "rad/s", f.gyroBias(axis), nis,
                             "keep the points in view for longer; stand still, then turn"));
    }
    for (int axis = 0; axis < 3; ++axis) {
      all.push_back(constant(fmt::format("mount[{}]", axis), "rad", f.mount(axis), nis,
                             "drive curves, forwards and past the points"));
    }
    all.push_back(constant("focal", "", f.focal(), nis,
                           "turn on the spot, the points from one edge of the image to the other"));
    return all;
  }

  /// By depths that are known; of the filter that trusts the odometry's scale.
  Calibrated scale() const {
    Calibrated c{"scale", "", 0, options_.prior.scale, false, ""};
    if (known_.Z.empty()) {
      c.missing =
          "no image tells it: have a target of known size in view, or measure the distance of a "
          "point, --distance ID:METRES";
      return c;
    }
    ErrorProfile trusting = errors_;
    trusting.scale = 0;
    const SharedErrorFilter filter = run(trusting, pixels_, known_.images);
    double count = 0, ratio = 0, sigma = 0;
    for (const auto& [id, Z] : known_.Z) {
      const DepthEstimate e = filter.estimate(id);
      if (e.status != DepthStatus::valid) continue;
      ++count;
      ratio += Z / e.Z();
      sigma += e.sigma_Z() / e.Z();  // most of it is common to all
    }
    if (count == 0) {
      c.missing = "the depths of the known points are not known well; drive curves past them";
      return c;
    }
    ratio /= count;
    sigma = std::hypot(sigma / count, known_.sigma);
    if (known_.isByFocal) {
      ratio *= 1 + filter.focal().value;
      sigma = std::hypot(sigma, filter.focal().sigma);
    }
    c.value = ratio - 1;
    c.sigma = ratio * sigma;
    c.isShown = c.sigma < kShown * options_.prior.scale;
    if (!c.isShown) c.missing = fmt::format("{:.4f} +- {:.4f}; drive for longer", c.value, c.sigma);
    return c;
  }

  ErrorProfile profileOf(const std::vector<Calibrated>& constants) const {
    ErrorProfile p = errors_;
    const auto at = [&](std::size_t i) { return constants[i].value; };
    p.values.latency_s = at(0);
    p.latency_s = constants[0].sigma;
    for (int axis = 0; axis < 3; ++axis) {
      const Calibrated& bias = constants[static_cast<std::size_t>(1 + axis)];
      const Calibrated& mount = constants[static_cast<std::size_t>(4 + axis)];
      p.values.gyroBias_rad_s(axis) = bias.value;
      p.values.gyroBiasSigma_rad_s(axis) = bias.sigma;
      p.values.mount_rad(axis) = mount.value;
      p.values.mountSigma_rad(axis) = mount.sigma;
    }
    p.values.focal = at(7);
    p.focal = constants[7].sigma;
    if (constants[8].isShown) {
      p.values.scale = at(8);
      p.scale = constants[8].sigma;
    }
    return p;
  }

  const Recording& recording_;
  KnownDepths known_;
  const CalibrationOptions& options_;
  ErrorProfile errors_;
  double pixels_ = 1;
};

std::string list(const Eigen::Vector3d& v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v(0), v(1), v(2));
}

}  // namespace

bool Calibration::showsAnything() const {
  return std::any_of(constants.begin(), constants.end(),
                     [](const Calibrated& c) { return c.isShown; });
}

ErrorProfile priorOf(ObservationOptions& options) {
  options.depth.errors = errorKindOf(options);
  if (const auto errors = errorsOf(options)) return *errors;
  options.depth.errors = ErrorKind::typical;
  return ErrorProfile::typical();
}

Calibration calibrate(const RunLog& log, const CalibrationOptions& options) {
  if (log.odometry.size() < 2) {
    throw InputError({log.name, 0, ""}, "has no odometry; record its rows with the images");
  }
  const int* const wanted = options.distance ? &options.distance->first : nullptr;
  const Recording recording(log, options.points, wanted);
  if (recording.points == 0) {
    throw InputError({log.name, 0, ""}, "no point was seen in two images; see --tracker");
  }
  return Fit(recording, KnownDepths(log, options), options).solve();
}

std::string profileYaml(const Calibration& c) {
  const ErrorProfile& p = c.profile;
  const ErrorProfile::Values& v = p.values;
  std::string text = fmt::format(
      "# Errors of a robot, by depthservo calibrate: {} images, {} points. Give it to --errors, "
      "and "
      "--pixel-noise {:.3g}\n",
      c.images, c.points, c.pixelNoise_px);
  for (const Calibrated& constant : c.constants) {
    if (!constant.isShown)
      text += fmt::format("# {}: not shown; {}\n", constant.name, constant.missing);
  }
  text += fmt::format(
      "scale: {:.6g}\nslip: {{sigma: {:.6g}, tau: {:.6g}}}\ngyro_bias: {:.6g}\ngyro_noise: "
      "{:.6g}\nvelocity_noise: {:.6g}\nlatency: {:.6g}\nstamp_jitter: {:.6g}\nreadout: "
      "{:.6g}\nfocal: {:.6g}\nmount: {:.6g}\nwander: {{sigma: {:.6g}, tau: {:.6g}}}\n"
      "pose_noise: {{position: {:.6g}, angle: {:.6g}, tau: {:.6g}}}\n",
      p.scale, p.slip.sigma, p.slip.tau_s, p.gyroBias_rad_s, p.odometry.sigma_w, p.odometry.sigma_v,
      p.latency_s, p.jitter_s, p.readout_s, p.focal, p.mount_rad, p.wander_px.sigma,
      p.wander_px.tau_s, p.position_m, p.angle_rad, p.poseTau_s);
  text += fmt::format(
      "values:\n  scale: {:.6g}\n  latency: {:.6g}\n  focal: {:.6g}\n  gyro_bias: {}\n  "
      "gyro_bias_sigma: {}\n  mount: {}\n  mount_sigma: {}\n",
      v.scale, v.latency_s, v.focal, list(v.gyroBias_rad_s), list(v.gyroBiasSigma_rad_s),
      list(v.mount_rad), list(v.mountSigma_rad));
  return text;
}

}  // namespace depthservo
