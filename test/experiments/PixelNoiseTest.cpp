#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "depthservo/experiments/PixelNoise.h"

namespace depthservo {
namespace {

/// A point of this noise that drifts, seen in 300 images.
PixelNoise measured(double sigma_u, double sigma_v, double drift_px) {
  PixelNoiseMeter meter;
  std::mt19937 random(5);
  std::normal_distribution<double> noise;
  for (int k = 0; k < 300; ++k) {
    meter.add({{3, 100 + drift_px * k / 299 + sigma_u * noise(random),
                200 + sigma_v * noise(random), 0}});
  }
  return meter.result();
}

TEST(PixelNoiseMeter, finds_the_noise_of_each_axis) {
  const PixelNoise noise = measured(0.2, 0.5, 0);
  ASSERT_EQ(noise.points.size(), 1u);
  EXPECT_EQ(noise.points[0].id, 3);
  EXPECT_EQ(noise.points[0].images, 300u);
  EXPECT_NEAR(noise.points[0].sigma_u, 0.2, 0.03);  // 3 / sqrt(2 * 280)
  EXPECT_NEAR(noise.points[0].sigma_v, 0.5, 0.07);
  EXPECT_NEAR(noise.sigma_px, std::sqrt((0.04 + 0.25) / 2), 0.05);
  EXPECT_TRUE(noise.isWhite);
  EXPECT_FALSE(noise.hasMoved);
}

TEST(PixelNoiseMeter, takes_slow_motion_out_and_says_so) {
  const PixelNoise noise = measured(0.2, 0.2, 8);
  EXPECT_NEAR(noise.sigma_px, 0.2, 0.03);
  EXPECT_TRUE(noise.hasMoved);
  EXPECT_NEAR(noise.moved_px, 8, 0.5);
}

TEST(PixelNoiseMeter, knows_nothing_of_too_few_images) {
  PixelNoiseMeter meter;
  for (std::size_t k = 0; k + 1 < PixelNoiseMeter::kLeast; ++k) meter.add({{0, 1, 1, 0}});
  EXPECT_TRUE(meter.result().points.empty());
}

}  // namespace
}  // namespace depthservo
