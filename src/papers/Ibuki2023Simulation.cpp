#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/tracking/TargetPose.h"
#include "observation/expectedPoints.h"
#include "papers/Ibuki2023.h"

namespace depthservo::ibuki2023 {
namespace {

/// |e| beyond which a simulation counts as diverged.
constexpr double kDiverged = 1e6;

/// Times closer than this are the same [s]; energies below this are rounding.
constexpr double kSameTime_s = 1e-6;
constexpr double kRounding = 1e-13;

Eigen::Isometry3d at(double x, double y, double z) {
  Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
  g.translation() << x, y, z;
  return g;
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& g, const Motion& motion) {
  Eigen::Isometry3d next;
  next.linear() = motion.R * g.linear();
  next.translation() = motion.R * g.translation() + motion.t;
  next.makeAffine();
  return next;
}

/// g exp(V h).
Eigen::Isometry3d carried(const Eigen::Isometry3d& g, const Twist& V, double h) {
  return g * moved(Eigen::Isometry3d::Identity(), Motion::fromTwist(V, -h));
}

VisualMotionObserver observerOf(const Experiment& experiment) {
  VisualMotionObserverOptions options;
  options.ke = experiment.ke;
  options.method = experiment.method;
  options.iterateAbove_rad = std::numeric_limits<double>::infinity();
  options.start = VisualMotionObserverOptions::Start::fromGuess;
  options.lostFrames = experiment.lostFrames;
  options.cMo = experiment.cMoGuess;
  if (experiment.law == Law::coupled) options.coupledGoal = experiment.cdMo;
  options.couplingStep_s = std::numeric_limits<double>::infinity();  // one per odometry step
  return VisualMotionObserver(experiment.points, options, DepthRange{1e-3, 1e3});
}

/// Images of the target as dots, and a tracker on them.
class Film {
 public:
  explicit Film(const Experiment& experiment)
      : camera_(experiment.camera, DotTarget{experiment.points, experiment.dotRadius}),
        tracker_(startsOf(experiment)) {
    for (std::size_t i = 0; i < experiment.points.size(); ++i) ids_.push_back(static_cast<int>(i));
  }

  /// The dots found in an image; each is drawn displaced by the noise.
  const std::vector<TrackedPoint>& take(const Eigen::Isometry3d& cMo,
                                        const std::vector<Eigen::Vector2d>& noise_px,
                                        const VisualMotionObserver& observer,
                                        const MotionBuffer& odometry, double time_s) {
    SyntheticView view;
    view.cMo = cMo;
    view.displacement = noise_px;
    camera_.render(view, image_);
    return tracker_.track(image_,
                          expectedPoints(observer, ids_, odometry, time_s, camera_.camera()));
  }

 private:
  std::vector<Eigen::Vector2d> startsOf(const Experiment& experiment) const {
    std::vector<Eigen::Vector2d> starts;
    for (std::size_t i = 0; i < experiment.points.size(); ++i) {
      starts.push_back(*camera_.centre(experiment.cMo, i));
    }
    return starts;
  }

  SyntheticCamera camera_;
  DotTracker tracker_;
  std::vector<int> ids_;
  DEPTHSERVO_VISP vpImage<unsigned char> image_;
};

/// The points as the camera gives them, with noise: from rendered images, or projected.
class Eye {
 public:
  explicit Eye(const Experiment& experiment) : experiment_(experiment), random_(experiment.seed) {
    if (experiment.source == ErrorSource::rendered) film_.emplace(experiment);
  }

  const std::vector<TrackedPoint>& take(const Eigen::Isometry3d& cMo,
                                        const VisualMotionObserver& observer,
                                        const MotionBuffer& odometry, double time_s) {
    std::vector<Eigen::Vector2d> noise_px;
    for (std::size_t i = 0; i < experiment_.points.size(); ++i) {
      const double du = drawn_px();
      noise_px.emplace_back(du, drawn_px());
    }
    if (film_) return pixels_ = film_->take(cMo, noise_px, observer, odometry, time_s);
    pixels_.clear();
    for (std::size_t i = 0; i < experiment_.points.size(); ++i) {
      const Eigen::Vector3d cP = cMo * experiment_.points[i];
      const Eigen::Vector2d pixel =
          experiment_.camera.toPixel(cP.x() / cP.z(), cP.y() / cP.z()) + noise_px[i];
      pixels_.push_back({static_cast<int>(i), pixel.x(), pixel.y(), experiment_.noise_px});
    }
    return pixels_;
  }

