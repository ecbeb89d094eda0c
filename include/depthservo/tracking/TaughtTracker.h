#pragma once

#include <memory>
#include <string>

#include "depthservo/api.h"
#include "depthservo/target/TaughtImage.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

struct TaughtTrackerOptions {
  int features = 1500;      ///< of each image that are compared, 100..5000
  double ratio = 0.8;       ///< greatest distance of a match, as a share of the second best, 0..1
  int least_matches = 15;   ///< that agree on one motion of the camera, >= 8
  double similarity = 0.7;  ///< least correlation of a point with what was shown, 0..1
};

/// Finds the points of a taught image again, from other places.
///
/// The first search, and any after most points are lost, matches ORB features (Rublee et al., 2011)
/// of both images. Those that agree with the homographies of a few planes, or with one epipolar
/// geometry where there are none, tell where each point should be and how its surroundings are
/// zoomed, turned and tilted. From image to image pyramidal Lucas-Kanade follows the points. Either
/// way a point is measured by aligning the taught image itself, warped as its neighbours say: there
/// is no drift, and at the goal it stands where it stood.
///
/// A point that is not seen, since it is outside of the image, covered, or does not look as it
/// should, is given by the place that its neighbours tell, with a sigma_px of 3 px, while half of
/// the points are seen and nothing else is expected. Else sigma_px is that of the alignment, at
/// least 0.05 px.
///
/// No display is needed and nothing is printed. `track` allocates; a search takes some 20 ms for
/// 640 x 480.
class DEPTHSERVO_API TaughtTracker : public PointTracker {
 public:
  /// \throws std::invalid_argument fewer than 4 points, one outside of the image, an option out of
  /// range
  explicit TaughtTracker(const TaughtImage& taught, const TaughtTrackerOptions& options = {});
  TaughtTracker(TaughtTracker&&) noexcept;
  TaughtTracker& operator=(TaughtTracker&&) noexcept;
  ~TaughtTracker() override;

  const std::vector<TrackedPoint>& track(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         const std::vector<ExpectedPoint>& expected) override;
  std::string news() override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace depthservo
