#include "rig/World.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "depthservo/motion/Motion.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "robots/wheels.h"

namespace depthservo {
namespace {

constexpr double kSmallestOutlier_px = 5, kLargestOutlier_px = 50;
constexpr double kTargetStep_s = 0.005;  // its twist is taken at the middle of such steps

SyntheticCameraOptions cameraOptions(const SimulatedRigOptions& rig) {
  SyntheticCameraOptions options;
  if (rig.sensing.light_on_dark) std::swap(options.background, options.dot);
  options.gray_noise = rig.sensing.gray_noise;
  options.exposure_s = rig.sensing.exposure;
  options.vignetting = rig.sensing.vignetting;
  options.seed = rig.seed;
  return options;
}

SyntheticCamera makeCamera(const SimulatedRigOptions& rig) {
  const PinholeCamera camera = rig.camera.truePinhole();
  const SyntheticCameraOptions options = cameraOptions(rig);
  const TargetOptions& target = rig.target;
  return target.type == TargetKind::dots
             ? SyntheticCamera(camera, DotTarget{target.points, target.radius}, options)
             : SyntheticCamera(camera, target.patches(), options);
}

std::optional<Eigen::Quaterniond> mountOf(const RobotOptions& robot) {
  if (robot.mount_error.isZero(0)) return std::nullopt;
  const RpyPose mount{Eigen::Vector3d::Zero(), robot.mount_error};
  return Eigen::Quaterniond(mount.isometry().linear());
}

/// Homography (3x3) that takes four pixels to four others; the identity where there is none.
Eigen::Matrix3d warpBetween(const std::array<Eigen::Vector2d, 4>& from,
                            const std::array<Eigen::Vector2d, 4>& to) {
  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d &p = from[static_cast<std::size_t>(i)],
                          &q = to[static_cast<std::size_t>(i)];
    A.row(2 * i) << p.x(), p.y(), 1, 0, 0, 0, -q.x() * p.x(), -q.x() * p.y();
    A.row(2 * i + 1) << 0, 0, 0, p.x(), p.y(), 1, -q.y() * p.x(), -q.y() * p.y();
    b.segment<2>(2 * i) = q;
  }
  const Eigen::Matrix<double, 8, 1> h = A.fullPivLu().solve(b);
  Eigen::Matrix3d H;
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return H.allFinite() ? H : Eigen::Matrix3d::Identity();
}

}  // namespace

World::World(const SimulatedRigOptions& options)
    : options_(options),
      robot_(makeRobot(options.robot, options.robot.initial)),
      unicycle_(dynamic_cast<UnicycleCamera*>(robot_.get())),
      camera_(makeCamera(options)),
      mount_(mountOf(options.robot)),
      wMo_(options.target.pose.isometry()),
      random_(options.seed),
      gyroNoise_(options.seed, ErrorSource::gyroNoise),
      slip_(1, options.odometry.slip, {options.seed, ErrorSource::slip}),
      wander_(2 * static_cast<Eigen::Index>(options.target.points.size()), options.sensing.wander,
              {options.seed, ErrorSource::wander}),
      command_(Velocities::Zero(robot_->velocity().size())) {
  constexpr double kMost = 1e6;
  odometry_.reserve(
      static_cast<std::size_t>(std::min(kMost, options.duration * options.odometry.rate + 2)));
}

void World::advanceTo(double time_s, const std::function<void()>& beforeRow) {
  const OdometryOptions& odometry = options_.odometry;
  const bool holds = odometry.rows == RowMeaning::hold;
  const auto rowTime = [&](std::uint64_t row) {
    return fileTime(static_cast<double>(row) / odometry.rate);
  };
  if (!holds && odometry_.empty()) addRow({});
  while (time_s_ < time_s) {
    const bool beginsRow = rowTime(rows_) <= time_s_;
    if (beginsRow) {
      ++rows_;
      if (beforeRow) beforeRow();
      if (unicycle_ && odometry.mode == OdometryMode::commanded) {
        disturbance_ = odometry.noise.cwiseProduct(gaussian2());
        unicycle_->setDisturbance(disturbance_);
      }
    }
    takeCommands();
    const double until = std::min(time_s, rowTime(rows_)), duration_s = until - time_s_;
    const double period_s = rowTime(rows_) - time_s_;  // where a row begins
    // A base whose rows hold takes a command when a row begins, and then does what the row says.
    if (beginsRow || !holds) robot_->accelerate(followed(), holds ? period_s : duration_s);
    const Twist twist = told();
    const Eigen::Isometry3d wMcBefore = robot_->wMc();
    robot_->move(duration_s);
    if (beginsRow && holds) {
      addRow(unicycle_ ? counted(twist, wheels_ + rolled(period_s), period_s)
                       : Motion::fromPoses(wMcBefore, robot_->wMc(), duration_s).twist());
    }
    way_.linear += duration_s * twist.linear;
    way_.angular += duration_s * twist.angular;
    wheels_ += rolled(duration_s);
    moveTarget(until);
    time_s_ = until;
    if (!holds && time_s_ == rowTime(rows_))
      addRow(odometry.rows == RowMeaning::instant ? twist : meanTwist());
  }
}

