#include <Eigen/QR>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <thread>

#include "depth/EulerObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/features/FeatureMoments.h"
#include "depthservo/rig/SimulatedRig.h"
#include "depthservo/tracking/DotTracker.h"
#include "features/pointInteraction.h"
#include "observation/expectedPoints.h"
#include "observation/makeEstimator.h"
#include "papers/DeLuca2008Servo.h"
#include "robots/cameraJacobian.h"

namespace depthservo::deluca2008 {
namespace {

constexpr int kDots = 4;
constexpr double kRate_Hz = 30, kDuration_s = 40;
constexpr double kGain = 0.57, kObserverGain = 48;
constexpr double kFocal_px = 1096;
const Eigen::Vector2d kOffset(0.07, 0.02);       // of the camera on the robot [m]
constexpr double kCameraHeight = 0.13;           // above the floor [m]
constexpr double kNoise_px = 0.4;                // per axis
constexpr double kTick = 1e-4;                   // of the wheel encoders [m]
constexpr double kWheelBase = 0.36;              // [m]
constexpr double kSpeed = 0.7, kTurnRate = 0.8;  // limits [m/s, rad/s]
constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr double kMomentScale = 0.2;  // of the third moment feature: about 1 at the goal
constexpr double kDotRadius = 0.008;  // [m]; small: a dot is lost as soon as the border cuts it
constexpr double kZ_max = 20;         // [m]

std::unique_ptr<PointSetEstimator> estimatorOf(const Method& method) {
  EstimatorSetup setup;
  setup.depth.estimator =
      method.depth == DepthSource::observer || method.depth == DepthSource::object
          ? EstimatorKind::nonlinear
          : EstimatorKind::constant;
  setup.depth.object = method.depth == DepthSource::object;
  setup.depth.initial = method.guess;
  setup.depth.gains.k = kObserverGain;
  setup.depth.gains.k_3 = method.k_3;
  setup.depth.Z_min = method.Z_min;
  setup.depth.Z_max = kZ_max;
  if (method.depth != DepthSource::euler) return makeEstimator(setup, kDots);
  const DepthRange range = setup.depth.range();
  return std::make_unique<PointwiseEstimator>(EulerObserver(setup.depth.gains.observer(), range),
                                              kDots, DepthPrior{method.guess}, range);
}

/// Features by the rows of their errors and interaction matrices.
struct Task {
  Eigen::VectorXd error;
  Eigen::Matrix<double, Eigen::Dynamic, 6> L;
};

Eigen::Vector2d pixelOf(const TruePoint& point) { return {point.u, point.v}; }

/// The loop of the paper, without what the product adds to it: no prediction over a delay, no
/// slowing down in doubt, no outcome but the border of the image; and fast enough for 5000 runs.
class ServoRun {
 public:
  ServoRun(const Arrangement& arrangement, const Start& start, const Method& method,
           const Circumstances& circumstances)
      : camera_(arrangement.camera),
        Z_goal_(arrangement.Z_goal),
        method_(method),
        rig_(rigOptions(arrangement, start, circumstances)),
        J_(cameraJacobian(*rig_.robot())),
        estimator_(estimatorOf(method)),
        moments_(kMomentScale),
        desiredMoments_(kMomentScale),
        goal_(rig_.truthAtGoal()),
        commands_(static_cast<std::size_t>(circumstances.delay), Eigen::Vector2d::Zero()),
        seen_(kDots) {
    std::vector<PointState> points;
    for (const TruePoint& point : goal_) {
      const Eigen::Vector2d s = camera_.normalise(point.u, point.v);
      points.push_back({s.x(), s.y(), 1 / point.Z});
    }
    desiredMoments_.buildFrom(points);
    if (!circumstances.throughImages) return;
    std::vector<Eigen::Vector2d> starts;
    for (const TruePoint& point : rig_.truth()) starts.push_back(pixelOf(point));
    tracker_.emplace(starts);
  }

  Course run(Keep keep) {
    Course course;
    while (const auto exposure = rig_.next(nullptr)) {
      course.end_s = exposure->time_s;
      truth_ = exposure->truth;
      if (!isInImage()) return ended(course);
      observe(*exposure);
      if (keep == Keep::everything) course.path.push_back(instant(exposure->time_s));
      commands_.push_back(command(task()));
      rig_.command(commands_.front());
      commands_.pop_front();
    }
    course.stayedInImage = true;
    return ended(course);
  }

 private:
  bool isInImage() const {
    return std::all_of(truth_.begin(), truth_.end(), [&](const TruePoint& point) {
      return point.Z > 0 && camera_.contains(point.u, point.v);
    });
  }

