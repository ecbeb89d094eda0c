#include <gtest/gtest.h>

#include <Eigen/LU>
#include <opencv2/calib3d.hpp>

#include "depthservo/camera/LensDistortion.h"
#include "depthservo/camera/PinholeCamera.h"

namespace depthservo {
namespace {

struct Lens {
  const char* name;
  PinholeCamera camera;
};
void PrintTo(const Lens& lens, std::ostream* out) { *out << lens.name; }

class OfLens : public testing::TestWithParam<Lens> {
 protected:
  const PinholeCamera& camera_ = GetParam().camera;
  const LensDistortion& lens_ = camera_.distortion;

  /// Calls `use(u, v)` all over the image, its corners included.
  template <class Use>
  void everywhere(const Use& use) const {
    for (int i = 0; i <= 24; ++i) {
      for (int j = 0; j <= 24; ++j) {
        use((camera_.width - 1) * i / 24.0, (camera_.height - 1) * j / 24.0);
      }
    }
  }
};

TEST_P(OfLens, pixels_are_those_of_opencv) {
  const cv::Matx33d K(camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1);
  const std::vector<double> coefficients = {lens_.k1(), lens_.k2(), lens_.p1(), lens_.p2(),
                                            lens_.k3()};
  everywhere([&](double u, double v) {
    const Eigen::Vector2d s = camera_.normalise(u, v);
    std::vector<cv::Point2d> pixel;
    cv::projectPoints(std::vector<cv::Point3d>{{s.x(), s.y(), 1}}, cv::Vec3d(), cv::Vec3d(), K,
                      coefficients, pixel);
    EXPECT_NEAR(pixel[0].x, u, 1e-8);
    EXPECT_NEAR(pixel[0].y, v, 1e-8);
    const Eigen::Vector2d ours = camera_.toPixel(s.x(), s.y());
    EXPECT_NEAR(ours.x(), pixel[0].x, 1e-9);
    EXPECT_NEAR(ours.y(), pixel[0].y, 1e-9);
  });
}

TEST_P(OfLens, undistort_is_the_inverse_in_the_whole_image) {
  everywhere([&](double u, double v) {
    EXPECT_TRUE(camera_.canNormalise(u, v)) << u << ", " << v;
    const Eigen::Vector2d s = camera_.normalise(u, v);
    const Eigen::Vector2d back = lens_.undistort(lens_.distort(s));
    EXPECT_LT((back - s).norm(), 1e-12) << u << ", " << v;
  });
}

TEST_P(OfLens, derivative_is_that_of_finite_differences) {
  everywhere([&](double u, double v) {
    const Eigen::Vector2d s = camera_.normalise(u, v);
    constexpr double kStep = 1e-6;
    Eigen::Matrix2d numeric;
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
      numeric.col(i) = (lens_.distort(s + step) - lens_.distort(s - step)) / (2 * kStep);
    }
    EXPECT_LT((numeric - lens_.J_distorted_ideal(s)).norm(), 1e-8);
    EXPECT_NEAR(camera_.focal_px(s.x(), s.y()),
                camera_.focal_px() * std::sqrt(numeric.determinant()), 1e-5);
  });
}

INSTANTIATE_TEST_SUITE_P(
    , OfLens,
    testing::Values(
        Lens{"tum_fr1",
             {640, 480, 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}}},
        Lens{"tum_fr2",
             {640, 480, 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}}},
        Lens{"euroc",
             {752,
              480,
              458.654,
              457.296,
              367.215,
              248.375,
              {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}}},
        Lens{"pincushion", {640, 480, 500, 500, 320, 240, {0.4, 0.1, 0.002, -0.003}}},
        Lens{"mirrored", {640, 480, 500, -500, 320, 240, {-0.2, 0.05, 0.001, 0.002}}}),
    [](const auto& param) { return std::string(param.param.name); });

TEST(NoLens, leaves_every_bit) {
  const PinholeCamera camera{640, 480, 517.3, 516.5, 318.6, 255.3};
  const Eigen::Vector2d s = camera.normalise(17.3, 401.9);
  EXPECT_EQ(s, Eigen::Vector2d((17.3 - 318.6) / 517.3, (401.9 - 255.3) / 516.5));
  EXPECT_EQ(camera.toPixel(s.x(), s.y()),
            Eigen::Vector2d(517.3 * s.x() + 318.6, 516.5 * s.y() + 255.3));
  EXPECT_EQ(camera.focal_px(0.3, 0.2), camera.focal_px());
  EXPECT_EQ(LensDistortion().J_distorted_ideal({0.3, 0.2}), Eigen::Matrix2d::Identity());
}

/// By the formula, with one coefficient at a time.
TEST(OneCoefficient, makes_a_lens) {
  const double x = 0.3, y = -0.2, r2 = x * x + y * y, c = 0.1;
  const std::vector<std::pair<LensDistortion, Eigen::Vector2d>> moved{
      {{c, 0, 0, 0}, c * r2 * Eigen::Vector2d(x, y)},
      {{0, c, 0, 0}, c * r2 * r2 * Eigen::Vector2d(x, y)},
      {{0, 0, c, 0}, c * Eigen::Vector2d(2 * x * y, r2 + 2 * y * y)},
      {{0, 0, 0, c}, c * Eigen::Vector2d(r2 + 2 * x * x, 2 * x * y)},
      {{0, 0, 0, 0, c}, c * r2 * r2 * r2 * Eigen::Vector2d(x, y)}};
  for (const auto& [lens, by] : moved) {
    EXPECT_FALSE(lens.isNone());
    EXPECT_NEAR((lens.distort({x, y}) - Eigen::Vector2d(x, y) - by).norm(), 0, 1e-16);
  }
}

TEST(FoldingLens, stays_finite_and_monotone_beyond_its_reach) {
  const LensDistortion lens(-0.5, 0, 0, 0);
  EXPECT_NEAR(lens.reach(), std::sqrt(1 / 1.5), 2e-3);
  double last = -1;
  for (double r = 0; r < 50; r += 0.01) {
    const double distorted = lens.distort({r, 0}).x();
    EXPECT_GT(distorted, last) << r;
    last = distorted;
  }
  EXPECT_TRUE(lens.isInvertibleAt({0.4, 0.2}));
  for (const double r : {0.7, 3.0, 1e6}) {
    EXPECT_FALSE(lens.isInvertibleAt({r, 0})) << r;
    EXPECT_TRUE(lens.undistort({r, -r}).allFinite()) << r;
  }
  for (double r = 0.01; r < 3; r += 0.01) {
    const Eigen::Vector2d there(0.8 * r, -0.6 * r), ideal = lens.undistort(there);
    if (lens.isInvertibleAt(there)) {
      EXPECT_NEAR((lens.distort(ideal) - there).norm(), 0, 1e-9) << r;
    } else {
      EXPECT_EQ(ideal, there) << r;
    }
    EXPECT_EQ(lens.isInvertibleAt(there), r < lens.distort({lens.reach(), 0}).x()) << r;
  }
  EXPECT_TRUE(LensDistortion(-1e9, 1e9, 5, 5, -1e9).undistort({0.3, 0.3}).allFinite());
}

}  // namespace
}  // namespace depthservo
