#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/MeasurementNoise.h"
#include "depthservo/depth/SharedErrorFilter.h"

namespace depthservo {

/// Learns how large the noise of pixels and of poses is, from how well the points of an image are
/// where those of images before, moved by the camera's motion, say that they should be.
///
/// An image is compared with the one 1, 2, 4, ... 32 images earlier. With z a point's place and f
/// the flow of its place and depth then,
///
///   z - f = L d + noise,
///
/// L the derivative of d(x, y)/dt by the twist, d the difference of the errors of both poses, which
/// is common to all points, and the noise that of both pixels and of the depth, as the estimator
/// claims it: a vague depth leaves what is across the epipolar line, a claim that is wrong shows
/// in d some images later. d is fitted robustly (Huber); its mean square, and that of what is left
/// across the epipolar lines, is averaged for each distance in time (as the variance is unknown,
/// by expectation and maximisation; Dempster, Laird and Rubin 1977). Over a time T they are
///
///   D(T) = 2 (white^2 + lasting^2 (1 - exp(-T/tau))),
///
/// which is fitted with the profile's tau, or 0.5 s. The profile counts like the first few
/// comparisons. Whatever else errs with time (mount, clock, shutter) counts as what lasts.
///
/// At most 64 points of a comparison are used, other ones in each image.
///
/// Real-time: no allocation after construction.
class DEPTHSERVO_API NoiseLearner {
 public:
  /// \param capacity greatest number of points in an image
  /// \param options as of the filter: where it begins, the focal length, the shutter
  /// \param white_px of the pixels, where it begins
  NoiseLearner(std::size_t capacity, const SharedErrorFilterOptions& options, double white_px);

  NoiseLearner(const NoiseLearner&) = default;  // no move: nothing is left without its memory
  NoiseLearner& operator=(const NoiseLearner&) = default;

  /// \param motion since the last image; not usable: everything before is forgotten
  /// \param observations in ascending order of id, others are left out; their sigma is what was
  /// told, times pixelFactor()
  /// \param estimator after its correction by them
  void observe(const Motion& motion, const std::vector<PointObservation>& observations,
               const PointSetEstimator& estimator);

  /// The profile's while nothing has been learnt.
  MeasurementNoise noise() const;
  /// White noise of the pixels against what was told with the measurements of late; 1 while
  /// nothing has been learnt.
  double pixelFactor() const { return factor_; }
  /// Whether enough images have been compared.
  bool isLearnt() const;

 private:
  static constexpr std::size_t kLags = 6, kKept = std::size_t{1} << (kLags - 1);

  struct Seen {
    int id;
    double x, y, chi, variance_chi;  // without what the shutter does
  };
  struct Snapshot {
    Motion since;
    std::vector<Seen> points;
  };
  /// A point in both images.
  struct Pair {
    Eigen::Vector2d nu;
    Eigen::Matrix<double, 2, 6> L;
    Eigen::Vector2d byDepth;  // derivative of the place by the depth then
    double variance_chi;
    double weight;
  };
  /// Mean squares of the differences over a distance in time.
  struct Level {
    double lag_s = 0;
    double position = 0, angle = 0, pixel = 0;  // [m^2, rad^2, normalised^2]
    int images = 0;
  };

  void compare(const Snapshot& then, Level& level);
  void match(const Snapshot& then);
  void renewFactor(double sigma);
  NoiseLevel fitted(double Level::*square, const NoiseLevel& profile) const;

  MeasurementNoise profile_;
  double focal_px_, rowScale_s_, rowOffset_s_;
  std::array<Snapshot, kKept> snapshots_;  // of the latest images, in a ring
  std::size_t latest_ = 0, kept_ = 0;
  std::array<Level, kLags> levels_;
  std::vector<Seen> now_;
  std::vector<std::pair<const Seen*, const Seen*>> both_;  // then and now
  std::vector<Pair> pairs_;
  std::vector<double> sizes_;
  double factor_ = 1;
  unsigned images_ = 0;
};

}  // namespace depthservo
