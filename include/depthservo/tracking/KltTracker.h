#pragma once

#include <memory>

#include "depthservo/api.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

struct KltTrackerOptions {
  int points = 300;               ///< as many as are followed at once, 1..2000
  double least_distance_px = 12;  ///< between points when they are chosen, >= 3
  double quality = 0.01;          ///< of the weakest corner against the strongest, 0..1 exclusive
  int window_px = 21;             ///< of the search from image to image, odd, 5..61
  int levels = 3;                 ///< of the pyramid above the image, 0..6
  double forward_backward_px = 0.7;  ///< greatest error of the way there and back [px], > 0
  double similarity = 0.8;           ///< least correlation with what the point looked like, 0..1
  int patience = 10;                 ///< images without a point before it is given up, >= 0
};

/// Natural corners: chosen where both eigenvalues of the gray gradient are large (Shi and Tomasi,
/// 1994), followed from image to image by OpenCV's pyramidal Lucas-Kanade, forward and backward,
/// then aligned with what they looked like when they were first seen: they do not drift, and gain
/// and offset of the light do not matter. When a point has come to look different (it is nearer, or
/// turned), a new look is kept and its error added to sigma_px.
///
/// A point that looks different from one image to the next is followed by what it looked like in
/// the last one, its error added likewise.
///
/// An id is given to one corner only. A corner that is not found for `patience` images is retired.
/// While a fifth of the points are missing, each image is searched for new corners, with new ids,
/// in one quarter of its height, far from the points in view. The noise of an image, estimated from
/// its Laplacian, is no corner, nor is anything in saturated areas: a flat image shows none.
///
/// sigma_px: what is left of the difference to the look, through the least squares of the
/// alignment, where what exceeds the noise is shared by 3 x 3 pixels; at least 0.015 px. Which
/// points move by themselves the tracker cannot know: the estimators' gates find them (`giveUp`).
///
/// No display is needed and nothing is printed. `track` allocates.
class DEPTHSERVO_API KltTracker : public PointTracker {
 public:
  /// \throws std::invalid_argument an option out of range
  explicit KltTracker(const KltTrackerOptions& options = {});
  KltTracker(KltTracker&&) noexcept;
  KltTracker& operator=(KltTracker&&) noexcept;
  ~KltTracker() override;

  const std::vector<TrackedPoint>& track(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         const std::vector<ExpectedPoint>& expected) override;
  const std::vector<int>& retired() const override;
  void giveUp(int id) override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace depthservo
