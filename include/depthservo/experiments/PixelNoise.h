#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <map>
#include <vector>

#include "depthservo/rig/RecordedRig.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/sequence/VideoSource.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

/// Noise of one point in a still recording.
struct PointNoise {
  int id = 0;
  std::size_t images = 0;           ///< it was measured in
  double sigma_u = 0, sigma_v = 0;  ///< standard deviation [px]
  double moved_px = 0;              ///< slow motion during the recording, which is taken out
  double correlation = 0;           ///< of successive residuals; 0 for white noise
};

/// What a still recording says of the pixel noise.
struct PixelNoise {
  std::vector<PointNoise> points;  ///< with enough images, by id
  double sigma_px = 0;    ///< rms over the points and the axes: what `pixel_noise` asks for
  double worst_px = 0;    ///< of the worst point, rms over its axes
  double moved_px = 0;    ///< greatest slow motion
  bool hasMoved = false;  ///< it is more than the noise explains
  bool isWhite = true;    ///< false: fast motion or flicker is in the figure, it is an upper bound
};

/// Measures the noise of tracked points while camera and scene stand still.
///
/// The images are cut into blocks of 30 (about a second); in each the straight line of least
/// squares is taken out of u and v, so that slow motion does not count, and the squares of what is
/// left are summed and divided by their degrees of freedom: unbiased for white noise. Slow motion
/// is the range of those lines.
class PixelNoiseMeter {
 public:
  /// Where a point was in an image.
  struct Sample {
    std::size_t image;
    Eigen::Vector2d pixel;
  };

  static constexpr std::size_t kBlock = 30;  ///< images
  static constexpr std::size_t kLeast = 15;  ///< images of the last block, else it is left out

  /// The points of the next image.
  void add(const std::vector<TrackedPoint>& points);

  PixelNoise result() const;

 private:
  std::map<int, std::vector<Sample>> points_;
  std::size_t images_ = 0;
};

/// Of a recorded sequence. \param progress called with the fraction done, may be empty
/// \throw InputError as `replay` does, or fewer than `kLeast` images show a point
PixelNoise measurePixelNoise(const Sequence& sequence, TrackerKind tracker,
                             const std::function<void(double)>& progress = {});

/// Of the next images of a source, at most this many. \throw InputError as above
PixelNoise measurePixelNoise(ImageSource& images, std::size_t most, const SequenceTarget& seen,
                             TrackerKind tracker, const std::function<void(double)>& progress = {});

}  // namespace depthservo
