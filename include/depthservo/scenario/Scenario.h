#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/motion/OdometryNoise.h"
#include "depthservo/motion/VelocityProfile.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/target/AprilTagTarget.h"
#include "depthservo/target/DotTarget.h"
#include "depthservo/text/InputError.h"

namespace depthservo {

/// Every depth estimator by the name users give it: constant | true | two-frame | nonlinear |
/// window | filter | joint | pose.
enum class EstimatorKind { constant, trueDepth, twoFrame, nonlinear, window, filter, joint, pose };
const char* toString(EstimatorKind kind);

/// The estimator of this name, if this version has it; otherwise throws InputError at `place`.
EstimatorKind availableEstimator(const std::string& name, const InputError::Place& place);

/// Robots that carry the camera: unicycle | pan-unicycle | omni | mobile-manipulator | free.
enum class RobotKind { unicycle, panUnicycle, omni, mobileManipulator, free };

/// What the camera looks at, and how it is tracked: dots | apriltag.
enum class TargetKind { dots, apriltag };

/// What computes the command: vpServo | task | profile | regulation.
enum class Law { vpServo, task, profile, regulation };

/// What vpServo steers by: points | moments.
enum class FeatureKind { points, moments };

/// Everything a closed-loop run needs. A member is the YAML key of the same name, with its default;
/// units, ranges and effects of all keys stand in doc/formats.md.
///
/// World frame: z up, x and y on the floor. Poses with `rpy` (roll, pitch, yaw) [rad] have the
/// rotation Rz(yaw) Ry(pitch) Rx(roll) and map coordinates of the posed frame to the world.
struct Scenario {
  struct Camera {
    int width = 640, height = 480;    ///< [px]
    double fx = 600, fy = 600;        ///< [px]
    double cx = 319.5, cy = 239.5;    ///< [px]
    std::vector<double> rate = {30};  ///< images per second, taken in turn [Hz]
    double jitter = 0;                ///< greatest change of an interval, as a fraction of it [-]
    double dropped = 0;               ///< probability that an image gets lost [-]
    double focal_error = 0;           ///< true / given focal length - 1; nobody is told [-]
    double focal_sigma = 0;           ///< 1 sigma of it told to the estimator [-]

    /// As given, to the estimator and the control law.
    PinholeCamera pinhole() const { return {width, height, fx, fy, cx, cy}; }
    /// As it really is.
    PinholeCamera truePinhole() const {
      return {width, height, fx * (1 + focal_error), fy * (1 + focal_error), cx, cy};
    }

    /// Images per second over the longest interval, if none is dropped [Hz].
    double slowest() const { return *std::min_element(rate.begin(), rate.end()) / (1 + jitter); }
  };

  struct Pose {
    Eigen::Vector3d xyz = Eigen::Vector3d::Zero();  ///< [m]
    Eigen::Vector3d rpy = Eigen::Vector3d::Zero();  ///< [rad]

    Eigen::Isometry3d isometry() const;
  };

  /// An AprilTag on the target.
  struct Tag {
    int id = 0;
    double size = 0.16;                  ///< side of the square between the corners, as it is [m]
    std::optional<double> assumed_size;  ///< as the user believes [m]; none: unknown
    Pose pose;                           ///< in the object frame
  };

  struct Target {
    TargetKind type = TargetKind::dots;
    /// Centres of the dots, or the corners of the tags (not read then, but worked out) [m], object
    /// frame.
    std::vector<Eigen::Vector3d> points;
    double radius = 0.02;          ///< of the dots [m]
    std::string family = "36h11";  ///< of the tags
    std::vector<Tag> tags;
    /// wMo. The default faces the -x direction of the world: object x is world -y, y is world -z
    /// and z is world x.
    Pose pose{{0, 0, 0.13}, {-1.5707963267948966, 0, -1.5707963267948966}};
    VelocityProfile twist;  ///< of the target in its own frame; empty: it stands still

    /// What is known of the points: of tags only if their sizes are assumed.
    DotTarget dots() const;
    AprilTagTarget trueTags() const;     ///< with the sizes that they have
    AprilTagTarget assumedTags() const;  ///< with the sizes that are assumed
  };

  /// Where a robot is.
  struct RobotPose {
    double x = 0, y = 0;                               ///< on the floor [m]
    double theta = 0;                                  ///< [rad], from world x towards y
    double pan = 0;                                    ///< of the pan platform [rad]
    Eigen::Vector3d joints = Eigen::Vector3d::Zero();  ///< q1, q2, q3 of the arm [rad]
    Pose camera;                                       ///< of a free camera, wMc
  };

  struct Limits {
    double v = 0.5;                        ///< [m/s]
    double w = 1;                          ///< [rad/s]
    double dv = 1;                         ///< [m/s^2]
    double dw = 2;                         ///< [rad/s^2]
    double pan = 1;                        ///< rate of the pan platform [rad/s]
    double pan_min = -3.2, pan_max = 3.2;  ///< its end stops [rad]
    double joints = 1;                     ///< rate of each joint of the arm [rad/s]
  };

  /// Of a mobile manipulator; the camera at its tip looks along the forearm.
  struct Arm {
    Eigen::Vector3d mount{0.1, 0, 0.2};                    ///< foot of the column, robot frame [m]
    double column = 0.3, upper_arm = 0.35, forearm = 0.3;  ///< lengths [m]
  };

  struct Robot {
    RobotKind type = RobotKind::unicycle;
    Eigen::Vector3d camera_offset = Eigen::Vector3d::Zero();  ///< robot frame: x forward, z up [m]
    double camera_yaw = 0;                                    ///< optical axis, about robot z [rad]
    double pan_axis = 0.1;  ///< of the pan platform, ahead of the wheel axle [m]
    Arm arm;
    RobotPose initial;
    std::optional<RobotPose> goal;  ///< this or control.desired
    Limits limits;
    double lag = 0;  ///< time constant of the drives [s]; 0: none
  };

