#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// What became of one point. Depths are those of the last frame that knows the point.
struct PointMetrics {
  int id = 0;
  double Z = kUnknown, sigma_Z = kUnknown;  ///< [m]
  double Z_true = kUnknown;                 ///< [m]
  double relative_error = kUnknown;         ///< |Z - Z_true| / Z_true [-]
  DepthStatus status = DepthStatus::unset;
  double frames_to_5pct = kUnknown;  ///< forecast at the end: images until sigma_Z is 5 % of Z
  double time_to_5pct_s = kUnknown;  ///< when it first was, from the first frame [s]
  std::size_t measured_frames = 0, hidden_frames = 0;
  std::size_t rejected_frames = 0;  ///< measured, and contradicting the prediction
  double unexcited_s = 0;           ///< time in which the camera's motion told nothing of it
  std::string unexcited_because;    ///< of the last second or more of that; empty: none so long
};

/// The figures of a run or a replay. Whatever the log cannot tell is kUnknown.
struct Metrics {
  double duration_s = 0;  ///< from the first frame to the last
  std::size_t frames = 0;
  double min_frame_rate = kUnknown;  ///< one over the longest time between frames [Hz]
  double final_error_px = kUnknown;  ///< `meanImageError` of the last second
  double max_gap_s = 0;             ///< longest time a point, once seen, went without a measurement
  double min_border_px = kUnknown;  ///< least distance of a dot's centre to the border; < 0 outside
  bool all_in_image = false;        ///< every dot was known to be in the image in every frame
  double final_depth_error_max = kUnknown;  ///< greatest relative_error of the points [-]
  /// Share of the estimates (converging or valid, truth known) whose inverse depth is within 2
  /// sigma of the true one [-]; 0.954 for an honest sigma and Gaussian errors.
  double coverage_2sigma = kUnknown;
  std::size_t rejected_measurements = 0;  ///< of all points
  std::size_t rejected_points = 0;        ///< last known as rejected or lost: not to be relied on
  std::vector<PointMetrics> points;       ///< by ascending id
};

Metrics computeMetrics(const RunLog& log);

/// One JSON object: command, name, seed, outcome (of a run only), reason, metrics, diagnosis, joint
/// (of the joint filter only), points. The keys of the figures are the names of the members above;
/// unknown and infinite figures are null.
std::string toJson(const RunLog& log);

}  // namespace depthservo