  /// Measures the dots, and gives the servo their positions and depths.
  void observe(const Exposure& exposure) {
    rig_.readOdometry(odometry_, exposure.time_s);
    std::vector<TrackedPoint> points = exposure.points;
    if (tracker_) {
      points = tracker_->track(exposure.image, expectedPoints(*estimator_, {0, 1, 2, 3}, odometry_,
                                                              exposure.time_s, camera_));
    }
    observations_.clear();
    for (const TrackedPoint& point : points) {
      const Eigen::Vector2d s = camera_.normalise(point.u, point.v);
      observations_.push_back({point.id, {s.x(), s.y(), kNoise_px / kFocal_px}});
    }
    estimator_->advance(odometry_, exposure.time_s);
    estimator_->correct(observations_);
    for (std::size_t i = 0; i < kDots; ++i) seen_[i] = estimator_->estimate(static_cast<int>(i));
    for (const auto& [id, measurement] : observations_) {
      DepthEstimate& point = seen_[static_cast<std::size_t>(id)];
      point.x = measurement.x;
      point.y = measurement.y;
    }
    if (method_.depth == DepthSource::truth) {
      for (std::size_t i = 0; i < kDots; ++i) seen_[i].chi = 1 / truth_[i].Z;
    }
  }

  Task task() {
    Task task;
    if (method_.features == FeatureChoice::points) {
      task.error.resize(2 * kDots);
      task.L.resize(2 * kDots, 6);
      for (int i = 0; i < kDots; ++i) {
        const DepthEstimate& p = seen_[static_cast<std::size_t>(i)];
        task.error.segment<2>(2 * i) = Eigen::Vector2d(p.x, p.y) - goal(i);
        task.L.middleRows<2>(2 * i) = pointInteraction({p.x, p.y, p.chi});
      }
      return task;
    }
    moments_.update(seen_);
    task.error.resize(3);
    task.L.resize(3, 6);
    const auto error = moments_.error(desiredMoments_);
    const auto L = moments_.interaction();
    for (unsigned row = 0; row < 3; ++row) {
      const bool isSize = row == 2;
      const double weight = method_.features == FeatureChoice::moments ? 1
                            : isSize ? 1 / (kMomentScale * kFocal_px)
                                     : kFocal_px;
      task.error[row] = weight * error[row];
      for (unsigned j = 0; j < 6; ++j) task.L(row, j) = weight * L[row][j];
    }
    return task;
  }

  /// Normalised.
  Eigen::Vector2d goal(int i) const {
    const TruePoint& point = goal_[static_cast<std::size_t>(i)];
    return camera_.normalise(point.u, point.v);
  }

  Eigen::Vector2d command(const Task& task) const {
    const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, 2 * kDots, 2> J = task.L * J_;
    const Eigen::Vector2d wanted = -kGain * J.completeOrthogonalDecomposition().solve(task.error);
    return wanted.allFinite() ? wanted : Eigen::Vector2d::Zero();
  }

  Instant instant(double time_s) const {
    Instant instant{time_s, {}, {}, {}};
    for (std::size_t i = 0; i < kDots; ++i) {
      instant.pixels.push_back(pixelOf(truth_[i]));
      instant.Z.push_back(truth_[i].Z);
      instant.Z_used.push_back(seen_[i].Z());
    }
    return instant;
  }

  Course ended(Course course) const {
    double squares = 0, Z = 0;
    Eigen::Vector2d barycentre = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < kDots; ++i) {
      const Eigen::Vector2d error = pixelOf(truth_[i]) - pixelOf(goal_[i]);
      squares += error.squaredNorm();
      barycentre += error / kDots;
      Z += truth_[i].Z / kDots;
      course.goal.push_back(pixelOf(goal_[i]));
    }
    course.rms_px = std::sqrt(squares / kDots);
    course.barycentre_px = barycentre.norm();
    course.ZRatio = Z / Z_goal_;
    return course;
  }

