#pragma once

#include <visp3/core/vpImage.h>

#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// A point found in an image.
struct TrackedPoint {
  int id = 0;
  double u = 0, v = 0;  ///< [px], (0, 0) is the centre of the first pixel
  double sigma_px = 0;  ///< standard deviation per axis [px]
};

/// Where a point is expected in the next image.
struct ExpectedPoint {
  int id = 0;
  double u = 0, v = 0;  ///< [px]
  double sigma_px = 0;  ///< standard deviation per axis of the expectation [px]
};

/// Finds the same points in image after image. Points have an id that never changes hands.
class DEPTHSERVO_API PointTracker {
 public:
  virtual ~PointTracker() = default;

  /// The points found in this image, in order of id; the others are lost or hidden at present.
  /// Never throws. \param expected where the estimator predicts the points; may be empty or name
  /// only some
  virtual const std::vector<TrackedPoint>& track(
      const DEPTHSERVO_VISP vpImage<unsigned char>& image,
      const std::vector<ExpectedPoint>& expected) = 0;

  /// Ids that will never be given again, as of the last image; each is told once.
  virtual const std::vector<int>& retired() const {
    static const std::vector<int> none;
    return none;
  }

  /// What is to be told of the last image, a sentence; mostly empty.
  virtual std::string news() { return ""; }

  /// Asks for a point to be retired, since it does not stand still. Trackers of named points ignore
  /// it.
  virtual void giveUp(int /*id*/) {}
};

}  // namespace depthservo
