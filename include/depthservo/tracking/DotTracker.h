#pragma once

#include <memory>
#include <optional>

#include "depthservo/api.h"
#include "depthservo/camera/Ellipse.h"
#include "depthservo/target/DotTarget.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

enum class DotPolarity { automatic, darkOnLight, lightOnDark };

struct DotTrackerOptions {
  /// automatic: as first seen, then it may not change
  DotPolarity polarity = DotPolarity::automatic;
  double least_radius_px = 1;   ///< smallest semi-axis of a dot [px], > 0
  double most_radius_px = 150;  ///< largest, <= 200; a blob beyond is background
  double start_radius_px = 20;  ///< how far a start position may be off the outline of its dot
};

/// Tracks round dots.
///
/// A gray-weighted centroid measures a dot about ten times more accurately than vpDot2: 0.004 px
/// rms per axis at a radius of 14 px, 0.007 px in gray noise of 3 levels. It starts from where the
/// dot's pixels have gone; after a larger step vpDot2 finds the dot; after a loss connected pixels
/// do. What is measured is the centre of the dot's ellipse, not the projection of the disc's
/// centre.
///
/// A dot is given only if it is whole (not cut by the border of the image nor partly hidden), of
/// the same polarity as ever, and of a size and shape that continues what was seen before. A dot is
/// looked for where it is expected, else where it was last seen, up to 1.5 diameters away; the
/// region grows with the expectation's sigma_px. It is refused when another dot's place is closer,
/// and when a blob that is not measurable (partly hidden, or two that touch) lies closer to its
/// own: an id never passes to another dot, and a hidden dot is simply absent from the list until it
/// returns near to where it is expected. Dots whose images overlap are hidden while they do. The
/// light may change by a factor of 2 between images; after a greater change dots are found again
/// within a few images. An image of another size than the first shows no dots.
///
/// sigma_px: the noise of the pixels around the dot carried through the centroid's sums, and a
/// floor of 0.003 px + 0.03 px^2 / semi-minor axis for what discretisation leaves.
///
/// No display is needed and nothing is printed. `track` allocates (vpDot2 does).
class DEPTHSERVO_API DotTracker : public PointTracker {
 public:
  /// Dots by start position (u, v) in the first image [px]; the index is the id. A dot that is not
  /// there in the first image is looked for at its start position in the following ones. It starts
  /// on the nearest blob, or not at all: when that one is not measurable, it is waited for.
  ///
  /// \throws std::invalid_argument no position, one that is not finite, or an option out of range
  explicit DotTracker(const std::vector<Eigen::Vector2d>& starts,
                      const DotTrackerOptions& options = {});

  /// The dots of a plate, found and ordered in the first image that shows all of them, other blobs
  /// or not. The plate is seen from its front. Where its pattern looks the same turned (a square:
  /// by quarters) the most upright reading is taken, x to the right. With a radius of 0 the dots'
  /// shapes alone decide. While a dot has a double of its size within 1.5 diameters the plate is
  /// waited for.
  ///
  /// \throws std::invalid_argument no four points without three on a line, a point off the plane
  /// z = 0, a negative radius, dots that overlap, or an option out of range
  explicit DotTracker(const DotTarget& target, const DotTrackerOptions& options = {});

  DotTracker(DotTracker&&) noexcept;
  DotTracker& operator=(DotTracker&&) noexcept;
  ~DotTracker() override;

  const std::vector<TrackedPoint>& track(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         const std::vector<ExpectedPoint>& expected) override;

  /// The outline of a dot in the last image; empty when it is not seen.
  std::optional<Ellipse> ellipse(int id) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace depthservo
