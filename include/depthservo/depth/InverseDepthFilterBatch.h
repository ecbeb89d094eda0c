#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/InverseDepthFilter.h"

namespace depthservo {

/// InverseDepthFilter for many points at once: the same steps, options and results (up to rounding:
/// fused multiply-add) on a structure of arrays, in vectors of two doubles, or of four where the
/// processor has AVX2. Points
/// that need more than the plain step (starting, gated, hidden, lost) take the scalar one, and all
/// do when uncertainties are considered (odometryScaleSigma, focalSigma).
///
/// Contract as for DepthEstimator: nothing allocates after construction, any input is allowed.
class DEPTHSERVO_API InverseDepthFilterBatch {
 public:
  using Options = InverseDepthFilterOptions;

  /// Vector instructions; all give the same results up to rounding.
  enum class Instructions { portable, avx2 };
  static Instructions best();  ///< of this processor
  static bool isSupported(Instructions instructions);

  /// \param size number of points, all unset
  explicit InverseDepthFilterBatch(std::size_t size, const Options& options = {},
                                   const DepthRange& range = {},
                                   Instructions instructions = best());

  InverseDepthFilterBatch(const InverseDepthFilterBatch&) = default;  // no move: nothing is left without its memory
  InverseDepthFilterBatch& operator=(const InverseDepthFilterBatch&) = default;

  std::size_t size() const { return size_; }

  /// As of DepthEstimator, for point i < size().
  void reset(std::size_t i, const PointMeasurement& measurement, const DepthPrior& prior);
  void correctDepth(std::size_t i, const DepthPrior& measured);
  DepthEstimate estimate(std::size_t i) const;

  /// All points follow the camera's motion.
  void predict(const Motion& motion);

  /// Measured coordinates and standard deviations (normalised), size() of each. Where x is NaN the
  /// point is hidden.
  void correct(const double* x, const double* y, const double* sigma);

  /// Eight points, laid out for vector instructions.
  struct Block;

 private:
  detail::FilterPoint load(std::size_t i) const;
  void store(std::size_t i, const detail::FilterPoint& point);
  void correctOne(std::size_t i, const PointMeasurement& measurement);

  std::size_t size_;
  Options options_;
  DepthRange range_;
  Instructions instructions_;
  OdometryNoise::Step step_;  // of the last motion
  double dt_ = 0;             // of the last motion [s]
  std::vector<Block> blocks_;
};

/// One value of each of eight points a row. A block is `plain` while the vector code may step it:
/// every point is being followed, none is young or has just been rejected.
struct alignas(64) InverseDepthFilterBatch::Block {
  static constexpr std::size_t kPoints = 8;

  double x[kPoints], y[kPoints], chi[kPoints];
  double xx[kPoints], xy[kPoints], xc[kPoints], yy[kPoints], yc[kPoints], cc[kPoints];
  double noise_t[kPoints], noise_xy[kPoints], bias[kPoints], levelSum[kPoints],
      levelWeight[kPoints];
  double parallax2[kPoints], r[kPoints];
  double scale[3][kPoints], focal[3][kPoints];
  int rejections[kPoints];
  unsigned char accepted[kPoints];
  detail::FilterPoint::Phase phase[kPoints];
  bool isPlain;
};

}  // namespace depthservo