void World::setCommand(const Velocities& command) {
  const double dead_time = options_.robot.dead_time;
  if (dead_time == 0) {
    command_ = command;
  } else {
    underway_.push_back({fileTime(time_s_ + dead_time), command});
  }
}

void World::takeCommands() {
  while (!underway_.empty() && underway_.front().from_s <= time_s_) {
    command_ = underway_.front().velocities;
    underway_.erase(underway_.begin());
  }
}

/// What the drives follow of the command.
Velocities World::followed() const {
  return isWithin(options_.robot.stuck) ? Velocities(Velocities::Zero(command_.size())) : command_;
}

bool World::isWithin(const std::vector<Interlude>& spans) const {
  return std::any_of(spans.begin(), spans.end(),
                     [&](const Interlude& span) { return span.covers(time_s_); });
}

/// Over the time since the last row, by the wheels' encoders where they have ticks.
Twist World::meanTwist() {
  const double period_s = time_s_ - lastRow_s_;
  return counted({way_.linear / period_s, way_.angular / period_s}, wheels_, period_s);
}

/// Way of the wheels with the velocity that the robot has [m].
Eigen::Vector2d World::rolled(double duration_s) const {
  if (!unicycle_) return Eigen::Vector2d::Zero();
  return wheelSpeeds(robot_->velocity(), options_.odometry.wheel_base) * duration_s;
}

/// What perfect odometry says of the robot's velocity.
Twist World::told() const {
  Velocities velocity = robot_->velocity();
  if (unicycle_) velocity -= disturbance_;
  return robot_->cameraTwist(velocity);
}

/// What encoders with their ticks say of it, since the last row. \param wheels at the end [m]
Twist World::counted(const Twist& twist, const Eigen::Vector2d& wheels, double duration_s) {
  const OdometryOptions& odometry = options_.odometry;
  if (!unicycle_ || odometry.ticks == 0) return twist;
  const Eigen::Vector2d ways =
      countedWay(wheels, odometry.ticks) - countedWay(wheelsAtRow_, odometry.ticks);
  wheelsAtRow_ = wheels;
  return robot_->cameraTwist(robotVelocity(ways / duration_s, odometry.wheel_base));
}

/// The row of this time, as it is measured.
void World::addRow(Twist twist) {
  const OdometryOptions& odometry = options_.odometry;
  twist.linear *= odometry.scale / (1 + odometry.scale * slip_.at(time_s_)[0]);
  twist.angular += odometry.gyro_bias;
  if (odometry.gyro_noise > 0) twist.angular += odometry.gyro_noise * gyroNoise_.next3();
  if (odometry.mode == OdometryMode::measured && !odometry.noise.isZero()) {
    for (double& v : twist.linear) v += odometry.noise[0] * gaussian_(random_);
    for (double& w : twist.angular) w += odometry.noise[1] * gaussian_(random_);
  }
  if (!isWithin(odometry.gaps)) odometry_.push_back({time_s_, twist});
  lastRow_s_ = time_s_;
  way_ = {};
}

void World::moveTarget(double until_s) {
  if (options_.target.twist.empty()) return;
  for (double begin_s = time_s_; begin_s < until_s;) {
    const double end_s = std::min(until_s, begin_s + kTargetStep_s);
    const Motion motion = Motion::fromTwist(targetTwist(0.5 * (begin_s + end_s)), end_s - begin_s);
    const Motion back = motion.inverse();
    wMo_.translation() += wMo_.linear() * back.t;
    wMo_.linear() = Eigen::Quaterniond(wMo_.linear() * back.R).normalized().toRotationMatrix();
    begin_s = end_s;
  }
}

Twist World::targetTwist(double time_s) const {
  const Velocities twist = velocityAt(options_.target.twist, time_s, 6);
  return {twist.head<3>(), twist.tail<3>()};
}

