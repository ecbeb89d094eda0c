#pragma once

#include <memory>
#include <string>

#include "depthservo/api.h"
#include "depthservo/target/AprilTagTarget.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

struct AprilTagTrackerOptions {
  /// Corrected bits that are accepted, 0..2. Each costs memory and lets more false tags through;
  /// 16h5 should have 0.
  int hamming = 1;
  /// Least mean contrast between the bits and their threshold [gray levels]; false tags have
  /// little.
  double decision_margin = 20;
  /// Images are searched for tags at 1/decimate of their size: faster, but small tags (below about
  /// 12 x decimate px) are missed. Corners are measured at full size all the same. 1..8
  double decimate = 1;
};

/// The corners of AprilTags as points, found anew in every image by libapriltag.
///
/// The corners are refined: along each side of the tag, where the gray level is half way between
/// ink and paper (by the area under the edge profile, hence free of bias by blur); lines through
/// these points; their intersections. They are given with (0, 0) the centre of the first pixel.
///
/// sigma_px: the scatter of the points about the lines carried through to their intersection, and a
/// floor of 0.005 px, more for tags with cells below 3 px, for what discretisation leaves. Rendered
/// tags with 3 gray levels of noise: 0.01 px rms per axis for a side of 190 px, 0.03 px for 30 px.
///
/// A tag seen twice in one image (two prints of the same id) is not given at all: which is which
/// cannot be told. No display is needed and nothing is printed. `track` allocates.
class DEPTHSERVO_API AprilTagTracker : public PointTracker {
 public:
  /// All tags of a family. Corner j of tag n has the id 4 n + j, corners as in AprilTagTarget.
  /// \throws std::invalid_argument no such family, or an option out of range
  explicit AprilTagTracker(const std::string& family, const AprilTagTrackerOptions& options = {});

  /// The tags of an object only, ids as in AprilTagTarget; sizes and poses play no part.
  /// \throws std::invalid_argument no such family, a tag that it does not have, or has twice, or
  /// none
  explicit AprilTagTracker(const AprilTagTarget& target,
                           const AprilTagTrackerOptions& options = {});

  AprilTagTracker(AprilTagTracker&&) noexcept;
  AprilTagTracker& operator=(AprilTagTracker&&) noexcept;
  ~AprilTagTracker() override;

  const std::vector<TrackedPoint>& track(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         const std::vector<ExpectedPoint>& expected) override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace depthservo
