#pragma once

#include <visp3/core/vpImage.h>

#include <optional>

#include "depthservo/camera/Ellipse.h"
#include "depthservo/visp/visp.h"

namespace depthservo::detail {

/// Pixels of the image, all four sides inclusive.
struct Box {
  int left = 0, top = 0, right = -1, bottom = -1;
  int width() const { return right - left + 1; }
  int height() const { return bottom - top + 1; }
};

/// A dot measured to a small fraction of a pixel.
struct DotMeasurement {
  Ellipse ellipse;
  double background = 0;  ///< gray level around the dot
  double contrast = 0;    ///< gray level of the dot minus `background`
  double sigma_px = 0;    ///< of the centre, per axis [px]
};

/// Measures the dot whose core fills `core` roughly, by gray-weighted moments.
///
/// With the background as a plane b(u, v), fitted around the dot, and the dot's level as that of
/// its core, each pixel weighs w = (I - b)/contrast within a mask two pixels wider than the dot:
/// centre = mean of (u, v), shape = 4 cov(u, v) - 1/3 (the pixel's own extent). sigma_px is the
/// noise of the pixels around the dot, carried through the sums and the fit, plus a floor for what
/// the model leaves out.
///
/// Nothing is returned for what is not a whole dot: no contrast, cut by the border of the image,
/// not filling its ellipse, or with an outline that is not symmetric about its centre (a part is
/// hidden).
std::optional<DotMeasurement> measureDot(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         const Box& core);

/// The core of a dot that has looked like `last` and is now near `position`: where the pixels of
/// its level are. Good for displacements up to half of its radius; whether it is a dot,
/// `measureDot` tells.
std::optional<Box> coreNear(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                            const DotMeasurement& last, const Eigen::Vector2d& position);

}  // namespace depthservo::detail