Twist World::twistRelativeToTarget() const {
  Twist camera = robot_->cameraTwist(robot_->velocity());
  if (mount_) {
    const Eigen::Quaterniond back = mount_->conjugate();
    camera = {back * camera.linear, back * camera.angular};
  }
  const Twist target = targetTwist(time_s_);
  const Eigen::Isometry3d pose = cMo();
  const Eigen::Vector3d w = pose.linear() * target.angular;
  return {camera.linear - pose.linear() * target.linear - pose.translation().cross(w),
          camera.angular - w};
}

Eigen::Isometry3d World::cdMo() const { return cMoFrom(*options_.robot.goal); }

void World::lookFrom(const RobotPose& pose, DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  SyntheticView view;
  view.cMo = cMoFrom(pose);
  view.frame = ~looks_++;
  camera_.render(view, image);
}

std::vector<std::optional<Eigen::Vector3d>> World::seenFrom(
    const RobotPose& pose, const std::vector<Eigen::Vector2d>& pixels) const {
  SyntheticView view;
  view.cMo = cMoFrom(pose);
  const PinholeCamera camera = options_.camera.truePinhole();
  std::vector<std::optional<Eigen::Vector3d>> seen;
  for (const Eigen::Vector2d& p : pixels) {
    seen.emplace_back();
    const auto Z = camera_.depthAt(view, p.x(), p.y());
    if (!Z) continue;
    const Eigen::Vector2d s = camera.normalise(p.x(), p.y());
    seen.back() = view.cMo.inverse() * (*Z * s.homogeneous());
  }
  return seen;
}

std::vector<TruePoint> World::goal() const { return seenAt(cdMo()); }

void World::seeAt(const Eigen::Isometry3d& cMo, std::vector<TruePoint>& points) const {
  const bool seesEllipses =
      options_.sensing.source == SensingSource::image && options_.target.type == TargetKind::dots;
  const PinholeCamera camera = options_.camera.truePinhole();
  points.clear();
  points.reserve(options_.target.points.size());
  for (std::size_t i = 0; i < options_.target.points.size(); ++i) {
    const Eigen::Vector3d p = cMo * options_.target.points[i];
    Eigen::Vector2d seen = Eigen::Vector2d::Constant(kUnknown);
    if (p.z() > 0) seen = camera.toPixel(p.x() / p.z(), p.y() / p.z());
    if (seesEllipses) {
      const auto ellipse = camera_.ellipse(cMo, i);
      if (ellipse) seen = ellipse->centre;
    }
    points.push_back({static_cast<int>(i), p.z(), seen.x(), seen.y()});
  }
}

bool World::isHidden(std::size_t point) const {
  return std::any_of(
      options_.sensing.hidden.begin(), options_.sensing.hidden.end(),
      [&](const PointPeriod& hidden) { return hidden.covers(time_s_, static_cast<int>(point)); });
}

/// By how much a point is seen elsewhere as its row of the image is exposed later than the first
/// [px].
Eigen::Vector2d World::shiftByReadout(std::size_t point) const {
  const PinholeCamera camera = options_.camera.truePinhole();
  const Eigen::Vector3d first = cMo() * options_.target.points[point];
  if (!(first.z() > 0)) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d seen = camera.toPixel(first.x() / first.z(), first.y() / first.z());
  const double row = std::clamp(seen.y() / options_.camera.height, 0., 1.);
  const Motion later = Motion::fromTwist(twistRelativeToTarget(), row * options_.sensing.readout);
  const Eigen::Vector3d then = later.R * first + later.t;
  if (!(then.z() > 0)) return Eigen::Vector2d::Zero();
  return camera.toPixel(then.x() / then.z(), then.y() / then.z()) - seen;
}

