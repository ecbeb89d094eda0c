#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/target/DotTarget.h"

namespace depthservo {

/// A number by calibration.
struct Calibrated {
  std::string name;  ///< as the key of the profile; "gyro_bias[1]"
  std::string unit;
  double value = 0, sigma = 0;
  bool isShown = false;  ///< by the motion of the recording; else value and sigma are the prior's
  std::string missing;   ///< what to drive instead, where it is not shown
};

/// What a recording says of its robot's errors.
struct Calibration {
  std::vector<Calibrated> constants;  ///< latency, gyro_bias[0..2], mount[0..2], focal, scale
  std::vector<Calibrated> noises;     ///< pixel_noise, wander, slip, gyro_noise, ...
  ErrorProfile profile;               ///< to observe depth with
  double pixelNoise_px = 0;           ///< white, 1 sigma per axis
  std::size_t images = 0, points = 0;
  int innovations = 0;
  double nis = kUnknown;  ///< of the latest innovations; 2 when the model is right

  bool showsAnything() const;
};

struct CalibrationOptions {
  ErrorProfile prior = ErrorProfile::typical();
  DepthPrior depth{3};
  DepthRange range;
  std::size_t points = 10;  ///< those seen longest, at most
  /// A depth that was measured [m]: of this point at the end of the recording.
  std::optional<std::pair<int, double>> distance;
  /// Else, what tells the scale: a target of known shape, whose points have the ids 0, 1, ... Fewer
  /// than four: none.
  DotTarget target;
};

/// The profile to start from: that of these options. Where they reckon with white noise alone it is
/// `typical`, to which they are set.
ErrorProfile priorOf(ObservationOptions& options);

/// Maximum likelihood of the innovations of SharedErrorFilter over the whole recording. The
/// constants are states of the filter, which starts anew from what it has learnt until it no longer
/// moves: a Gauss-Newton iteration of the whole batch, by recursion. The noise levels minimise
/// SharedErrorFilter::cost, each along a parabola through three runs of the filter in the logarithm
/// of the level, its curvature giving sigma. Outliers count as in the filter.
/// \param log of a recording, any estimator \throw InputError there is no point or no odometry, or
/// the distance is of a point that was not seen
Calibration calibrate(const RunLog& log, const CalibrationOptions& options = {});

/// The file that `--errors` reads.
std::string profileYaml(const Calibration& calibration);

}  // namespace depthservo
