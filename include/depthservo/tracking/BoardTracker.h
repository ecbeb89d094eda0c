#pragma once

#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/target/BoardTarget.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

/// The inner corners of a chessboard or of a ChArUco board as points, found anew in every image by
/// OpenCV; ids as in BoardTarget.
///
/// Of a chessboard all corners are found or none. Where its colours do not tell it from itself
/// turned (see BoardTarget), it is first seen upright, corner 0 nearest to the upper left of the
/// image, and afterwards as it is expected; then it must not turn unseen. Of a ChArUco board those
/// corners are found of which both neighbouring markers are seen.
///
/// Corners are refined: that point from which, in a window of a quarter of a square, or up to the
/// markers (3 to 11 px), all gradients look across (Foerstner). sigma_px: the noise of the image,
/// as the black squares show it, carried through, and a floor of 0.02 px, more in windows below 6.5
/// px, for what discretisation leaves. Rendered boards with 2 gray levels of noise: 0.02 px rms per
/// axis for squares of 60 px, 0.03 px for 20 px; of ChArUco boards 0.02 px and 0.08 px.
///
/// No display is needed and nothing is printed. `track` allocates.
class DEPTHSERVO_API BoardTracker : public PointTracker {
 public:
  /// \throws std::invalid_argument columns or rows out of range, a marker that does not fit into a
  /// square, no such dictionary, or too few markers in it
  explicit BoardTracker(const BoardTarget& board);

  BoardTracker(BoardTracker&&) noexcept;
  BoardTracker& operator=(BoardTracker&&) noexcept;
  ~BoardTracker() override;

  const std::vector<TrackedPoint>& track(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         const std::vector<ExpectedPoint>& expected) override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace depthservo
