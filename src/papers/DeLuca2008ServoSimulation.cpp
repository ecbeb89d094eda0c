#include <Eigen/QR>
#include <atomic>
#include <cmath>
#include <memory>
#include <random>
#include <thread>

#include "depthservo/depth/ConstantDepth.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/features/FeatureMoments.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/visp/using.h"
#include "features/pointInteraction.h"
#include "observation/expectedPoints.h"
#include "papers/DeLuca2008Servo.h"
#include "robots/wheels.h"

namespace depthservo::deluca2008 {
namespace {

constexpr int kDots = 4;
constexpr double kPeriod_s = 1. / 30, kDuration_s = 40;
constexpr double kGain = 0.57, kObserverGain = 48;
constexpr double kFocal_px = 1096;
constexpr double kCameraHeight = 0.13;           // above the floor [m]
constexpr double kNoise_px = 0.4;                // per axis
constexpr double kTick = 1e-4;                   // of the wheel encoders [m]
constexpr double kWheelBase = 0.36;              // [m]
constexpr double kSpeed = 0.7, kTurnRate = 0.8;  // limits [m/s, rad/s]
constexpr double kMomentScale = 0.2;             // of the third moment feature: about 1 at the goal
constexpr double kDotRadius = 0.008;  // [m]; small: a dot is lost as soon as the border cuts it
constexpr double kZ_max = 20;         // [m]

/// The paper's observer by Euler's method: the state of image k + 1 from the measurement of image k
/// and the twist between both.
class EulerObserver : public DepthEstimator {
 public:
  EulerObserver(double k_3, const DepthRange& range) : k_3_(k_3), range_(range) {}

  std::unique_ptr<DepthEstimator> clone() const override {
    return std::make_unique<EulerObserver>(*this);
  }
  void reset(const PointMeasurement& measurement, const DepthPrior& prior) override {
    measured_ << measurement.x, measurement.y;
    estimated_ = measured_;
    chi_ = range_.clampChi(1 / prior.Z);
  }
  void predict(const Motion& motion) override {
    const Twist u = motion.twist();
    const Eigen::Vector3d &v = u.linear, &w = u.angular;
    const double x = measured_.x(), y = measured_.y(), dt = motion.dt;
    const Eigen::Vector2d Omega(-v.x() + x * v.z(), -v.y() + y * v.z());
    const Eigen::Vector2d drift(x * y * w.x() - (1 + x * x) * w.y() + y * w.z(),
                                (1 + y * y) * w.x() - x * y * w.y() - x * w.z());
    const Eigen::Vector2d e = measured_ - estimated_;
    estimated_ += dt * (drift + Omega * chi_ + kObserverGain * e);
    const double rate = chi_ * chi_ * v.z() + chi_ * (y * w.x() - x * w.y()) + k_3_ * Omega.dot(e);
    chi_ = range_.clampChi(chi_ + dt * rate);
  }
  void correct(const PointMeasurement& measurement) override {
    measured_ << measurement.x, measurement.y;
  }
  void correctDepth(const DepthPrior&) override {}
  DepthEstimate estimate() const override {
    DepthEstimate e;
    e.x = measured_.x();
    e.y = measured_.y();
    e.chi = chi_;
    e.status = DepthStatus::converging;
    return e;
  }

 private:
  double k_3_;
  DepthRange range_;
  Eigen::Vector2d measured_ = Eigen::Vector2d::Zero(), estimated_ = Eigen::Vector2d::Zero();
  double chi_ = 1;
};

std::unique_ptr<PointSetEstimator> makeEstimator(const Method& method) {
  const DepthRange range{method.Z_min, kZ_max};
  const DepthPrior prior{method.guess};
  NonlinearObserverOptions options;
  options.gains = {kObserverGain, method.k_3};
  switch (method.depth) {
    case DepthSource::observer:
      return std::make_unique<PointwiseEstimator>(NonlinearDepthObserver(options, range), kDots,
                                                  prior, range);
    case DepthSource::object:
      return std::make_unique<ObjectDepthObserver>(kDots, options, prior, range);
    case DepthSource::euler:
      return std::make_unique<PointwiseEstimator>(EulerObserver(method.k_3, range), kDots, prior,
                                                  range);
    case DepthSource::truth:
    case DepthSource::constant:
      break;
  }
  return std::make_unique<PointwiseEstimator>(ConstantDepth(), kDots, prior);
}

/// The dots as the camera sees them.
struct View {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> Z;
};

/// Features by the rows of their errors and interaction matrices.
struct Task {
  Eigen::VectorXd error;
  Eigen::Matrix<double, Eigen::Dynamic, 6> L;
};

class ServoRun {
 public:
  ServoRun(const Arrangement& arrangement, const Start& start, const Method& method,
           const Circumstances& circumstances)
      : arrangement_(arrangement),
        method_(method),
        circumstances_(circumstances),
        camera_(arrangement.camera, arrangement.target()),
        wMo_(arrangement.wMo()),
        robot_(arrangement.robot()),
        estimator_(makeEstimator(method)),
        random_(circumstances.seed),
        moments_(kMomentScale),
        desiredMoments_(kMomentScale) {
    robot_.setPose(arrangement.pose(arrangement.X_goal, arrangement.Z_goal, arrangement.heading));
    goal_ = look();
    std::vector<PointState> points;
    for (std::size_t i = 0; i < kDots; ++i) {
      const Eigen::Vector2d s = normalised(goal_.pixels[i]);
      points.push_back({s.x(), s.y(), 1 / goal_.Z[i]});
    }
    desiredMoments_.buildFrom(points);
    robot_.setPose(arrangement.pose(start.X, start.Z, start.heading));
    UnicycleLimits limits;
    if (circumstances.isSpeedLimited) {
      limits.v = kSpeed;
      limits.w = kTurnRate;
    }
    robot_.setLimits(limits);
    robot_.setLag(circumstances.lag_s);
    if (circumstances.throughImages) {
      tracker_ = std::make_unique<DotTracker>(look().pixels);
      image_.resize(static_cast<unsigned>(arrangement.camera.height),
                    static_cast<unsigned>(arrangement.camera.width));
    }
    commands_.assign(static_cast<std::size_t>(circumstances.delay), Eigen::Vector2d::Zero());
    seen_.resize(kDots);
  }

