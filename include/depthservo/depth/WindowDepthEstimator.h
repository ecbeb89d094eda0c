#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/WindowFit.h"

namespace depthservo {

enum class WindowMethod {
  leastSquares,       ///< as published; fastest
  maximumLikelihood,  ///< half the error of it
  robust,             ///< maximum likelihood that withstands outliers
};

/// Which images are kept, how they are fitted, and when the result is believed.
struct WindowOptions {
  std::size_t images = 20;  ///< greatest number of earlier images kept beside the newest, >= 1
  /// Least time between two kept images [s]; images in between are used while they are the newest.
  /// A longer baseline tells more than more images do: at 30 Hz, 0.1 s is better than the default.
  double spacing_s = 0;
  WindowMethod method = WindowMethod::maximumLikelihood;

  /// A fit is taken when sigma_chi is at most this fraction of chi (and see below).
  double relativeSigma = 0.2;

  /// As for NonlinearObserverOptions.
  double gate_sigma = 6;
  double gate = 0.02;
  int rejectionsInARow = 5;
  double lost_sigma = 0.1;
};

/// Depth from the last images of a point and the camera poses between them (Durand Petiteville,
/// Courdesses, Cadenat 2010, and maximum likelihood instead of its least squares, see WindowFit.h).
/// Needs no guess: with perfect data it is exact as soon as the camera has moved.
///
///   predict   the motion since the newest image grows; the point follows its exact flow, in one
///             step from the newest image, with its covariance
///   correct   the newest image joins the window and the point is fitted anew
///
/// A hidden point adds no image and removes none: after an occlusion the images from before it
/// still count. An image without translation since the newest replaces it, so that a camera at rest
/// keeps its baseline.
///
/// A fit is taken when it is determined (WindowDegeneracy) and precise (`relativeSigma`), and at
/// most twice as vague as the sharpest so far, unless it contradicts what is held by four sigma.
/// Precision is judged with the chi held; before the first fit with the fitted one less two sigma,
/// since fits that seem precise are biased to the near side. Otherwise the last one taken is kept
/// and propagated, status `unexcited`; before the first that is the prior, `unexcited` or
/// `converging`. Measurements that contradict a prediction are rejected; after `rejectionsInARow`
/// the window starts anew there, for then the odometry has jumped.
///
/// A motion that is not known cuts the window off: no image from before it is of use, and the depth
/// held is kept as a measurement with the sigma that `widened` gives it.
///
/// sigma_chi covers the image noise. When the images fit worse than five sigma of the chi-square
/// allow, it is enlarged accordingly (not with least squares, which has no such cost). It has no
/// share for odometry errors, which scale Z: a translation 2 % too long gives Z 2 % too large.
///
/// A prior narrower than DepthPrior::kWideSigma_chi, and a depth given to `correctDepth`, are
/// measurements: they are fitted together with the images as long as theirs is in the window.
class DEPTHSERVO_API WindowDepthEstimator : public DepthEstimator {
 public:
  using Options = WindowOptions;

  explicit WindowDepthEstimator(const Options& options = {}, const DepthRange& range = {});

  WindowDepthEstimator(const WindowDepthEstimator&) = default;  // no move: nothing is left without its memory
  WindowDepthEstimator& operator=(const WindowDepthEstimator&) = default;
  std::unique_ptr<DepthEstimator> clone() const override;
  void reset(const PointMeasurement& measurement, const DepthPrior& prior) override;
  void predict(const Motion& motion) override;
  void correct(const PointMeasurement& measurement) override;
  void correctDepth(const DepthPrior& measured) override;
  DepthEstimate estimate() const override { return estimate_; }

  /// The last fit, taken or not, in the frame of the newest image.
  const WindowFit& fit() const { return fit_; }

  /// Earlier images in the window.
  std::size_t size() const { return size_; }

 private:
  /// The point with its covariance, in the frame of the newest image.
  struct Held {
    PointState point;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  struct Prediction {
    Held held;
    bool ahead = false;
  };
  Prediction predictedNow() const;
  bool isPlausible(const Prediction& prediction, const PointMeasurement& measurement) const;
  bool isWorthTaking(const WindowFit& fit) const;
  void takeImage(const PointMeasurement& measurement);
  void fitWindow();
  void publish(const Held& now);
  void letDrift(const UnknownPart& unknown);
  DepthStatus measuredStatus() const;

  Options options_;
  DepthRange range_;

  std::vector<WindowImage> earlier_;  // [0, size_) in use, overwritten in turn
  std::size_t size_ = 0, oldest_ = 0;
  WindowImage newest_;
  double sinceLastKept_s_ = 0;  // from the last earlier image to the newest

  WindowFit fit_;
  Held held_;
  double sharpest_ = 0;        // least sigma_chi of a fit so far, propagated like held_
  double vaguest_ = 0;         // sigma_chi of a point that is seen but not known [1/m]
  bool isLearnt_ = false;      // held_ comes from a fit
  bool isTaken_ = false;       // from the last one
  Motion sinceNewest_;         // of the camera, since the newest image
  DepthEstimate estimate_;     // now
  int rejections_ = 0;         // in a row
  bool isMotionKnown_ = true;  // of the last motion
};

}  // namespace depthservo
