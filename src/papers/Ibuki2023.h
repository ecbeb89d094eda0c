#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/papers/Reproduce.h"
#include "depthservo/pose/PoseRegulation.h"
#include "depthservo/pose/VisualMotionObserver.h"

/// The closed loops of Ibuki et al. 2023, section 7, as pure simulations: camera and target on
/// SE(3), exact in every sub-step.
namespace depthservo::ibuki2023 {

/// Where the observer's e_e comes from.
enum class ErrorSource {
  truth,    ///< the true pose
  image,    ///< the image points
  rendered  ///< the same, measured in rendered images of dots
};

enum class Law {
  coupled,  ///< the paper's (22)
  cascade   ///< observer by itself
};

/// A simulated experiment: everything that determines its outcome.
struct Experiment {
  std::vector<Eigen::Vector3d> points;           ///< of the target [m]
  Eigen::Isometry3d cMo, cMoGuess, cdMo;         ///< true and estimated at the start, desired
  std::function<Twist(double t_s)> targetTwist;  ///< V_wo, target axes
  double kc = 0, ke = 0;                         ///< [1/s]
  Mobility mobility = Mobility::full;
  std::function<double(int frame)> period_s;  ///< from this frame to the next [s]
  int substeps = 5;                           ///< odometry steps per frame
  double end_s = 60;

  ErrorSource source = ErrorSource::truth;
  ImageErrorMethod method = ImageErrorMethod::mixed;
  Law law = Law::coupled;
  VisualMotionObserverOptions::LostFrames lostFrames =
      VisualMotionObserverOptions::LostFrames::unguarded;

  double noise_px = 0;  ///< of the points, per axis; images only
  PinholeCamera camera{640, 480, 800, 800, 319.5, 239.5};
  double dotRadius = 0.002;  ///< [m]; rendered images only; larger ones merge as the target turns
  unsigned seed = 1;
  bool comparesPose = false;  ///< whether each image's own pose (vpPose) is computed as well
};

/// State at the start of an odometry step.
struct Sample {
  double time_s = 0;
  double e = 0;  ///< |(e_c, e_e)|
  double U = 0;  ///< E(g_ce) + E(g_ee)
  Twist twist;
};

/// Squared errors of a pose, and how many.
struct PoseErrors {
  double position2 = 0, angle2 = 0, depth2 = 0;
  int count = 0, depths = 0;

  void add(const Eigen::Isometry3d& estimated, const Eigen::Isometry3d& truth,
           const std::vector<Eigen::Vector3d>& points);
  double position() const;  ///< rms [m]
  double angle() const;     ///< rms [rad]
  double depth() const;     ///< rms over the points [m]
};

/// What a simulation gave.
struct Trace {
  std::vector<Sample> samples;
  int framesWithAllPoints = 0, framesTaken = 0;
  Vector6d firstError = Vector6d::Zero();  ///< e_e as the first frame had it
  struct FramePoses {
    double time_s = 0;
    Eigen::Isometry3d truth, observed;
    std::optional<Eigen::Isometry3d> fromOneImage;
  };
  std::vector<FramePoses> frames;  ///< with comparesPose only

  double before(double time_s) const;                ///< |e| at the last sample before this time
  double largest(double from_s, double to_s) const;  ///< of |e|, both ends excluded
  bool isUMonotone(double from_s) const;             ///< U never increases from then on
  double lastAbove(double limit) const;              ///< last time [s] with |e| above the limit
};

/// Stops early when |e| exceeds 1e6 or is no number; |e| is then infinite.
Trace simulate(const Experiment& experiment);

/// Section 7.1 at a fixed frame rate: large start error, target in every kind of motion.
Experiment simulationA(double fps);

/// The same with the camera period 1/(75 + 15 sin(0.7 i)) s.
Experiment simulationAVariable();

/// Section 7.2 in simulation: planar robot, 18 frames per second.
Experiment experimentB();

/// The same, seen by a camera. That of simulation A must be wide: the target swings to 70 degrees
/// off the axis.
Experiment rendered(Experiment experiment);

/// A frame rate of the sweep, at odometry steps of at most 1/300 s.
Experiment sweepAt(double fps, Law law);

/// The paper's figures and what goes with them.
std::vector<Figure> figures(const ReproduceOptions& options);

}  // namespace depthservo::ibuki2023
