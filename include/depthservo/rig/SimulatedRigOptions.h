#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/motion/OdometryNoise.h"
#include "depthservo/motion/OdometryRow.h"
#include "depthservo/robots/RobotOptions.h"
#include "depthservo/target/TargetOptions.h"
#include "depthservo/text/Refuse.h"

namespace depthservo {

/// An error that lasts for a while: first-order autoregressive.
struct LastingError {
  double sigma = 0;  ///< 1 sigma at any time
  double tau = 0;    ///< after this time exp(-1) of it is left [s]; 0: white
};

/// The camera of a simulated robot and its clock.
struct CameraOptions {
  int width = 640, height = 480;    ///< [px]
  double fx = 600, fy = 600;        ///< [px]
  double cx = 319.5, cy = 239.5;    ///< [px]
  std::vector<double> rate = {30};  ///< images per second, taken in turn [Hz]
  double jitter = 0;                ///< greatest change of an interval, as a fraction of it [-]
  double dropped = 0;               ///< probability that an image gets lost [-]
  double focal_error =
      0;  ///< true / given focal length - 1; simulated error; the estimator is not informed [-]
  double focal_drawn = 0;  ///< 1 sigma of what is added to focal_error, drawn by the seed [-]
  double focal_sigma = 0;  ///< 1 sigma of it told to the estimator [-]

  /// As given, to the estimator and the control law.
  PinholeCamera pinhole() const { return {width, height, fx, fy, cx, cy}; }
  /// As it really is.
  PinholeCamera truePinhole() const {
    return {width, height, fx * (1 + focal_error), fy * (1 + focal_error), cx, cy};
  }

  /// Images per second over the longest interval, if none is dropped [Hz].
  double slowest() const { return *std::min_element(rate.begin(), rate.end()) / (1 + jitter); }
  /// Images per second over the shortest interval, without jitter [Hz].
  double fastest() const { return *std::max_element(rate.begin(), rate.end()); }
};

/// Points from rendered images, or projected.
enum class SensingSource { geometry, image };

/// Points of which something holds for a while.
struct DEPTHSERVO_API PointPeriod : Interlude {
  std::vector<int> points;  ///< indices; empty: all

  bool covers(double time_s, int point) const;
};

/// A clock that is set.
struct ClockStep {
  double at = 0;  ///< [s]
  double by = 0;  ///< [s]; 0: it is not
};

/// What becomes of an image or of its points on the way to the estimator.
struct DEPTHSERVO_API SensingOptions {
  SensingSource source = SensingSource::image;
  TargetKind tracker = TargetKind::dots;  ///< must be target.type
  double pixel_noise = 0;                 ///< 1 sigma per axis of every measured position [px]
  int corners = 24;  ///< of a wall that are followed, at most, spread over the taught image
  std::optional<double>
      assumed_noise;                 ///< 1 sigma told to the estimator [px]; see assumedNoise_px()
  std::vector<PointPeriod> hidden;   ///< not seen
  std::vector<PointPeriod> swapped;  ///< each is taken for the next one in the list
  double outliers = 0;               ///< fraction of measurements that are wrong [-]
  double delay = 0;                  ///< age of an image when it arrives [s]
  double latency =
      0;  ///< images are stamped so late; simulated error; the estimator is not informed [s]
  double latency_drawn =
      0;  ///< 1 sigma of what is added to the latency, drawn by the seed, >= 0 [s]
  ClockStep clock_step;
  double stamp_jitter = 0;      ///< 1 sigma of the stamp of each image, white [s]
  double readout = 0;           ///< rolling shutter: from the first row to the last [s]
  LastingError wander{0, 0.7};  ///< of every measured position, each axis by itself [px]
  double gray_noise = 0;        ///< 1 sigma [gray levels]
  double exposure = 0;          ///< motion blur lasts this long [s]
  double vignetting = 0;        ///< fraction of light lost in the corners [-]
  bool light_on_dark = false;   ///< dots lighter than the plate

  /// assumed_noise if given, else max(pixel_noise, 0.1) [px].
  double assumedNoise_px() const;
};

/// How the robot measures its own motion.
struct DEPTHSERVO_API OdometryOptions {
  double scale = 1;                                 ///< measured / true linear velocity [-]
  double scale_sigma = 0;                           ///< 1 sigma of it told to the estimator [-]
  Eigen::Vector2d noise = Eigen::Vector2d::Zero();  ///< 1 sigma per row [m/s, rad/s]
  /// Added to the angular velocity in the camera frame; simulated error; the estimator is not
  /// informed [rad/s]
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  double scale_drawn = 0;     ///< 1 sigma of true / measured linear velocity, drawn by the seed [-]
  LastingError slip{0, 0.5};  ///< of true / measured linear velocity [-]
  double gyro_bias_drawn =
      0;                  ///< 1 sigma of each axis, drawn by the seed, added to gyro_bias [rad/s]
  double gyro_noise = 0;  ///< 1 sigma per row and axis, white [rad/s]; not in declaredNoise()
  double rate = 30;       ///< rows per second [Hz]
  OdometryMode mode = OdometryMode::measured;
  RowMeaning rows = RowMeaning::hold;
  double ticks = 0;             ///< resolution of the wheel encoders [m]; 0: perfect
  double wheel_base = 0.36;     ///< distance between the wheels [m]
  std::vector<Interlude> gaps;  ///< rows that begin then are lost

  /// What the estimator is told of it.
  OdometryNoise declaredNoise() const;
};

/// A simulated robot before its target: what is true, and what is told of it.
///
/// World frame: z up, x and y on the floor.
struct SimulatedRigOptions {
  unsigned seed = 1;
  double duration = 30;  ///< [s]
  CameraOptions camera;
  TargetOptions target;
  RobotOptions robot;
  SensingOptions sensing;
  OdometryOptions odometry;
};

/// One robot of those that the options describe: what the seed draws once (the keys `*_drawn`) is
/// added to the error itself, and is 0 in the result.
DEPTHSERVO_API SimulatedRigOptions drawnRobot(SimulatedRigOptions rig);

/// What does not fit together, target and robot included.
DEPTHSERVO_API void check(const SimulatedRigOptions& rig, const Refuse& refuse);

}  // namespace depthservo