 private:
  double drawn_px() {
    return experiment_.noise_px > 0 ? experiment_.noise_px * gaussian_(random_) : 0;
  }

  const Experiment& experiment_;
  std::optional<Film> film_;
  std::vector<TrackedPoint> pixels_;
  std::mt19937_64 random_;
  std::normal_distribution<double> gaussian_;
};

}  // namespace

void PoseErrors::add(const Eigen::Isometry3d& estimated, const Eigen::Isometry3d& truth,
                     const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Isometry3d error = estimated.inverse() * truth;
  position2 += error.translation().squaredNorm();
  const double angle_rad = Eigen::AngleAxisd(error.linear()).angle();
  angle2 += angle_rad * angle_rad;
  ++count;
  for (const Eigen::Vector3d& p : points) {
    const double dZ = (estimated * p - truth * p).z();
    depth2 += dZ * dZ;
    ++depths;
  }
}

double PoseErrors::position() const { return std::sqrt(position2 / count); }
double PoseErrors::angle() const { return std::sqrt(angle2 / count); }
double PoseErrors::depth() const { return std::sqrt(depth2 / depths); }

double Trace::before(double time_s) const {
  double e = std::numeric_limits<double>::quiet_NaN();
  for (const Sample& sample : samples) {
    if (sample.time_s >= time_s - kSameTime_s) break;
    e = sample.e;
  }
  return e;
}

double Trace::largest(double from_s, double to_s) const {
  double e = 0;
  for (const Sample& sample : samples) {
    const bool isBetween =
        sample.time_s > from_s + kSameTime_s && sample.time_s < to_s - kSameTime_s;
    if (isBetween) e = std::max(e, sample.e);
  }
  return e;
}

bool Trace::isUMonotone(double from_s) const {
  double last = std::numeric_limits<double>::infinity();
  for (const Sample& sample : samples) {
    if (sample.time_s < from_s - kSameTime_s || sample.U < kRounding) continue;
    if (!(sample.U <= last * (1 + 1e-9))) return false;
    last = sample.U;
  }
  return true;
}

double Trace::lastAbove(double limit) const {
  double time_s = 0;
  for (const Sample& sample : samples) {
    if (sample.e > limit) time_s = sample.time_s;
  }
  return time_s;
}

Trace simulate(const Experiment& experiment) {
  VisualMotionObserver observer = observerOf(experiment);
  PoseRegulationOptions regulationOptions;
  regulationOptions.kc = experiment.kc;
  regulationOptions.mobility = experiment.mobility;
  const PoseRegulation regulation(experiment.cdMo, regulationOptions);
  MotionBuffer odometry(2);
  const PinholeCamera& camera = experiment.camera;
  Eye eye(experiment);
  TargetPose onePose(DotTarget{experiment.points, 0}, camera);
  Trace trace;
  Eigen::Isometry3d cMo = experiment.cMo;
  const double sigma = experiment.noise_px / camera.focal_px();
  std::vector<PointObservation> points;
  double t = 0;
  observer.advance(odometry, t);
  for (int frame = 0; t < experiment.end_s - kSameTime_s; ++frame) {
    if (experiment.source == ErrorSource::truth) {
      observer.correctPose(cMo);
    } else {
      const std::vector<TrackedPoint>& pixels = eye.take(cMo, observer, odometry, t);
      points.clear();
      for (const TrackedPoint& pixel : pixels) {
        const Eigen::Vector2d s = camera.normalise(pixel.u, pixel.v);
        points.push_back({pixel.id, {s.x(), s.y(), sigma}});
      }
      ++trace.framesTaken;
      trace.framesWithAllPoints += pixels.size() == experiment.points.size();
      observer.correct(points);
      if (experiment.comparesPose) {
        const auto pose = onePose.compute(pixels);
        trace.frames.push_back({t, cMo, observer.cMo(), {}});
        if (pose) trace.frames.back().fromOneImage = pose->cMo;
      }
    }
    if (frame == 0) trace.firstError = observer.error();
    const double T = experiment.period_s(frame);
    for (int i = 0; i < experiment.substeps; ++i) {
      const Eigen::Isometry3d& estimate = observer.cMo();
      const Eigen::Isometry3d g_ce = experiment.cdMo.inverse() * estimate;
      const Eigen::Isometry3d g_ee = estimate.inverse() * cMo;
      const double e = std::hypot(poseError(g_ce).norm(), poseError(g_ee).norm());
      const double U = poseEnergy(g_ce) + poseEnergy(g_ee);
      const Twist twist = regulation.command(estimate);
      trace.samples.push_back({t, e, U, twist});
      if (!(e < kDiverged)) {
        trace.samples.back().e = std::numeric_limits<double>::infinity();
        return trace;
      }
      const double h = T / experiment.substeps;
      const Twist V_wo = experiment.targetTwist(t + 0.5 * h);
      odometry.push(t, twist);
      odometry.holdUntil(t + h);
      observer.advance(odometry, t + h);
      cMo = carried(moved(cMo, Motion::fromTwist(twist, h)), V_wo, h);
      t += h;
    }
  }
  return trace;
}

Experiment simulationA(double fps) {
  Experiment a;
  a.points = {{.5, .5, .5}, {-.5, .5, .5}, {-.5, -.5, .5}, {.5, -.5, .5}};
  a.cMo = at(3, -5, 7);
  a.cMo.linear() = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitY()).toRotationMatrix();
  a.cMoGuess = at(0, 0, 1);
  a.cdMo = at(0, 0, .5);
  a.kc = 6.5;
  a.ke = 1.7;
  a.end_s = 60;
  a.period_s = [fps](int) { return 1 / fps; };
  a.targetTwist = [](double t) -> Twist {
    if (t < 30) return {{0, 0, std::sqrt(2.0)}, {0, 0, 0}};
    if (t < 40) return {{.5, 0, 1}, {.5 * std::sin(2 * t), 0, .5 * std::cos(t)}};
    if (t < 50) return {{0, std::cos(t), 0}, {0, std::sin(.5 * t), 0}};
    return {};
  };
  return a;
}

