#pragma once

#include <cstdint>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"

namespace depthservo::detail {

/// Equally likely values of a normal distribution, of standard deviation exactly `sigma`, for
/// `addNoise`.
std::vector<float> normalQuantiles(double sigma);

/// Adds white noise to an image, the same for the same seed and frame.
void addNoise(const std::vector<float>& quantiles, std::uint64_t seed, std::uint64_t frame,
              std::vector<float>& light);

/// Relative light by pixel, row-major. \param loss in the farthest corner, 0..1
std::vector<float> vignette(const PinholeCamera& camera, double loss);

}  // namespace depthservo::detail
