#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/ConsistencyMonitor.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/MeasurementNoise.h"
#include "depthservo/motion/OdometryRow.h"
#include "depthservo/motion/Twist.h"
#include "depthservo/motion/Velocities.h"
#include "depthservo/observation/Film.h"
#include "depthservo/pose/FrameRateConditions.h"

namespace depthservo {

/// How a run ended.
enum class Outcome { converged, stalled, leftImage, lost, diverged, collision, timeout };
/// As printed: converged | stalled | left-image | lost | diverged | collision | timeout.
DEPTHSERVO_API const char* toString(Outcome outcome);

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One feature in one frame.
struct FeatureRecord {
  int id = 0;
  double u = 0, v = 0;  ///< measured, or predicted while hidden [px]
  bool measured = false;
  double sigma_px = kUnknown;  ///< of the measurement as the estimator is told, 1 sigma per axis
  DepthEstimate estimate;
  double Z_true = kUnknown;                     ///< [m]
  double u_true = kUnknown, v_true = kUnknown;  ///< where the point really is, seen or not [px]
  double frames_to_5pct = kUnknown;             ///< forecast; 0: known to 5 %, infinite: never
};

/// One image and what was done about it.
struct FrameRecord {
  double time_s = 0;
  double error_px =
      kUnknown;        ///< rms distance of the features to their goals [px]; not in a replay
  Velocities command;  ///< robot velocities asked for (v [m/s], w [rad/s]); not in a replay
  Velocities applied;  ///< the same after limits and actuators
  Twist twist;         ///< of the camera, as measured by odometry
  Eigen::Vector3d robotPose{kUnknown, kUnknown, kUnknown};  ///< x, y [m], theta [rad] in the world
  std::vector<FeatureRecord> features;
};

/// Timestamped event, marked in plots.
struct Event {
  double time_s = 0;
  std::string what;  ///< "point 2 hidden"
};

/// Whether images and odometry agreed with what was declared of them.
struct DEPTHSERVO_API RunDiagnosis {
  ConsistencyMonitor::Diagnosis latest;  ///< the cause that was named longest, as last named
  double first_s = kUnknown;             ///< when it was named first
  double named_s = 0;                    ///< for how long in all [s]
  double varianceFactor = 1;             ///< greatest inflation of reported variances
  bool isCompensated = false;            ///< the estimator learns the very thing
  std::string explanation;               ///< what would explain the images; empty: not known

  /// Innovations smaller than declared are no fault: sigma is too large, that is all.
  bool isFault() const { return std::isfinite(first_s); }

  /// Whether the motion, as given, is not that of the images: what follows from it says nothing.
  bool isMotion() const { return latest.isMotion(); }

  std::string message() const;
};

/// What the joint filter has learnt besides depths.
struct DEPTHSERVO_API JointStates {
  JointDepthFilter::Common timeOffset;               ///< [s], > 0: images are late
  std::array<JointDepthFilter::Common, 3> gyroBias;  ///< [rad/s]
  JointDepthFilter::Common focal;                    ///< true / given focal length [-]

  /// Whether this is among what was estimated.
  bool estimates(ConsistencyMonitor::Cause cause) const;

  /// A sentence for each that was estimated, with 2 sigma, or why it is not known. \param focal_px
  /// as given
  std::vector<std::string> sentences(double focal_px) const;
};

/// What has been learnt of the noise, a sentence.
DEPTHSERVO_API std::string sentenceOf(const MeasurementNoise& noise);

/// What the observed depths of an AprilTag's corners say of its size.
struct TagRecord {
  int id = 0;
  double size = kUnknown;           ///< as given [m]
  double observed_size = kUnknown;  ///< as observed at the end [m]
  double sigma = kUnknown;          ///< 1 sigma of that [m]
  bool disagrees = false;           ///< both sizes were apart by more than both sigmas
};

/// What the frame rate that was met means for the gain of the estimator `pose`.
struct FrameRateReport {
  double ke = 0, kappa = 0;  ///< [1/s], [m/s, rad/s]
  std::optional<double> kc;  ///< of the coupled law [1/s]
  FrameRateCheck check;
  std::string sentence;  ///< the same in words
};

/// The whole story of a run or a replay, in memory.
struct RunLog {
  std::string command;        ///< "run" or "replay"
  std::string name;           ///< of the scenario or the sequence
  std::string configuration;  ///< effective configuration, one JSON object
  unsigned seed = 0;
  PinholeCamera camera;
  std::vector<Eigen::Vector2d> goals;     ///< desired pixels by feature index; empty in a replay
  std::vector<std::string> commandNames;  ///< "v [m/s]", "w [rad/s]"
  std::vector<FrameRecord> frames;
  std::vector<Event> events;
  RowMeaning rows = RowMeaning::hold;        ///< of the odometry
  std::vector<OdometryRow> odometry;         ///< as the estimator was told; of a replay
  std::optional<FrameRateReport> frameRate;  ///< with the estimator `pose` only

  std::vector<TagRecord> tags;  ///< by index in the target; empty without tags

  bool hasOutcome = false;  ///< a run has one, a replay has not
  Outcome outcome = Outcome::timeout;
  std::string reason;  ///< one sentence: why it ended like this

  /// Where the camera ended, in the frame of the camera at its goal (which a moving target takes
  /// along); none: no such goal, or its place is not known.
  std::optional<Eigen::Isometry3d> cdMc;

  bool isDepthObserved = true;   ///< false: depths are guesses that are kept (estimator `constant`)
  bool isTruthOfMotion = false;  ///< true depths are of the very pose that tells the motion: they
                                 ///< show agreement with it, not accuracy

  std::string profile;                 ///< of the robot's errors that was in force, by its word
  std::optional<ErrorProfile> errors;  ///< its values; none: white noise alone

  std::optional<RunDiagnosis> diagnosis;  ///< none: not judged
  std::optional<JointStates> joint;       ///< of the joint filter only
  std::optional<MeasurementNoise> noise;  ///< as learnt; none: as declared

  /// Gray images worth keeping, by file stem ("first", "last"), row-major 8 bit of the camera's
  /// size.
  std::vector<std::pair<std::string, std::vector<unsigned char>>> images;
  Film film;  ///< what happened, to look at

  /// Seconds of wall clock per frame, by stage; the only thing that differs between two equal runs.
  std::vector<std::pair<std::string, std::vector<double>>> timings;
};

/// "The image error" of a run is that of its last seconds [s]: the time for which it must be within
/// the tolerance to have converged.
constexpr double kImageErrorOver_s = 2;

/// Image error [px] of the frames from one time to another: the distance of the mean position of
/// each feature to its goal, rms over the features, so that pixel noise averages out. Unknown
/// without goals or features.
DEPTHSERVO_API double meanImageError(const RunLog& log, double from_s, double to_s);

}  // namespace depthservo
