#pragma once

#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/target/DotTarget.h"
#include "tracking/DotMeasurement.h"

namespace depthservo::detail {

enum class Side { darker, lighter };

/// What a dot may look like.
struct DotLimits {
  bool dark = true, light = true;                    ///< polarities that are looked for
  double least_radius_px = 1, most_radius_px = 150;  ///< semi-axes
};

/// The pixels within `reach` of a point, cut at the border of the image.
Box boxAround(const Eigen::Vector2d& centre, double reach,
              const DEPTHSERVO_VISP vpImage<unsigned char>& image);

/// Whether two measurements are of one dot in the image: their centres lie well within both.
bool isSame(const DotMeasurement& a, const DotMeasurement& b);

/// The dots whose connected pixels are on one side of a gray level and whole within the region. The
/// order is that of the image rows.
std::vector<DotMeasurement> dotsAtLevel(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                        const Box& region, double level, Side side,
                                        const DotLimits& limits);

/// The same at several levels between the darkest and the lightest of the region, each dot once.
DEPTHSERVO_INNER std::vector<DotMeasurement> dotsAtAnyLevel(
    const DEPTHSERVO_VISP vpImage<unsigned char>& image, const Box& region,
    const DotLimits& limits);

/// How far a point is outside of an ellipse, on the way to its centre [px]; 0 inside.
double distanceTo(const Ellipse& ellipse, const Eigen::Vector2d& point);

/// Whether a blob like the dot (as light or dark, of a size that the limits allow, whole or not,
/// measurable or not), which is neither the dot nor one of those that are known, has a pixel within
/// `reach` [px] of the position.
bool isAnotherWithin(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                     const Eigen::Vector2d& position, double reach, const DotMeasurement& dot,
                     const std::vector<std::optional<DotMeasurement>>& known,
                     const DotLimits& limits);

/// Which of the dots found is which point of the plate, seen from its front: for each point, the
/// index of its dot.
///
/// Every assignment of four points gives a homography; it is judged by what it says of the size and
/// shape of every dot (root mean square of the log eigenvalue ratios, expected to measured) and by
/// whether the other points have a dot. Among equally good ones (a square plate may be turned by
/// quarters) the most upright is taken: the plate's x to the right in the image. No camera
/// parameters are needed. Empty when nothing fits.
std::optional<std::vector<std::size_t>> assignDots(const DotTarget& target,
                                                   const std::vector<DotMeasurement>& dots);

/// Whether four of the points determine a homography: no three of them on a line.
bool hasFourInGeneralPosition(const DotTarget& target);

}  // namespace depthservo::detail