  Course run(Keep keep) {
    Course course;
    View now = look();
    const int frames = static_cast<int>(std::lround(kDuration_s / kPeriod_s));
    for (int frame = 0; frame <= frames; ++frame) {
      now = look();
      course.end_s = frame * kPeriod_s;
      if (!isInImage(now)) return ended(course, now);
      observe(now, frame);
      if (keep == Keep::everything) course.path.push_back(instant(now, course.end_s));
      move(command(task()), course.end_s);
    }
    course.stayedInImage = true;
    return ended(course, now);
  }

 private:
  Eigen::Vector2d normalised(const Eigen::Vector2d& pixel) const {
    return arrangement_.camera.normalise(pixel.x(), pixel.y());
  }

  View look() const {
    const Eigen::Isometry3d cMo = robot_.wMc().inverse() * wMo_;
    View view;
    for (std::size_t i = 0; i < kDots; ++i) {
      const Eigen::Vector3d p = cMo * camera_.target().points[i];
      view.pixels.push_back(arrangement_.camera.toPixel(p.x() / p.z(), p.y() / p.z()));
      view.Z.push_back(p.z());
    }
    return view;
  }

  bool isInImage(const View& view) const {
    for (std::size_t i = 0; i < kDots; ++i) {
      const Eigen::Vector2d& p = view.pixels[i];
      if (!(view.Z[i] > 0) || !arrangement_.camera.contains(p.x(), p.y())) return false;
    }
    return true;
  }

  /// Measures the dots, and gives the servo their positions and depths.
  void observe(const View& truth, int frame) {
    const double time_s = frame * kPeriod_s;
    const double sigma = kNoise_px / kFocal_px;
    std::vector<Eigen::Vector2d> noise;
    for (std::size_t i = 0; i < kDots; ++i) {
      noise.emplace_back(kNoise_px * gaussian_(random_), kNoise_px * gaussian_(random_));
    }
    observations_.clear();
    if (tracker_) {
      SyntheticView view;
      view.cMo = robot_.wMc().inverse() * wMo_;
      view.displacement = noise;
      view.frame = static_cast<std::uint64_t>(frame);
      camera_.render(view, image_);
      std::vector<ExpectedPoint> expected;
      if (frame > 0) {
        expected =
            expectedPoints(*estimator_, {0, 1, 2, 3}, odometry_, time_s, arrangement_.camera);
      }
      for (const TrackedPoint& point : tracker_->track(image_, expected)) {
        const Eigen::Vector2d s = arrangement_.camera.normalise(point.u, point.v);
        observations_.push_back({point.id, {s.x(), s.y(), sigma}});
      }
    } else {
      for (std::size_t i = 0; i < kDots; ++i) {
        const Eigen::Vector2d s = normalised(truth.pixels[i] + noise[i]);
        observations_.push_back({static_cast<int>(i), {s.x(), s.y(), sigma}});
      }
    }
    estimator_->advance(odometry_, time_s);
    estimator_->correct(observations_);
    for (std::size_t i = 0; i < kDots; ++i) seen_[i] = estimator_->estimate(static_cast<int>(i));
    for (const auto& [id, measurement] : observations_) {
      DepthEstimate& point = seen_[static_cast<std::size_t>(id)];
      point.x = measurement.x;
      point.y = measurement.y;
    }
    if (method_.depth == DepthSource::truth) {
      for (std::size_t i = 0; i < kDots; ++i) seen_[i].chi = 1 / truth.Z[i];
    }
  }

