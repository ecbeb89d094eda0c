#pragma once

#include <cmath>
#include <iosfwd>

#include "depthservo/api.h"
#include "depthservo/motion/Flow.h"

namespace depthservo {

/// One image point.
struct PointMeasurement {
  double x = 0, y = 0;  ///< normalised image coordinates [-]
  double sigma = 0;     ///< standard deviation per axis, normalised: pixels / focal length [-]

  static constexpr double kLargest = 1e3;       // 89.9 degrees off the axis: no camera sees it
  static constexpr double kLargestSigma = 1e3;  // more tells nothing

  /// Finite and not above the largest, with sigma >= 0.
  bool isUsable() const {
    return std::abs(x) <= kLargest && std::abs(y) <= kLargest && sigma >= 0 &&
           sigma <= kLargestSigma;
  }
};

/// What an estimate is worth, worst first where several hold:
/// lost > coasting > rejected > unexcited > converging > valid.
enum class DepthStatus {
  unset,       ///< never measured
  converging,  ///< being learnt; sigma_Z is not below 10 % of Z yet
  valid,       ///< sigma_Z below 10 % of Z
  unexcited,   ///< the camera's motion carries no information on this depth; Z and sigma are kept
  coasting,    ///< not measured at present (hidden); predicted from the camera's motion. Or the
               ///< motion is not known at present: nothing is learnt, and sigma grows
  rejected,    ///< the last measurement contradicted the prediction and was not used
  lost,        ///< behind the camera, or predicted too vaguely to be of use
};
DEPTHSERVO_API const char* toString(DepthStatus status);
DEPTHSERVO_API std::ostream& operator<<(std::ostream& out, DepthStatus status);

/// The status of an estimate while the camera's motion is not known.
inline DepthStatus whileMotionIsUnknown(DepthStatus status) {
  return status == DepthStatus::unset || status == DepthStatus::lost ? status
                                                                     : DepthStatus::coasting;
}

/// Relative sigma of a depth below which it is called valid.
constexpr double kValidRelativeSigma = 0.1;

/// Depths that may be reported [m]. Estimates are clipped to it.
struct DepthRange {
  double Z_min = 0.05;  ///< > 0; a closer target counts as a collision
  double Z_max = 100;

  /// Into [1/Z_max, 1/Z_min]; chi <= 0 and NaN are Z_max.
  double clampChi(double chi) const {
    if (!(chi * Z_max > 1)) return 1 / Z_max;
    return chi * Z_min < 1 ? chi : 1 / Z_min;
  }

  /// Whether a depth is accurate and not merely held at an end of the range.
  bool isFound(double chi, double sigma_chi) const {
    const bool isHeld = !(chi > 1 / Z_max) || chi >= 1 / Z_min;
    return !isHeld && sigma_chi < kValidRelativeSigma * chi;
  }
};

/// What is known of a depth before the first image. The default sigma is wide enough (1/0.2 m) that
/// the guess has no lasting influence; a narrower one is for measurements, not for good guesses.
struct DEPTHSERVO_API DepthPrior {
  static constexpr double kWideSigma_chi = 5.0;     // 1/m
  static constexpr double kLargestSigma_chi = 1e4;  // 1/m; anything above is treated as this

  double Z = 1;                       ///< guess [m]; anything unusable is replaced by 1 m
  double sigma_chi = kWideSigma_chi;  ///< of the inverse depth [1/m]

  bool isUsable() const;  ///< Z finite and > 0, sigma_chi finite and >= 0

  /// The same guess made usable: Z finite and within `range`, sigma_chi finite and > 0.
  DepthPrior sanitised(const DepthRange& range) const;
};

/// A point with its depth and what that is worth.
struct DEPTHSERVO_API DepthEstimate {
  double x = 0, y = 0;                            ///< normalised image coordinates [-]
  double chi = 1;                                 ///< inverse depth [1/m], within the DepthRange
  double sigma_chi = DepthPrior::kWideSigma_chi;  ///< 1-sigma of chi [1/m]
  double excitation = 0;  ///< speed of the camera across the line of sight [m/s], what tells depth
  DepthStatus status = DepthStatus::unset;
  double sigma_xy = 0;  ///< 1-sigma of x and of y [-]: how far from (x, y) to look for the point

  double Z() const { return 1 / chi; }                        ///< [m]
  double sigma_Z() const { return sigma_chi / (chi * chi); }  ///< [m], to first order

  struct Interval {
    double low, high;  ///< [m]; high is infinite while the point may be arbitrarily far
  };
  /// The depths within two sigma: [1/(chi + 2 sigma), 1/(chi - 2 sigma)].
  Interval interval() const;

  /// Whether sigma_chi is above half of chi: a robot that trusted Z() might be many times too fast.
  bool isDoubtful() const { return sigma_chi > 0.5 * chi; }

  /// The depth with which a servo is no faster than with the true one: while it is doubtful the
  /// near end of the interval [m]. What a servo does is slow in proportion to the depth it is
  /// given.
  double cautiousZ() const { return isDoubtful() ? interval().low : Z(); }
};

/// Standard deviations of a point and its inverse depth.
struct PointSigmas {
  double xy = 0;   ///< of x and of y [-]
  double chi = 0;  ///< [1/m]
};

/// Those after a part of the motion that is not known. How far the camera may have gone counts as
/// two sigma of any component, and as two sigma nearer for chi:
///     1/(chi + 2 sigma') = 1/(chi + 2 sigma) - distance.
/// sigma_chi grows to DepthPrior::kWideSigma_chi (or chi, if that is more) and no further. The sums
/// of several parts and the whole give the same. \rtsafe
DEPTHSERVO_API PointSigmas widened(const PointSigmas& sigmas, const PointState& point,
                                   const UnknownPart& unknown);

/// The estimate after a motion without a measurement: point and sigma follow the exact flow; where
/// the motion is not known sigma grows and the status is `coasting`.
/// Becomes `lost` (and stays in place) when the point passes behind the camera. \rtsafe
DEPTHSERVO_API DepthEstimate predicted(const DepthEstimate& estimate, const Motion& motion,
                                       const DepthRange& range = {});

}  // namespace depthservo
