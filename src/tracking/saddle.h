#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Core>
#include <optional>

#include "depthservo/visp/visp.h"

namespace depthservo::detail {

/// Where two black and two white squares meet.
struct Saddle {
  Eigen::Vector2d position;  // [px]
  double sigma_px;           // per axis
};

/// The point that all gradients within reach look across (Foerstner and Guelch 1987): the least sum
/// of w (g^T (p - q))^2 over pixels p with gradient g. It ignores what light does to both squares.
///
/// \param rough good to half the reach \param reach_px of the window \param grayNoise 1 sigma,
/// white, of a pixel [gray levels]; carried through to the position \return empty: it leaves the
/// image or wanders off, or there are no two edges
std::optional<Saddle> refineSaddle(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                   const Eigen::Vector2d& rough, double reach_px, double grayNoise);

}  // namespace depthservo::detail
