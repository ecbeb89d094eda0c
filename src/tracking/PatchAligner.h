#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace depthservo::detail {

/// What the surroundings of a point look like, apart from gain and offset of the light.
class ReferencePatch {
 public:
  static constexpr int kHalf = 7, kSide = 2 * kHalf + 1;
  /// Distance to the border of the image that it takes [px].
  static constexpr double kMargin_px = kHalf + 2;

  /// Empty near the border and where there is nothing to recognise.
  static std::optional<ReferencePatch> at(const cv::Mat& image, const Eigen::Vector2d& point);

  /// Where the edges of the patch meet: the point that zoom does not seem to move (Foerstner and
  /// Guelch, 1987), relative to the patch's middle [px].
  Eigen::Vector2d corner() const;

  /// Mean square of the gray gradient in the direction in which it is least [gray levels^2/px^2].
  double leastGradient2() const { return leastGradient2_; }

  struct Alignment {
    Eigen::Vector2d point;  // where the patch is [px]
    double similarity;      // zero-mean normalised cross correlation, -1..1
    double sigma_px;        // 1 sigma per axis, from what is left of the difference (see `align`)
    double warp_px;         // how far zoom and roll have moved the patch's border
  };
  /// Finds the patch near `start`: Gauss-Newton on a translation (inverse compositional; Baker and
  /// Matthews, IJCV 56(3), 2004), gain and offset projected out, zoom and roll solved for to first
  /// order beside it: they would pull the translation to where the patch has most contrast. Empty
  /// when it does not converge within `reach_px` or leaves the image.
  ///
  /// sigma_px is that of least squares. What is left of the difference beyond the noise of a pixel
  /// [gray levels] is a look that has changed: neighbours share it, so that it counts like so many
  /// pixels fewer.
  std::optional<Alignment> align(const cv::Mat& image, const Eigen::Vector2d& start,
                                 double reach_px, double noise) const;

 private:
  static constexpr int kSize = kSide * kSide;
  static constexpr int kMotions = 4;  // u, v, zoom, roll
  using Values = Eigen::Matrix<float, kSize, 1>;

  double leastGradient2_ = 0;
  Values gray_;                                       // of mean 0 and norm 1
  Eigen::Matrix<float, kSize, kMotions> derivative_;  // of gray_ by each motion
  Eigen::Matrix4d covariance_;                        // of the motions for unit noise of a value
};

}  // namespace depthservo::detail
