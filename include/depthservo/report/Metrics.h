#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "depthservo/observation/RunLog.h"
#include "depthservo/observation/UnexcitedPeriods.h"

namespace depthservo {

/// What became of one point. Depths are those of the last frame.
struct PointMetrics {
  int id = 0;
  double Z = kUnknown, sigma_Z = kUnknown;  ///< [m]
  double Z_true = kUnknown;                 ///< [m]
  double relative_error = kUnknown;         ///< |Z - Z_true| / Z_true [-]
  DepthStatus status = DepthStatus::unset;
  /// At the end: images like the last until sigma_Z is 5 % of Z; 0: it is; kUnknown: never.
  double frames_to_5pct = kUnknown;
  double time_to_5pct_s = kUnknown;  ///< when sigma_Z first was 5 % of Z, from the first frame [s]
  double last_valid_s = kUnknown;    ///< when it was `valid` last, in the log's time [s]
  std::size_t measured_frames = 0, hidden_frames = 0;
  std::size_t rejected_frames = 0;  ///< measured, and contradicting the prediction
  double unexcited_s = 0;           ///< time in which the camera's motion told nothing of it
  std::string unexcited_because;    ///< of the last second or more of that; empty: none so long

  double known_to() const { return 2 * sigma_Z / Z; }  ///< 2 sigma, relative [-]
};

/// The figures of a run or a replay. Whatever the log cannot tell is kUnknown.
struct Metrics {
  double duration_s = 0;  ///< from the first frame to the last
  std::size_t frames = 0;
  double min_frame_rate = kUnknown;  ///< one over the longest time between frames [Hz]
  /// The image error: `meanImageError` over the last `kImageErrorOver_s` [px].
  double final_error_px = kUnknown;
  /// How far the camera ended from its goal, `RunLog::cdMc`: [m], and the angle in [0, pi] [rad].
  double final_distance_m = kUnknown, final_angle_rad = kUnknown;
  double max_gap_s = 0;             ///< longest time a point, once seen, went without a measurement
  double min_border_px = kUnknown;  ///< least distance of a dot's centre to the border; < 0 outside
  bool all_in_image = false;        ///< every dot was known to be in the image in every frame
  double final_depth_error_max = kUnknown;  ///< greatest relative_error of the points [-]
  /// Share of the estimates (converging or valid, truth known) whose inverse depth is within 2
  /// sigma of the true one [-]; 0.954 for an honest sigma and Gaussian errors. kUnknown where the
  /// "truth" is the pose that also told the motion: that is no evidence.
  double coverage_2sigma = kUnknown;
  std::size_t rejected_measurements = 0;  ///< of all points
  std::size_t rejected_points = 0;        ///< rejected or lost at the end: not to be relied on
  std::size_t points_seen = 0;            ///< in the last frame or before
  std::vector<PointMetrics> points;       ///< those of the last frame, by ascending id

  /// Points that came and went; without truth or tracker that chooses them there are none.
  std::size_t points_gone() const { return points_seen - points.size(); }
};

/// Figures of a run, frame by frame: of runs without end, too. Memory grows with the number of
/// points in a frame only.
class MetricsMeter {
 public:
  MetricsMeter(const PinholeCamera& camera, std::vector<Eigen::Vector2d> goals);

  /// Nobody asks why a depth could not be seen: `unexcited_because` stays empty. Before the first
  /// frame.
  void omitExcitation() { isExcitationAsked_ = false; }

  /// Only frames and their times are looked at: whatever is of points stays unknown. Before the
  /// first frame.
  void omitPoints() { arePointsAsked_ = false; }

  void add(const FrameRecord& frame);

  /// \param log what is known of the run as a whole; its frames are not looked at
  Metrics result(const RunLog& log) const;

 private:
  struct Story {
    PointMetrics point;
    double lastMeasured_s = 0;
    std::size_t frame = 0;  // that knew it last
  };
  void addPoints(const FrameRecord& frame);
  void addPoint(const FeatureRecord& feature, double time_s);
  void judge(const FeatureRecord& feature);
  void seeBorder(const FeatureRecord& feature);
  void keepForImageError(const FrameRecord& frame);

  PinholeCamera camera_;
  RunLog recent_;  // the frames of the final image error, with the goals
  UnexcitedPeriods unexcited_;
  Metrics metrics_;
  std::map<int, Story> stories_;
  double first_s_ = kUnknown, last_s_ = kUnknown;
  std::size_t judged_ = 0, covered_ = 0;
  bool isExcitationAsked_ = true, arePointsAsked_ = true;
};

Metrics computeMetrics(const RunLog& log);

/// "0.35 m and 12° from its goal", and why a run that converged is not there where more than 1 cm or
/// 1 degree is left; empty when not known.
std::string wayLeft(const RunLog& log, const Metrics& metrics);

/// A share in per cent, never in powers of ten: "0.065 %", "250 %".
std::string inPercent(double share);

/// One JSON object: command, name, seed, outcome (of a run only), reason, metrics, diagnosis, joint
/// (of the joint filter only), points. The keys of the figures are the names of the members above;
/// unknown and infinite figures are null.
std::string toJson(const RunLog& log, const Metrics& metrics);
std::string toJson(const RunLog& log);

}  // namespace depthservo
