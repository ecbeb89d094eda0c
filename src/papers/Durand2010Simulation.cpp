#include <algorithm>
#include <cmath>
#include <random>

#include "depthservo/features/TaskFunction.h"
#include "papers/Durand2010.h"

namespace depthservo::durand2010 {
namespace {

constexpr double kGain = 0.7;             // [1/s]
constexpr double kPixel = 1 / kFocal_px;  // normalised
const PanUnicycle::Geometry kGeometry{0.1, 0.1, 0, 0};

const std::array<Eigen::Vector3d, kPoints> kLandmark{
    Eigen::Vector3d(0, -0.3, -0.3), {0, 0.3, -0.3}, {0, 0.3, 0.3}, {0, -0.3, 0.3}};

Eigen::VectorXd features(const Points& points) {
  Eigen::VectorXd s(2 * kPoints);
  for (Eigen::Index i = 0; i < kPoints; ++i) s.segment<2>(2 * i) << points[i].x, points[i].y;
  return s;
}

/// Adds noise to images; all draws from one seed.
class Sensor {
 public:
  Sensor(unsigned seed, Noise noise) : engine_(seed), noise_(noise) {}

  Points measure(Points points) {
    for (PointState& p : points) {
      p.x += draw();
      p.y += draw();
    }
    return points;
  }

 private:
  double draw() {
    switch (noise_) {
      case Noise::gaussian:
        return gaussian_(engine_);
      case Noise::uniform:
        return uniform_(engine_);
      default:
        return 0;
    }
  }

  std::mt19937 engine_;
  Noise noise_;
  std::normal_distribution<double> gaussian_{0, kPixel};
  std::uniform_real_distribution<double> uniform_{-kPixel, kPixel};
};

}  // namespace

const PanUnicycle::State kStart{5, 5, -2.35, 0}, kGoal{1.2, 0, -M_PI, 0};

Points project(const Eigen::Isometry3d& wMc) {
  const Eigen::Isometry3d cMw = wMc.inverse(Eigen::Isometry);
  Points points;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d p = cMw * kLandmark[i];
    points[i] = {p.x() / p.z(), p.y() / p.z(), 1 / p.z()};
  }
  return points;
}

Run simulate(unsigned seed, Noise noise, int ticks, const Occlusion& occlusion) {
  Sensor sensor(seed, noise);
  PanUnicycle robot(kGeometry);
  const Points goal = project(robot.wMcAt(kGoal));
  const TaskFunction task({goal.begin(), goal.end()}, TaskFunction::planar());
  robot.setState(kStart);
  Points start{};
  Run run;
  for (int tick = 0; tick < ticks; ++tick) {
    Tick now;
    now.state = robot.state();
    now.wMc = robot.wMc();
    now.truth = project(now.wMc);
    now.used = now.measured = sensor.measure(now.truth);
    now.error_px = kFocal_px * (features(now.truth) - task.desired()).cwiseAbs().maxCoeff();
    const bool isHidden = occlusion.covers(tick);
    const bool isReconstructed = isHidden && occlusion.what == WhileHidden::reconstruct;
    if (isReconstructed && tick == occlusion.from) {
      for (int i = 0; i < kPoints; ++i) start[i] = occlusion.start(run, i);
    }
    if (isReconstructed) {
      const Motion motion = Motion::fromPoses(run[occlusion.from - 1].wMc, now.wMc, kPeriod_s);
      for (int i = 0; i < kPoints; ++i) {
        const Flow next = flow(motion, start[i]);
        now.used[i] = next.ahead ? next.point : run[tick - 1].used[i];
      }
    } else if (isHidden) {
      now.used = run[tick - 1].used;
    }
    const Eigen::Vector3d twist = -kGain * task.error(features(now.used));  // vx, vz, wy
    now.q = robot.velocityFor({-twist[0], twist[1], twist[2]});
    if (isHidden && occlusion.what == WhileHidden::holdVelocity) now.q = run[tick - 1].q;
    if (isHidden && occlusion.what == WhileHidden::stop) now.q.setZero();
    robot.drive(now.q, kPeriod_s);
    run.push_back(now);
  }
  return run;
}

std::vector<WindowImage> imagesAt(const Run& run, const std::vector<int>& ticks, int point) {
  std::vector<WindowImage> images;
  images.reserve(ticks.size());
  for (int tick : ticks) {
    const PointState& p = run[tick].measured[point];
    const Motion toThere = Motion::fromPoses(run[ticks.front()].wMc, run[tick].wMc, 0);
    images.push_back({{p.x, p.y, kPixel}, toThere, {}});
  }
  return images;
}

WindowFit fitOf(const std::vector<WindowImage>& images, Fit fit) {
  return fit({images.front(), images.data() + 1, images.size() - 1});
}

WindowFit fitAt(const Run& run, int tick, int point, Fit fit, int m) {
  std::vector<int> ticks;
  for (int k = tick; k >= std::max(0, tick - m); --k) ticks.push_back(k);
  return fitOf(imagesAt(run, ticks, point), fit);
}

std::vector<double> SampledObserver::relativeErrors(const Run& run, int point, int ticks) const {
  PanUnicycle robot(kGeometry);
  PointState estimate = run[0].measured[point];
  estimate.chi = 0.1;
  std::vector<double> errors;
  for (int tick = 1; tick < ticks; ++tick) {
    const Motion motion = Motion::fromPoses(run[tick - 1].wMc, run[tick].wMc, kPeriod_s);
    const Flow next = flow(motion, estimate);
    if (next.ahead) estimate = next.point;
    const PointState& measured = run[tick].measured[point];
    const Eigen::Vector2d e(measured.x - estimate.x, measured.y - estimate.y);
    robot.setState(run[tick].state);
    const Eigen::Vector3d v = robot.cameraTwist(run[tick - 1].q).linear;
    const Eigen::Vector2d Omega(-v.x() + measured.x * v.z(), -v.y() + measured.y * v.z());
    const double gain = isScheduled ? k_3 / (Omega.squaredNorm() + 1e-6) : k_3;
    estimate.x += kPeriod_s * k * e.x();
    estimate.y += kPeriod_s * k * e.y();
    estimate.chi = std::clamp(estimate.chi + kPeriod_s * gain * Omega.dot(e), 1e-3, 20.0);
    errors.push_back(estimate.chi / run[tick].truth[point].chi - 1);
  }
  return errors;
}

}  // namespace depthservo::durand2010
