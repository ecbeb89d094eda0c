#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/motion/MotionBuffer.h"
#include "support/Random.h"

/// A wheeled robot with everyday errors, simulated on its own: poses by small steps of the base,
/// rows by the way its wheels and its gyro measured, points by projection.
namespace depthservo::test {

/// What really errs; drawn per robot. Signs as in SharedErrorFilter.
struct RobotErrors {
  double S = 0, slipSigma = 0, slipTau_s = 0.5;
  Eigen::Vector3d bias = Eigen::Vector3d::Zero(), mount = Eigen::Vector3d::Zero();
  double gyroNoise = 0, tick_m = 0, latency_s = 0, jitter_s = 0, kappa = 1;
  double readout_s = 0;  // of a rolling shutter, from the top of the image to its bottom
  double pixelNoise_px = 0.2, wander_px = 0, wanderTau_s = 0.7;

  /// The sizes that a usual robot has. \param size scales every one of them
  static RobotErrors typical(Random& random, double size = 1) {
    RobotErrors e;
    const auto three = [&](double sigma) {
      return Eigen::Vector3d(random.normal(sigma), random.normal(sigma), random.normal(sigma));
    };
    e.S = random.normal(.01 * size);
    e.slipSigma = .02 * size;
    e.bias = three(.004 * size);
    e.gyroNoise = .002 * size;
    e.tick_m = .001 * size;
    e.latency_s = .012 * size;
    e.jitter_s = .002 * size;
    e.kappa = 1 + random.normal(.003 * size);
    e.mount = three(.007 * size);
    e.wander_px = .15 * size;
    return e;
  }

  /// Drawn from the priors of ErrorProfile::typical().
  static RobotErrors ofPrior(Random& random) {
    RobotErrors e = typical(random);
    const ErrorProfile p = ErrorProfile::typical();
    const auto three = [&](double sigma) {
      return Eigen::Vector3d(random.normal(sigma), random.normal(sigma), random.normal(sigma));
    };
    e.S = random.normal(p.scale);
    e.bias = three(p.gyroBias_rad_s);
    e.gyroNoise = p.odometry.sigma_w;
    e.latency_s = random.normal(p.latency_s);
    e.kappa = 1 + random.normal(p.focal);
    e.mount = three(p.mount_rad);
    return e;
  }
};

inline constexpr double kRobotFocal_px = 600;

/// Row of a point over the height of the image.
inline double imageRow(double y) { return 1.25 * y + 0.5; }

/// How the base drives: speed [m/s] and turn rate [rad/s] at a time.
struct Drive {
  static constexpr double kPi = 3.14159265358979323846;
  double v, v_wave, w, w_wave, period_s;

