#include "servo/World.h"

#include <algorithm>
#include <cmath>

#include "depthservo/sequence/SequenceWriter.h"

namespace depthservo {
namespace {

constexpr double kSmallestOutlier_px = 5, kLargestOutlier_px = 50;

SyntheticCameraOptions cameraOptions(const Scenario& scenario) {
  SyntheticCameraOptions options;
  if (scenario.sensing.light_on_dark) std::swap(options.background, options.dot);
  options.gray_noise = scenario.sensing.gray_noise;
  options.exposure_s = scenario.sensing.exposure;
  options.vignetting = scenario.sensing.vignetting;
  options.seed = scenario.seed;
  return options;
}

Eigen::Vector2d wheelSpeeds(const Eigen::Vector2d& velocity, double wheelBase) {
  const double turn = 0.5 * velocity[1] * wheelBase;
  return {velocity[0] - turn, velocity[0] + turn};
}

Eigen::Vector2d robotVelocity(const Eigen::Vector2d& wheelSpeeds, double wheelBase) {
  return {0.5 * (wheelSpeeds[0] + wheelSpeeds[1]), (wheelSpeeds[1] - wheelSpeeds[0]) / wheelBase};
}

}  // namespace

World::World(const Scenario& scenario)
    : scenario_(scenario),
      robot_(scenario.robot.camera_offset, scenario.robot.camera_yaw),
      camera_(scenario.camera.pinhole(), scenario.target.dots(), cameraOptions(scenario)),
      wMo_(scenario.target.pose.isometry()),
      random_(scenario.seed) {
  const auto& initial = scenario.robot.initial;
  const auto& limits = scenario.robot.limits;
  robot_.setPose({initial.x, initial.y, initial.theta});
  robot_.setLimits({limits.v, limits.w, limits.dv, limits.dw});
  robot_.setLag(scenario.robot.lag);
}

void World::advanceTo(double time_s) {
  const Scenario::Odometry& odometry = scenario_.odometry;
  const auto rowTime = [&](std::uint64_t row) {
    return fileTime(static_cast<double>(row) / odometry.rate);
  };
  while (time_s_ < time_s) {
    const bool beginsRow = rowTime(rows_) <= time_s_;
    if (beginsRow) ++rows_;
    if (beginsRow && odometry.mode == OdometryMode::commanded) {
      disturbance_ = odometry.noise.cwiseProduct(gaussian2());
      robot_.setDisturbance(disturbance_);
    }
    const double until = std::min(time_s, rowTime(rows_));
    const double duration_s = until - time_s_;
    const Eigen::Vector2d wheelsBefore = wheels_;
    robot_.drive(command_, duration_s);
    wheels_ += wheelSpeeds(robot_.velocity(), odometry.wheel_base) * duration_s;
    if (beginsRow) odometry_.push_back({time_s_, measuredTwist(wheelsBefore, duration_s)});
    time_s_ = until;
  }
}

Twist World::measuredTwist(const Eigen::Vector2d& wheelsBefore, double duration_s) {
  const Scenario::Odometry& odometry = scenario_.odometry;
  Eigen::Vector2d velocity = robot_.velocity() - disturbance_;
  if (odometry.ticks > 0) {
    const auto counted = [&](const Eigen::Vector2d& wheels) -> Eigen::Vector2d {
      return (wheels / odometry.ticks).array().floor() * odometry.ticks;
    };
    velocity =
        robotVelocity((counted(wheels_) - counted(wheelsBefore)) / duration_s, odometry.wheel_base);
  }
  Twist twist = robot_.cameraTwist(velocity);
  twist.linear *= odometry.scale;
  if (odometry.mode == OdometryMode::measured && !odometry.noise.isZero()) {
    for (double& v : twist.linear) v += odometry.noise[0] * gaussian_(random_);
    for (double& w : twist.angular) w += odometry.noise[1] * gaussian_(random_);
  }
  return twist;
}

std::vector<World::TruePoint> World::goal() const {
  const auto& goal = *scenario_.robot.goal;
  return seenFrom(robot_.wMcAt({goal.x, goal.y, goal.theta}));
}

std::vector<World::TruePoint> World::seenFrom(const Eigen::Isometry3d& wMc) const {
  const Eigen::Isometry3d cMo = wMc.inverse() * wMo_;
  const bool throughImages = scenario_.sensing.source == Scenario::Source::image;
  std::vector<TruePoint> points;
  for (std::size_t i = 0; i < scenario_.target.points.size(); ++i) {
    const double Z = (cMo * scenario_.target.points[i]).z();
    auto seen = camera_.centre(cMo, i);
    if (throughImages) {
      const auto ellipse = camera_.ellipse(cMo, i);
      if (ellipse) seen = ellipse->centre;
    }
    points.push_back({seen ? seen->x() : kUnknown, seen ? seen->y() : kUnknown, Z});
  }
  return points;
}

bool World::isHidden(std::size_t point) const {
  return std::any_of(scenario_.sensing.hidden.begin(), scenario_.sensing.hidden.end(),
                     [&](const Scenario::Hidden& hidden) {
                       return hidden.covers(time_s_, static_cast<int>(point));
                     });
}

std::vector<Eigen::Vector2d> World::pixelErrors() {
  const Scenario::Sensing& sensing = scenario_.sensing;
  std::vector<Eigen::Vector2d> errors;
  for (std::size_t i = 0; i < scenario_.target.points.size(); ++i) {
    Eigen::Vector2d error = Eigen::Vector2d::Zero();
    if (sensing.pixel_noise > 0) error = sensing.pixel_noise * gaussian2();
    if (sensing.outliers > 0) {
      std::uniform_real_distribution<double> fraction;
      const bool isOutlier = fraction(random_) < sensing.outliers;
      const double angle = 2 * M_PI * fraction(random_);
      const double size =
          kSmallestOutlier_px + (kLargestOutlier_px - kSmallestOutlier_px) * fraction(random_);
      if (isOutlier) error += size * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    errors.push_back(error);
  }
  return errors;
}

void World::expose(DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  const Eigen::Isometry3d cMo = robot_.wMc().inverse() * wMo_;
  SyntheticView view;
  view.cMo = cMo;
  view.twist = robot_.cameraTwist(robot_.velocity());
  view.displacement = pixelErrors();
  view.frame = images_++;
  for (std::size_t i = 0; i < scenario_.target.points.size(); ++i) {
    if (!isHidden(i)) continue;
    if (const auto occluder = camera_.occluderOf(cMo, i)) view.occluders.push_back(*occluder);
  }
  camera_.render(view, image);
}

std::vector<TrackedPoint> World::measure() {
  const auto points = truth();
  const auto errors = pixelErrors();
  std::vector<TrackedPoint> measured;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double u = points[i].u + errors[i].x(), v = points[i].v + errors[i].y();
    if (isHidden(i) || !scenario_.camera.pinhole().contains(u, v)) continue;
    measured.push_back({static_cast<int>(i), u, v, scenario_.sensing.assumedNoise_px()});
  }
  return measured;
}

}  // namespace depthservo