Experiment simulationAVariable() {
  Experiment a = simulationA(60);
  a.period_s = [](int i) { return 1 / (75 + 15 * std::sin(.7 * i)); };
  return a;
}

Experiment rendered(Experiment experiment) {
  experiment.source = ErrorSource::rendered;
  if (experiment.mobility == Mobility::full) {
    experiment.camera = {1600, 1600, 250, 250, 799.5, 799.5};
    experiment.dotRadius = 0.06;
  }
  return experiment;
}

Experiment experimentB() {
  Experiment b;
  b.points = {{-.02, .12, .10}, {.02, .08, .10}, {-.02, .08, .14}, {.02, .12, .14}};
  b.cMo = at(0, 0, .37);
  b.cMoGuess = at(0, 0, .4);
  b.cdMo = at(0, 0, .33);
  b.kc = 2;
  b.ke = 1.4;
  b.mobility = Mobility::planar;
  b.period_s = [](int) { return 1 / 18.0; };
  b.substeps = 15;
  b.end_s = 40;
  b.targetTwist = [](double t) -> Twist {
    if (t >= 10 && t < 20) {
      const double s = std::sin((t - 10) * M_PI / 10);
      return {{.025 * s, 0, .07 * s}, {0, 0, 0}};
    }
    if (t >= 20 && t < 25) return {{0, 0, 0}, {0, .4 * std::sin((t - 20) * M_PI / 5), 0}};
    return {};
  };
  return b;
}

Experiment sweepAt(double fps, Law law) {
  Experiment experiment = simulationA(fps);
  experiment.law = law;
  experiment.substeps = std::max(5, static_cast<int>(std::lround(300 / fps)));
  return experiment;
}

}  // namespace depthservo::ibuki2023
