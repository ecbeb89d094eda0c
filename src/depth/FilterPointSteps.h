#pragma once

#include <limits>

#include "depth/FilterKernel.h"
#include "depthservo/depth/InverseDepthFilter.h"

/// The steps of InverseDepthFilter on one point. The batch takes them for the points that need more
/// than the kernel.
namespace depthservo::detail {

/// A point with fewer accepted measurements than this starts anew on its second rejection in a row:
/// it is likely that the first measurement was the wrong one.
constexpr int kYoung = 5;

/// Variance of a measurement: no camera is better than 1e-7 (6e-5 px at 600 px).
double measurementVariance(double sigma);

/// Covariances (and squares of states) beyond this are not numbers to work with.
constexpr double kLargestVariance = 1e30;

/// States beyond this are not numbers to work with.
constexpr double kLargestState = 1e6;

DEPTHSERVO_INLINE FilterState<double> stateOf(const FilterPoint& p) {
  return {p.x,  p.y,  p.chi, p.xx, p.xy,
          p.xc, p.yy, p.yc,  p.cc, {p.noise_t, p.noise_xy, p.bias, p.levelSum, p.levelWeight}};
}

DEPTHSERVO_INLINE void setState(FilterPoint& p, const FilterState<double>& s) {
  p.x = s.x;
  p.y = s.y;
  p.chi = s.c;
  p.xx = s.xx;
  p.xy = s.xy;
  p.xc = s.xc;
  p.yy = s.yy;
  p.yc = s.yc;
  p.cc = s.cc;
  p.noise_t = s.bias.variance_t;
  p.noise_xy = s.bias.variance_xy;
  p.bias = s.bias.mean;
  p.levelSum = s.bias.levelSum;
  p.levelWeight = s.bias.levelWeight;
}

/// Of (x, y, chi).
inline Eigen::Matrix3d covariance(const FilterPoint& p) {
  Eigen::Matrix3d P;
  P << p.xx, p.xy, p.xc, p.xy, p.yy, p.yc, p.xc, p.yc, p.cc;
  return P;
}

inline void setCovariance(FilterPoint& p, const Eigen::Matrix3d& P) {
  p.xx = P(0, 0);
  p.xy = P(1, 0);
  p.xc = P(2, 0);
  p.yy = P(1, 1);
  p.yc = P(2, 1);
  p.cc = P(2, 2);
}

/// Variance of a direct measurement of chi, at least that of 0.1 % of it: a false certainty could
/// not be corrected by any number of images.
double depthVariance(double chi, double sigma_chi);

/// Normalised innovation squared; infinite when [a b; b c], the innovation's covariance, is none.
inline double nisOf(double a, double b, double c, double nu_x, double nu_y) {
  const double det = a * c - b * b;
  return det > 0 ? (c * nu_x * nu_x - 2 * b * nu_x * nu_y + a * nu_y * nu_y) / det
                 : std::numeric_limits<double>::infinity();
}

/// What to do with a measurement.
enum class Verdict { use, reject, restart };

/// Decides by the normalised innovation squared, which is NaN or huge when the numbers have failed,
/// and by the point's recent rejections, which it counts.
Verdict judge(FilterPoint& p, double nis, const InverseDepthFilterOptions& options);

/// Measurement variance with the Huber weight of this NIS.
double weighted(double r, double nis, const InverseDepthFilterOptions& options);

void resetPoint(FilterPoint& p, const PointMeasurement& measurement, const DepthPrior& usablePrior);
/// The depth at hand, at the place of this measurement: the way there is not known.
void rejoinPoint(FilterPoint& p, const PointMeasurement& measurement);
/// What a part of the motion that is not known does to a point.
void letDrift(FilterPoint& p, const UnknownPart& unknown);
void predictPoint(FilterPoint& p, const FilterStep& step, const InverseDepthFilterOptions& options);

/// Symmetric 2x2, and the variance of chi: what errors that are considered elsewhere add.
struct ConsideredVariances {
  double xx = 0, xy = 0, yy = 0, cc = 0;
};

/// What a measurement did to the state.
struct PointCorrection {
  Verdict verdict = Verdict::reject;
  FilterGain<double> gain{};  // where it was used
};

PointCorrection correctPoint(FilterPoint& p, const PointMeasurement& measurement,
                             const InverseDepthFilterOptions& options, const DepthRange& range,
                             const ConsideredVariances& more = {});
void correctPointDepth(FilterPoint& p, const DepthPrior& usable, const DepthRange& range);

/// \param noise, dt of the last motion; dt is 0 when there was none
DepthEstimate describePoint(const FilterPoint& p, const OdometryNoise::Step& noise, double dt,
                            const InverseDepthFilterOptions& options, const DepthRange& range,
                            const ConsideredVariances& more = {});

/// Lengths of rows in loops: whole vectors.
inline int padded(int n) { return (n + 3) / 4 * 4; }

}  // namespace depthservo::detail