const std::vector<Eigen::Vector2d>& World::pixelErrors() {
  const SensingOptions& sensing = options_.sensing;
  const Eigen::VectorXd& wander = wander_.at(time_s_);
  pixelErrors_.clear();
  pixelErrors_.reserve(options_.target.points.size());
  for (std::size_t i = 0; i < options_.target.points.size(); ++i) {
    Eigen::Vector2d error = wander.segment<2>(2 * static_cast<Eigen::Index>(i));
    if (sensing.readout > 0) error += shiftByReadout(i);
    if (sensing.pixel_noise > 0) error += sensing.pixel_noise * gaussian2();
    if (sensing.outliers > 0) {
      std::uniform_real_distribution<double> fraction;
      const bool isOutlier = fraction(random_) < sensing.outliers;
      const double angle = 2 * M_PI * fraction(random_);
      const double size =
          kSmallestOutlier_px + (kLargestOutlier_px - kSmallestOutlier_px) * fraction(random_);
      if (isOutlier) error += size * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    pixelErrors_.push_back(error);
  }
  return pixelErrors_;
}

void World::expose(DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  SyntheticView view;
  view.cMo = cMo();
  view.twist = twistRelativeToTarget();
  view.displacement = pixelErrors();
  view.frame = images_++;
  if (options_.target.type == TargetKind::apriltag) {
    printTags(view);
  } else if (options_.target.hasBoard()) {
    printBoard(view);
  } else if (options_.target.type == TargetKind::wall) {
    const CameraOptions& c = options_.camera;  // who stands before a wall leaves its borders free
    if (isHidden(0))
      view.occluders.push_back({c.width / 8, c.height / 8, 3 * c.width / 4, c.height});
  } else {
    for (std::size_t i = 0; i < options_.target.points.size(); ++i) {
      if (!isHidden(i)) continue;
      if (const auto occluder = camera_.occluderOf(view.cMo, i))
        view.occluders.push_back(*occluder);
    }
  }
  camera_.render(view, image);
}

void World::printTags(SyntheticView& view) const {
  for (std::size_t tag = 0; tag < options_.target.tags.size(); ++tag) {
    print(view, 4 * tag, 4, {4 * tag, 4 * tag + 1, 4 * tag + 2, 4 * tag + 3}, 1);
  }
}

void World::printBoard(SyntheticView& view) const {
  const BoardTarget board = options_.target.boardTarget();
  const auto columns = static_cast<std::size_t>(board.columns);
  const auto count = static_cast<std::size_t>(board.count());
  print(view, 0, count, {0, columns - 1, count - 1, count - columns}, board.patches().size());
}

/// Displaces a sheet with these points by what its outer ones are, and hides it as a whole.
void World::print(SyntheticView& view, std::size_t first, std::size_t count,
                  const std::array<std::size_t, 4>& outer, std::size_t patches) const {
  constexpr double kMargin_px = 6;
  const std::vector<TruePoint> corners = seenAt(view.cMo);
  std::array<Eigen::Vector2d, 4> from, to;
  for (std::size_t j = 0; j < 4; ++j) {
    from[j] = {corners[outer[j]].u, corners[outer[j]].v};
    to[j] = from[j] + view.displacement[outer[j]];
  }
  view.patchWarps.insert(view.patchWarps.end(), patches, warpBetween(from, to));
  Eigen::Vector2d low(HUGE_VAL, HUGE_VAL), high = -low;
  bool hides = false;
  for (std::size_t i = first; i < first + count; ++i) {
    low = low.cwiseMin(Eigen::Vector2d(corners[i].u, corners[i].v));
    high = high.cwiseMax(Eigen::Vector2d(corners[i].u, corners[i].v));
    hides = hides || isHidden(i);
  }
  if (!hides || !low.allFinite() || !high.allFinite()) return;
  const auto clamped = [](double x) { return static_cast<int>(std::clamp(x, -1e6, 1e6)); };
  const Eigen::Vector2d size = high - low + Eigen::Vector2d::Constant(2 * kMargin_px);
  view.occluders.push_back({clamped(low.x() - kMargin_px), clamped(low.y() - kMargin_px),
                            clamped(size.x()), clamped(size.y())});
}

void World::measure(const std::vector<TruePoint>& points, std::vector<TrackedPoint>& measured) {
  const std::vector<Eigen::Vector2d>& errors = pixelErrors();
  measured.clear();
  measured.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double u = points[i].u + errors[i].x(), v = points[i].v + errors[i].y();
    if (isHidden(i) || !options_.camera.pinhole().contains(u, v)) continue;
    measured.push_back({takenFor(static_cast<int>(i)), u, v, options_.sensing.assumedNoise_px()});
  }
}

/// The point that a tracker takes this one for.
int World::takenFor(int point) const {
  for (const PointPeriod& swapped : options_.sensing.swapped) {
    if (!swapped.covers(time_s_, point)) continue;
    const auto& points = swapped.points;
    const auto next = std::find(points.begin(), points.end(), point) + 1;
    return next == points.end() ? points.front() : *next;
  }
  return point;
}

}  // namespace depthservo