  Task task() {
    Task task;
    if (method_.features == FeatureChoice::points) {
      task.error.resize(2 * kDots);
      task.L.resize(2 * kDots, 6);
      for (int i = 0; i < kDots; ++i) {
        const DepthEstimate& p = seen_[static_cast<std::size_t>(i)];
        task.error.segment<2>(2 * i) =
            Eigen::Vector2d(p.x, p.y) - normalised(goal_.pixels[static_cast<std::size_t>(i)]);
        task.L.middleRows<2>(2 * i) = pointInteraction({p.x, p.y, p.chi});
      }
      return task;
    }
    moments_.update(seen_);
    task.error.resize(3);
    task.L.resize(3, 6);
    const vpColVector error = moments_.error(desiredMoments_);
    const vpMatrix L = moments_.interaction();
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

  Eigen::Vector2d command(const Task& task) const {
    Eigen::Matrix<double, 6, 2> J_c;
    for (int j = 0; j < 2; ++j) {
      const Twist twist = robot_.cameraTwist(Eigen::Vector2d::Unit(j));
      J_c.col(j) << twist.linear, twist.angular;
    }
    const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, 2 * kDots, 2> J = task.L * J_c;
    const Eigen::Vector2d wanted = -kGain * J.completeOrthogonalDecomposition().solve(task.error);
    return wanted.allFinite() ? wanted : Eigen::Vector2d::Zero();
  }

  void move(const Eigen::Vector2d& wanted, double time_s) {
    commands_.push_back(wanted);
    const Eigen::Vector2d wheelsBefore = counted();
    const Eigen::Vector2d velocity = robot_.drive(commands_.front(), kPeriod_s);
    commands_.erase(commands_.begin());
    wheels_ += kPeriod_s * wheelSpeeds(velocity, kWheelBase);
    const Eigen::Vector2d rolled = (counted() - wheelsBefore) / kPeriod_s;
    odometry_.push(time_s, robot_.cameraTwist(robotVelocity(rolled, kWheelBase)));
    odometry_.holdUntil(time_s + kPeriod_s);
  }

  Eigen::Vector2d counted() const { return countedWay(wheels_, kTick); }

  Instant instant(const View& now, double time_s) const {
    std::vector<double> Z_used;
    for (const DepthEstimate& point : seen_) Z_used.push_back(point.Z());
    return {time_s, now.pixels, now.Z, Z_used, robot_.pose(), robot_.velocity()};
  }

  Course ended(Course course, const View& now) const {
    double squares = 0;
    Eigen::Vector2d barycentre = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < kDots; ++i) {
      const Eigen::Vector2d error = now.pixels[i] - goal_.pixels[i];
      squares += error.squaredNorm();
      barycentre += error / kDots;
    }
    course.rms_px = std::sqrt(squares / kDots);
    course.barycentre_px = barycentre.norm();
    course.ZRatio = (robot_.wMc().inverse() * wMo_).translation().z() / arrangement_.Z_goal;
    return course;
  }

  Arrangement arrangement_;
  Method method_;
  Circumstances circumstances_;
  SyntheticCamera camera_;
  Eigen::Isometry3d wMo_;
  UnicycleCamera robot_;
  std::unique_ptr<PointSetEstimator> estimator_;
  std::mt19937_64 random_;
  std::normal_distribution<double> gaussian_;
  FeatureMoments moments_, desiredMoments_;
  View goal_;
  std::unique_ptr<DotTracker> tracker_;
  vpImage<unsigned char> image_;
  std::vector<Eigen::Vector2d> commands_;             // on their way to the drives
  Eigen::Vector2d wheels_ = Eigen::Vector2d::Zero();  // way of the left and of the right one [m]
  MotionBuffer odometry_{8, kPeriod_s};
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

DotTarget Arrangement::target() const {
  const double x = width / 2, y = height / 2;
  return {{{-x, y, 0}, {x, y, 0}, {x, -y, 0}, {-x, -y, 0}}, kDotRadius};
}

Eigen::Isometry3d Arrangement::wMo() const {
  Eigen::Isometry3d wMo = Eigen::Isometry3d::Identity();
  wMo.linear() << 0, 0, 1,  //
      -1, 0, 0,             //
      0, -1, 0;
  wMo.translation() << 0, 0, kCameraHeight - below;
  return wMo;
}

UnicycleCamera Arrangement::robot() const { return UnicycleCamera({0.07, 0.02, kCameraHeight}); }

UnicycleCamera::Pose Arrangement::pose(double X, double Z, double heading_rad) const {
  const Eigen::Rotation2Dd R(heading_rad);
  const Eigen::Vector2d robot = -(R * Eigen::Vector2d(Z, -X)) - R * Eigen::Vector2d(0.07, 0.02);
  return {robot.x(), robot.y(), heading_rad};
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
