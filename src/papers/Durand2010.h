#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <vector>

#include "depthservo/depth/WindowFit.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/report/Figure.h"
#include "depthservo/robots/PanUnicycle.h"
#include "depthservo/scenario/Scenario.h"
#include "papers/Claims.h"

/// The simulations of Durand Petiteville, Courdesses, Cadenat 2010, section 4, on exact geometry.
/// The paper leaves open the focal length, the robot's dimensions, the landmark, the depth at the
/// goal and the law of the noise; they are chosen here.
namespace depthservo::durand2010 {

constexpr double kPeriod_s = 0.1;  ///< of images and commands
constexpr double kFocal_px = 600;
constexpr int kPoints = 4;  ///< at (0, +-0.3, +-0.3) m around the origin, at the camera's height
constexpr int kWindow = 20;

/// (x [m], y [m], theta [rad], pan [rad]) with the signs that were lost in print.
extern const PanUnicycle::State kStart, kGoal;

using Points = std::array<PointState, kPoints>;

/// The landmark as a camera sees it.
Points project(const Eigen::Isometry3d& wMc);

/// An image and what was done about it.
struct Tick {
  PanUnicycle::State state;
  Eigen::Isometry3d wMc;
  Points truth;
  Points measured;      ///< with noise; chi is the true one
  Points used;          ///< by the control law: measured, or reconstructed; chi only if that
  double error_px = 0;  ///< true max |s - s*|
  Eigen::Vector3d q = Eigen::Vector3d::Zero();  ///< command (v, w, pan rate)
};
using Run = std::vector<Tick>;  ///< one every kPeriod_s from 0

enum class Noise {
  none,
  gaussian,  ///< 1 px standard deviation on each coordinate
  uniform    ///< within +-1 px
};

enum class WhileHidden { reconstruct, freeze, holdVelocity, stop };

/// No images for from <= tick < to.
struct Occlusion {
  int from = 0, to = 0;
  WhileHidden what = WhileHidden::reconstruct;
  /// Point and inverse depth in the last image, from the run so far.
  std::function<PointState(const Run&, int point)> start;

  bool covers(int tick) const { return tick >= from && tick < to; }
};

/// The task-function law with gain 0.7 1/s, the robot's exact motion.
Run simulate(unsigned seed, Noise noise, int ticks, const Occlusion& occlusion = {});

using Fit = WindowFit (*)(const WindowImages&);

/// A point's images at these ticks, the first of them the newest.
std::vector<WindowImage> imagesAt(const Run& run, const std::vector<int>& ticks, int point);

/// The fit of a point at a tick from at most m earlier images.
WindowFit fitAt(const Run& run, int tick, int point, Fit fit, int m = kWindow);
WindowFit fitOf(const std::vector<WindowImage>& images, Fit fit);

/// The observer of De Luca, Oriolo, Robuffo Giordano 2008 as sampled for this comparison: exact
/// prediction, then (x, y) += T k e, chi += T k_3 Omega.e, chi within [1e-3, 20] 1/m, Omega from
/// the measured point. Scheduled gains are k_3 / (|Omega|^2 + 1e-6).
struct SampledObserver {
  double k = 5, k_3 = 100;
  bool isScheduled = false;

  /// Relative errors of chi at every tick from 1 on, started at Z = 10 m.
  std::vector<double> relativeErrors(const Run& run, int point, int ticks) const;
};

/// One way to survive the occlusions.
struct OcclusionCase {
  const char *id, *claim;
  WhileHidden what;
  std::function<PointState(const Run&, int)> start;
};

std::vector<OcclusionCase> occlusionCases();

/// Simulation (ii) through images: what data/scenarios/durand2010/noise.yaml says.
Scenario imageScenario();

/// A run through images, and where the camera was.
struct ImageRun {
  RunLog log;
  std::vector<Eigen::Isometry3d> wMc;  ///< by frame

  /// True max |s - s*| of a frame [px].
  double error_px(std::size_t frame) const;
};
ImageRun runThroughImages(const Scenario& scenario);

/// The simulations again, with points measured in rendered images.
void addImages(Measurements& measured, unsigned seed, unsigned seeds);

/// The simulations in pictures.
std::vector<Figure> figures(unsigned seed);

}  // namespace depthservo::durand2010