  double speed(double t) const { return v + v_wave * std::sin(2 * kPi * t / period_s); }
  double turn(double t) const {
    return w * speed(t) + w_wave * std::sin(2 * kPi * t / (1.3 * period_s) + 1);
  }
};

struct RobotRun {
  MotionBuffer odometry{4096, 0.02};
  struct Image {
    double stamp_s;
    std::vector<PointObservation> points;
    std::vector<double> Z;  // true, at the exposure
  };
  std::vector<Image> images;
};

/// \param points in world coordinates, z up; the robot starts at the origin along x
/// \param aside direction of the optical axis from the base's x towards y [rad]
inline RobotRun drive(const Drive& course, const RobotErrors& errors, double aside,
                      const std::vector<Eigen::Vector3d>& points, unsigned seed,
                      double duration_s = 20) {
  Random random(seed);
  constexpr double kStep_s = 1e-3, kRow_s = 0.02, kImage_s = 1. / 30, kWarmUp_s = 1;
  const Eigen::Vector3d offset(.1, .05, .3);
  // Columns: the axes of the assumed camera frame in the base's.
  Eigen::Matrix3d bRc;
  const Eigen::Vector3d forward(std::cos(aside), std::sin(aside), 0);
  bRc.col(2) = forward;
  bRc.col(1) = -Eigen::Vector3d::UnitZ();
  bRc.col(0) = bRc.col(1).cross(forward);
  const Eigen::Matrix3d mount =
      errors.mount.norm() > 0
          ? Eigen::AngleAxisd(errors.mount.norm(), errors.mount.normalized()).toRotationMatrix()
          : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d bRtrue = bRc * mount;

  RobotRun run;
  double x = 0, y = 0, theta = 0, slip = random.normal(errors.slipSigma);
  double way = 0, turned = 0, toldWay = 0, rowStart = -kWarmUp_s, nextRow = rowStart + kRow_s;
  std::vector<Eigen::Vector2d> wander(points.size());
  for (auto& w : wander) w = {random.normal(errors.wander_px), random.normal(errors.wander_px)};
  int image = 0;
  const auto steps = static_cast<int>((duration_s + kWarmUp_s) / kStep_s);
  for (int i = 0; i <= steps; ++i) {
    const double t = i * kStep_s - kWarmUp_s;
    // The image's stamp is later than its exposure.
    while (image * kImage_s <= t) {
      RobotRun::Image seen;
      seen.stamp_s = image * kImage_s + errors.latency_s +
                     (errors.jitter_s > 0 ? random.normal(errors.jitter_s) : 0);
      const double rho = std::exp(-kImage_s / errors.wanderTau_s);
      // The point in the camera, this time later.
      const auto inCamera = [&](const Eigen::Vector3d& point, double later_s) -> Eigen::Vector3d {
        const double ahead = later_s * course.speed(t), heading = theta + later_s * course.turn(t);
        const Eigen::Matrix3d wRb =
            Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
        const Eigen::Vector3d base(x + ahead * std::cos(theta), y + ahead * std::sin(theta), 0);
        return (wRb * bRtrue).transpose() * (point - base - wRb * offset);
      };
      for (std::size_t p = 0; p < points.size(); ++p) {
        Eigen::Vector3d c = inCamera(points[p], 0);
        seen.Z.push_back(c.z());
        if (errors.readout_s > 0) {
          c = inCamera(points[p], errors.readout_s * imageRow(c.y() / c.z()));
        }
        for (int a = 0; a < 2; ++a) {
          wander[p](a) = rho * wander[p](a) +
                         random.normal(errors.wander_px * std::sqrt(1 - rho * rho) + 1e-300);
        }
        const double sigma = errors.pixelNoise_px / kRobotFocal_px;
        const double u =
            errors.kappa * c.x() / c.z() + wander[p](0) / kRobotFocal_px + random.normal(sigma);
        const double v =
            errors.kappa * c.y() / c.z() + wander[p](1) / kRobotFocal_px + random.normal(sigma);
        if (c.z() > .2 && std::abs(u) < .6 && std::abs(v) < .45) {
          seen.points.push_back({static_cast<int>(p), {u, v, sigma}});
        }
      }
      run.images.push_back(seen);
      ++image;
    }
    if (t >= nextRow - 1e-9) {
      const double told = errors.tick_m > 0 ? std::floor(way / errors.tick_m) * errors.tick_m : way;
      const Eigen::Vector3d v((told - toldWay) / kRow_s, 0, 0), w(0, 0, turned / kRow_s);
      Twist twist;
      twist.linear = bRc.transpose() * (v + w.cross(offset));
      twist.angular = bRc.transpose() * w + errors.bias;
      for (int a = 0; a < 3; ++a) {
        if (errors.gyroNoise > 0) twist.angular(a) += random.normal(errors.gyroNoise);
      }
      run.odometry.push(rowStart, twist);
      toldWay = told;
      turned = 0;
      rowStart = nextRow;
      nextRow += kRow_s;
    }
    const double v = course.speed(t), w = course.turn(t);
    if (errors.slipSigma > 0) {
      const double rho = std::exp(-kStep_s / errors.slipTau_s);
      slip = rho * slip + random.normal(errors.slipSigma * std::sqrt(1 - rho * rho));
    }
    x += kStep_s * v * std::cos(theta + .5 * kStep_s * w);
    y += kStep_s * v * std::sin(theta + .5 * kStep_s * w);
    theta += kStep_s * w;
    turned += kStep_s * w;
    way += kStep_s * v / (1 + errors.S + slip);
  }
  return run;
}

/// Of the depths called valid after three seconds.
struct Honesty {
  double coverage = 0;  // share within two sigma
  double valid = 0;     // share called valid
  double error = 0;     // median, relative
  double scaled = 0;    // the same with the robot's true scale taken out
};

/// A robot with its errors, and a recording of 20 s: round twelve points, or past them.
struct Robot {
  static constexpr std::size_t kPoints = 12;

  RobotErrors errors;
  RobotRun run;

  Robot(unsigned seed, const RobotErrors& of) : errors(of) {
    Random random(seed);
    const bool isArc = seed % 2 == 0;
    const Drive course = isArc ? Drive{.3, .12, .30, .10, 5} : Drive{.25, .1, .05, .15, 6};
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double x = random.uniform(-1, 1), y = random.uniform(-1, 1),
                   z = random.uniform(-.3, .9);
      points.push_back(isArc ? Eigen::Vector3d(x, 3.3 + y, z)
                             : Eigen::Vector3d(2.5 + 1.5 * x, 3.5 + y, z));
    }
    constexpr double kToTheLeft = 1.5707963267948966;
    run = drive(course, errors, kToTheLeft, points, seed);
  }

  static Robot typical(unsigned seed, double size = 1) {
    Random random(5000 + seed);
    return Robot(seed, RobotErrors::typical(random, size));
  }

  /// The same with wheels that slip so much (1 sigma).
  static Robot slipping(unsigned seed, double sigma) {
    Random random(5000 + seed);
    RobotErrors errors = RobotErrors::typical(random);
    errors.slipSigma = sigma;
    return Robot(seed, errors);
  }

  static Robot ofPrior(unsigned seed) {
    Random random(7000 + seed);
    return Robot(seed, RobotErrors::ofPrior(random));
  }

  Honesty judge(PointSetEstimator& estimator) const {
    std::vector<double> relative, scaled;
    double covered = 0, all = 0;
    for (const RobotRun::Image& image : run.images) {
      estimator.advance(run.odometry, image.stamp_s);
      estimator.correct(image.points);
      if (image.stamp_s < 3) continue;
      for (const PointObservation& o : image.points) {
        ++all;
        const DepthEstimate e = estimator.estimate(o.id);
        if (e.status != DepthStatus::valid) continue;
        const double Z = image.Z[static_cast<std::size_t>(o.id)];
        covered += std::abs(e.Z() - Z) <= 2 * e.sigma_Z();
        relative.push_back(std::abs(e.Z() - Z) / Z);
        scaled.push_back(std::abs(e.Z() * (1 + errors.S) - Z) / Z);
      }
    }
    if (relative.empty()) return {};
    const auto valid = static_cast<double>(relative.size());
    return {covered / valid, valid / all, median(relative), median(scaled)};
  }

  static double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
};

}  // namespace depthservo::test