  PinholeCamera camera_;
  double Z_goal_;
  Method method_;
  SimulatedRig rig_;
  Eigen::Matrix<double, 6, 2> J_;  // twist of the camera by v and w
  std::unique_ptr<PointSetEstimator> estimator_;
  FeatureMoments moments_, desiredMoments_;
  std::vector<TruePoint> goal_, truth_;
  std::optional<DotTracker> tracker_;
  std::deque<Eigen::Vector2d> commands_;  // on their way to the drives
  MotionBuffer odometry_{8, 1 / kRate_Hz};
  std::vector<PointObservation> observations_;
  std::vector<DepthEstimate> seen_;
};

Arrangement arrangement(ImageSize size) {
  if (size == ImageSize::vga) {
    return {{640, 480, kFocal_px, kFocal_px, 320, 240}, .0866, .1544, .0436, -.2016, .97, -.3452};
  }
  return {{1024, 768, kFocal_px, kFocal_px, 512, 384}, .0929, .1544, -.0839, -.3724, .97, .1268};
}

std::vector<Start> grid(double X, int lateral, double Z, double heading_deg, int headings) {
  std::vector<Start> starts;
  for (int i = 0; i < lateral; ++i) {
    for (int j = 0; j < headings; ++j) {
      starts.push_back({X * (2. * i / (lateral - 1) - 1), Z,
                        heading_deg * M_PI / 180 * (2. * j / (headings - 1) - 1)});
    }
  }
  return starts;
}

/// Lateral distance [m] at which the plate touches the border of the image at depth Z.
double halfField(const Arrangement& arrangement, double Z) {
  return 0.5 * arrangement.camera.width / kFocal_px * Z;
}

}  // namespace

SimulatedRigOptions rigOptions(const Arrangement& a, const Start& start,
                               const Circumstances& circumstances) {
  const auto at = [](double X, double Z, double heading) {
    const Eigen::Vector2d robot =
        -(Eigen::Rotation2Dd(heading) * (Eigen::Vector2d(Z, -X) + kOffset));
    RobotPose pose;
    pose.x = robot.x();
    pose.y = robot.y();
    pose.theta = heading;
    return pose;
  };
  SimulatedRigOptions rig;
  rig.seed = circumstances.seed;
  rig.duration = kDuration_s;
  rig.camera.width = a.camera.width;
  rig.camera.height = a.camera.height;
  rig.camera.fx = rig.camera.fy = kFocal_px;
  rig.camera.cx = a.camera.cx;
  rig.camera.cy = a.camera.cy;
  rig.camera.rate = {kRate_Hz};
  const double x = a.width / 2, y = a.height / 2;
  rig.target.points = {{-x, y, 0}, {x, y, 0}, {x, -y, 0}, {-x, -y, 0}};
  rig.target.radius = kDotRadius;
  rig.target.pose.xyz = {0, 0, kCameraHeight - a.below};
  rig.robot.camera_offset << kOffset, kCameraHeight;
  rig.robot.initial = at(start.X, start.Z, start.heading);
  rig.robot.goal = at(a.X_goal, a.Z_goal, a.heading);
  const double most = circumstances.isSpeedLimited ? 1 : kUnlimited;
  rig.robot.limits.v = most * kSpeed;
  rig.robot.limits.w = most * kTurnRate;
  rig.robot.limits.dv = rig.robot.limits.dw = kUnlimited;
  rig.robot.lag = circumstances.lag_s;
  rig.sensing.source = circumstances.throughImages ? SensingSource::image : SensingSource::geometry;
  rig.sensing.pixel_noise = kNoise_px;
  rig.odometry.rate = kRate_Hz;
  rig.odometry.ticks = kTick;
  rig.odometry.wheel_base = kWheelBase;
  return rig;
}

Arrangement pointArrangement(ImageSize size) { return arrangement(size); }

Arrangement momentArrangement(ImageSize size) {
  Arrangement a = arrangement(size);
  a.Z_goal = 0.9;
  a.X_goal = (422 - a.camera.cx) / kFocal_px * a.Z_goal;
  a.below = (283.2 - a.camera.cy) / kFocal_px * a.Z_goal;
  a.heading = 0;
  return a;
}

std::vector<Start> startsOfTables(const Arrangement& arrangement, double Z) {
  return grid(halfField(arrangement, Z) - 0.15, 7, Z, 30, 5);
}

std::vector<Start> startsOfSearch(const Arrangement& arrangement) {
  return grid(halfField(arrangement, 3.9) - 0.1, 9, 3.9, 45, 7);
}

Course servo(const Arrangement& arrangement, const Start& start, const Method& method,
             const Circumstances& circumstances, Keep keep) {
  return ServoRun(arrangement, start, method, circumstances).run(keep);
}

std::vector<Course> servoFromAll(const Arrangement& arrangement, const std::vector<Start>& starts,
                                 const Method& method, const Circumstances& circumstances) {
  std::vector<Course> courses(starts.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < starts.size(); i = next++) {
      Circumstances mine = circumstances;
      mine.seed += static_cast<unsigned>(i);
      courses[i] = servo(arrangement, starts[i], method, mine);
    }
  };
  std::vector<std::thread> helpers(std::max(1u, std::thread::hardware_concurrency()) - 1);
  for (std::thread& helper : helpers) helper = std::thread(work);
  work();
  for (std::thread& helper : helpers) helper.join();
  return courses;
}

}  // namespace depthservo::deluca2008