  enum class Source { geometry, image };

  /// Points that are not seen for a while.
  struct Hidden {
    double from = 0, to = 0;  ///< [s], from < to
    std::vector<int> points;  ///< indices; empty: all

    bool covers(double time_s, int point) const;
  };

  struct Sensing {
    Source source = Source::image;
    TargetKind tracker = TargetKind::dots;  ///< as target.type
    double pixel_noise = 0;                 ///< 1 sigma per axis of every measured position [px]
    std::optional<double>
        assumed_noise;  ///< 1 sigma told to the estimator [px]; see assumedNoise_px()
    std::vector<Hidden> hidden;
    double outliers = 0;         ///< fraction of measurements that are wrong [-]
    double delay = 0;            ///< age of an image when it arrives [s]
    double latency = 0;          ///< images are stamped so late; nobody is told [s]
    double gray_noise = 0;       ///< 1 sigma [gray levels]
    double exposure = 0;         ///< motion blur lasts this long [s]
    double vignetting = 0;       ///< fraction of light lost in the corners [-]
    bool light_on_dark = false;  ///< dots lighter than the plate

    /// assumed_noise if given, else max(pixel_noise, 0.1) [px].
    double assumedNoise_px() const;
  };

  struct Odometry {
    double scale = 1;                                 ///< measured / true linear velocity [-]
    double scale_sigma = 0;                           ///< 1 sigma of it told to the estimator [-]
    Eigen::Vector2d noise = Eigen::Vector2d::Zero();  ///< 1 sigma per row [m/s, rad/s]
    /// Added to the angular velocity in the camera frame; nobody is told [rad/s]
    Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
    double rate = 30;  ///< rows per second [Hz]
    OdometryMode mode = OdometryMode::measured;
    double ticks = 0;          ///< resolution of the wheel encoders [m]; 0: perfect
    double wheel_base = 0.36;  ///< distance between the wheels [m]

    /// What the estimator is told of it.
    OdometryNoise declaredNoise() const;
  };

  /// Gains of the nonlinear observer: k and k_3 if given, otherwise scheduled by settling and
  /// W_min.
  struct Gains {
    double settling = 1.5;         ///< to 2 % [s]
    double W_min = 0.01;           ///< excitation below which the gain stops growing [m/s]
    std::optional<double> k, k_3;  ///< [1/s] and [1/m^2], normalised image coordinates

    ObserverGains observer() const;
  };

  /// Of the estimator `pose`.
  struct KnownTarget {
    std::optional<double> ke;  ///< gain [1/s]; none: designed for the frame rate and `kappa`
    double kappa = 0.1;        ///< how fast the target may move [m/s, rad/s]
    bool guard = true;         ///< end the correction by an image once it is complete
  };

  /// What the joint filter learns besides depths; see JointDepthFilter.
  struct Joint {
    bool time_offset = true, gyro_bias = false, focal = false;
  };

  struct Depth {
    EstimatorKind estimator = EstimatorKind::filter;
    double initial = 1;                ///< first guess for every point [m]
    double Z_min = 0.05, Z_max = 100;  ///< [m]
    bool object = false;               ///< one depth for all points (nonlinear observer)
    Gains gains;
    Joint joint;
    KnownTarget pose;

    DepthRange range() const { return {Z_min, Z_max}; }
  };

  enum class Interaction { current, mean, desired };

  /// Motion that is added to learn depths; see doc/estimators.md.
  struct Excite {
    double speed = 0.05;  ///< of the camera across the line of sight [m/s]
    double limit = 40;    ///< by which it may displace a point in the image while it lasts [px]
  };

  struct Control {
    double gain = 0.57;        ///< lambda [1/s]
    double gain_in_doubt = 1;  ///< factor of it while a depth is vague and the way is long [-]
    ServoDepth depth = ServoDepth::observed;  ///< what the task is given
    std::optional<Excite> excite;
    double tolerance = 1.5;  ///< rms image error at which the task is done [px]
    FeatureKind features = FeatureKind::points;
    double size_weight = 1;  ///< value of the third moment feature at the goal [-]
    Interaction interaction = Interaction::current;
    /// Image sigma predicted for a hidden point at which the robot has been slowed down to a stop;
    /// it goes at full speed up to half of it [px].
    double hidden_sigma = 20;
    double hidden_wait = 10;  ///< it stands still for want of points for at most this long [s]
    Law law = Law::vpServo;
    VelocityProfile profile;               ///< of the robot, for the law of this name
    double kc = 1;                         ///< gain of the law regulation [1/s]
    bool coupled = false;                  ///< regulation: the coupled law of Ibuki et al. 2023
    std::vector<Eigen::Vector2d> desired;  ///< desired pixels (u, v); empty: seen from robot.goal
  };

  struct Expect {
    Outcome outcome = Outcome::converged;  ///< what the run must end with
  };

  std::string file;  ///< where it was read; not a key
  std::string name;
  unsigned seed = 1;
  double duration = 30;  ///< [s]
  Camera camera;
  Target target;
  Robot robot;
  Sensing sensing;
  Odometry odometry;
  Depth depth;
  Control control;
  std::optional<Expect> expect;  ///< makes the run a regression test

  /// Reads a scenario. \param overrides "key.path=value" each, applied in order; the value is YAML,
  /// and `null` removes the key. Throws InputError.
  static Scenario load(const std::string& path, const std::vector<std::string>& overrides = {});

  /// The effective configuration with all defaults: one JSON object, always in the same order.
  std::string toJson() const;

  /// Every key there is, as "section.key".
  static std::vector<std::string> keys();
};

}  // namespace depthservo
