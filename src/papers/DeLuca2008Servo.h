#pragma once

#include <Eigen/Core>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/rig/SimulatedRigOptions.h"

/// The servo of a unicycle before a plate of four dots, De Luca, Oriolo, Robuffo Giordano 2008,
/// sec. 7.2 (points) and 7.3 (moments), simulated on exact geometry or through images.
namespace depthservo::deluca2008 {

/// Camera, plate and goal of an experiment. Dots in the order of the paper's pixels: bottom left,
/// bottom right, top right, top left. World frame: z up; the plate stands at the origin and
/// faces the -x direction.
struct Arrangement {
  PinholeCamera camera;
  double width, height;            ///< of the plate, from dot to dot [m]
  double below;                    ///< height of the camera above the middle of the plate [m]
  double X_goal, Z_goal, heading;  ///< middle of the plate in the camera at the goal [m, m, rad]
};

/// The paper does not say how large its images are.
enum class ImageSize { vga, xga };
Arrangement pointArrangement(ImageSize size);
Arrangement momentArrangement(ImageSize size);

enum class FeatureChoice { points, moments, momentsInPixels };

/// Where the servo takes its depths from.
enum class DepthSource {
  truth,
  constant,
  observer,  ///< one for each point
  object,    ///< one for the plate
  euler      ///< one for each point, the paper's differential equation by Euler's method
};

struct Method {
  FeatureChoice features = FeatureChoice::points;
  DepthSource depth = DepthSource::observer;
  double guess = 1;    ///< [m]
  double k_3 = 44000;  ///< normalised [1/m^2]; k_1 = k_2 = 48/s
  double Z_min = 0.5;  ///< of the observers [m]; Z_max is 20 m
};

struct Circumstances {
  bool throughImages = false;
  bool isSpeedLimited = true;  ///< to .7 m/s and .8 rad/s
  double lag_s = 0.08;         ///< time constant of the drives
  int delay = 0;               ///< frames from an image to the command that it causes
  unsigned seed = 1;           ///< of the image noise
};

/// Where the plate is at first: its middle at (X, Z) in the camera, and the robot's heading.
struct Start {
  double X, Z;     ///< [m]
  double heading;  ///< [rad]
};

/// The 35 starts of the tables: 7 lateral positions, 5 headings each.
std::vector<Start> startsOfTables(const Arrangement& arrangement, double Z);
/// The 63 starts of the search for the published contrast: 9 lateral positions, 7 headings.
std::vector<Start> startsOfSearch(const Arrangement& arrangement);

/// The robot before the plate, its odometry by wheel encoders.
SimulatedRigOptions rigOptions(const Arrangement& arrangement, const Start& start,
                               const Circumstances& circumstances = {});

/// One instant of a run.
struct Instant {
  double time_s;
  std::vector<Eigen::Vector2d> pixels;  ///< true positions of the dots
  std::vector<double> Z, Z_used;        ///< of each dot, true and as the servo has it [m]
};

/// How a run ended: after 40 s, or when a dot left the image.
struct Course {
  bool stayedInImage = false;
  double end_s = 0;
  double rms_px = 0;                  ///< of the dots' distances from the goal
  double barycentre_px = 0;           ///< of its distance from the goal
  double ZRatio = 0;                  ///< depth of the middle of the plate over that at the goal
  std::vector<Eigen::Vector2d> goal;  ///< of the dots [px]
  std::vector<Instant> path;          ///< when asked for

  /// Sec. 8.5 and 8.6 of the specification: at the goal, as far as this robot gets there.
  bool reachedPoints() const { return stayedInImage && rms_px < 15; }
  bool reachedMoments() const {
    return stayedInImage && barycentre_px < 15 && std::abs(ZRatio - 1) < 0.1;
  }
};

enum class Keep { theEnd, everything };
Course servo(const Arrangement& arrangement, const Start& start, const Method& method,
             const Circumstances& circumstances = {}, Keep keep = Keep::theEnd);

/// A run from each start, on all processors; the same result on any number of them.
std::vector<Course> servoFromAll(const Arrangement& arrangement, const std::vector<Start>& starts,
                                 const Method& method, const Circumstances& circumstances = {});

}  // namespace depthservo::deluca2008
