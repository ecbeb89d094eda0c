#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/visp/using.h"
#include "support/Poses.h"

namespace depthservo {
namespace {

using test::poseAt;
using Image = vpImage<unsigned char>;

const PinholeCamera kCamera{640, 480, 600, 590, 319.5, 239.5};

DotTarget oneDot(double radius) { return {{Eigen::Vector3d::Zero()}, radius}; }

std::vector<Eigen::Isometry3d> randomPoses(int n) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < n; ++i) {
    const double z = 0.6 + 0.2 * unit(random);
    poses.push_back(poseAt({0.25 * z * unit(random), 0.2 * z * unit(random), z},
                           {0.6 * unit(random), 0.6 * unit(random), 3 * unit(random)}));
  }
  return poses;
}

struct Outline {
  double area;
  Eigen::Vector2d centroid;
};
/// Polygon through many projected points of the disc's edge.
Outline polygon(const Eigen::Isometry3d& cMo, const Eigen::Vector3d& dot, double radius) {
  constexpr int n = 20000;
  std::vector<Eigen::Vector2d> p;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * M_PI * i / n;
    const Eigen::Vector3d q = cMo * (dot + radius * Eigen::Vector3d(std::cos(a), std::sin(a), 0));
    p.emplace_back(kCamera.fx * q.x() / q.z() + kCamera.cx,
                   kCamera.fy * q.y() / q.z() + kCamera.cy);
  }
  double twice = 0;
  Eigen::Vector2d sum(0, 0);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d a = p[i] - p[0], b = p[(i + 1) % n] - p[0];
    const double cross = a.x() * b.y() - b.x() * a.y();
    twice += cross;
    sum += cross * (a + b);
  }
  return {std::abs(twice) / 2, p[0] + sum / (3 * twice)};
}

/// Share of a pixel that sees the disc, by 16 x 16 lines of sight cut with the plane of the plate.
double covered(const Eigen::Isometry3d& cMo, double radius, int u, int v) {
  const Eigen::Isometry3d oMc = cMo.inverse();
  const Eigen::Vector3d eye = oMc.translation();
  int hits = 0;
  for (int i = 0; i < 256; ++i) {
    const double x = (u + (i % 16 + 0.5) / 16 - 0.5 - kCamera.cx) / kCamera.fx;
    const double y = (v + (i / 16 + 0.5) / 16 - 0.5 - kCamera.cy) / kCamera.fy;
    const Eigen::Vector3d sight = oMc.linear() * Eigen::Vector3d(x, y, 1);
    const Eigen::Vector3d hit = eye - eye.z() / sight.z() * sight;
    hits += hit.head<2>().norm() < radius;
  }
  return hits / 256.0;
}

struct Blob {
  double area = 0;
  Eigen::Vector2d mean{0, 0}, variance{0, 0};
};
/// Moments of the gray levels over the whole image, given the two levels.
Blob blob(const Image& image, double background, double dot) {
  Blob b;
  Eigen::Vector2d square(0, 0);
  for (unsigned v = 0; v < image.getHeight(); ++v) {
    for (unsigned u = 0; u < image.getWidth(); ++u) {
      const double w = (image[v][u] - background) / (dot - background);
      b.area += w;
      b.mean += w * Eigen::Vector2d(u, v);
      square += w * Eigen::Vector2d(double(u) * u, double(v) * v);
    }
  }
  b.mean /= b.area;
  b.variance = square / b.area - b.mean.cwiseAbs2();
  return b;
}

Image shot(const DotTarget& target, const SyntheticCameraOptions& options,
           const SyntheticView& view) {
  Image image;
  SyntheticCamera(kCamera, target, options).render(view, image);
  return image;
}

bool isSame(const Image& a, const Image& b) {
  return a.getSize() == b.getSize() && std::equal(a.bitmap, a.bitmap + a.getSize(), b.bitmap);
}

bool isPlain(const Image& image, unsigned char level) {
  return std::all_of(image.bitmap, image.bitmap + image.getSize(),
                     [level](unsigned char p) { return p == level; });
}

TEST(SyntheticCamera, outline_has_the_area_and_centroid_of_the_projected_circle) {
  const DotTarget target{{{0.05, -0.03, 0}}, 0.02};
  const SyntheticCamera camera(kCamera, target);
  for (const auto& cMo : randomPoses(50)) {
    const auto ellipse = camera.ellipse(cMo, 0);
    ASSERT_TRUE(ellipse);
    const Outline truth = polygon(cMo, target.points[0], target.radius);
    EXPECT_NEAR(ellipse->area() / truth.area, 1, 1e-6);
    EXPECT_NEAR((ellipse->centre - truth.centroid).norm(), 0, 1e-5);
  }
}

TEST(SyntheticCamera, a_tilted_disc_is_seen_off_the_projection_of_its_centre) {
  const double t = 30 * M_PI / 180, radius = 0.014, f = kCamera.fx;
  const SyntheticCamera camera(kCamera, oneDot(radius));
  const auto cMo = poseAt({0, 0, 0.6}, {0, t, 0});
  const double off = (camera.ellipse(cMo, 0)->centre - *camera.centre(cMo, 0)).norm();
  const double r_px = f * radius / 0.6;
  EXPECT_NEAR(off, r_px * r_px / f * std::sin(t) * std::cos(t), 0.01 * off);
}

TEST(SyntheticCamera, pixels_are_those_of_a_finely_sampled_image) {
  for (const auto& cMo : randomPoses(5)) {
    const Image image = shot(oneDot(0.014), {}, {cMo, {}, {}, {}, 0});
    double worst = 0, sum2 = 0;
    int rim = 0;
    const Outline outline = polygon(cMo, {0, 0, 0}, 0.014);
    const int left = static_cast<int>(outline.centroid.x()) - 40;
    const int top = static_cast<int>(outline.centroid.y()) - 40;
    for (int v = std::max(0, top); v < std::min(480, top + 80); ++v) {
      for (int u = std::max(0, left); u < std::min(640, left + 80); ++u) {
        const double truth = covered(cMo, 0.014, u, v);
        const double error = (220 - image[v][u]) / 200.0 - truth;
        worst = std::max(worst, std::abs(error));
        if (truth > 0 && truth < 1) sum2 += error * error, ++rim;
      }
    }
    EXPECT_LT(worst, 0.09);
    EXPECT_LT(std::sqrt(sum2 / rim), 0.04);
  }
}

TEST(SyntheticCamera, centroid_and_area_are_true_to_a_hundredth_of_a_pixel) {
  double sum2 = 0;
  const auto poses = randomPoses(60);
  for (const auto& cMo : poses) {
    const Blob seen = blob(shot(oneDot(0.014), {}, {cMo, {}, {}, {}, 0}), 220, 20);
    const Outline truth = polygon(cMo, {0, 0, 0}, 0.014);
    EXPECT_NEAR(seen.area / truth.area, 1, 0.005);
    sum2 += (seen.mean - truth.centroid).squaredNorm();
  }
  EXPECT_LT(std::sqrt(sum2 / (2.0 * double(poses.size()))), 0.008);
}

TEST(SyntheticCamera, tiny_dots_keep_their_light) {
  for (const double radius_px : {0.3, 0.6, 0.99, 1.01, 2.0}) {
    double area = 0;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> shift(-0.0005, 0.0005);
    for (int i = 0; i < 50; ++i) {
      const auto cMo = poseAt({shift(random), shift(random), 0.6});
      area +=
          blob(shot(oneDot(radius_px * 0.6 / 600), {}, {cMo, {}, {}, {}, 0}), 220, 20).area / 50;
    }
    const double truth = M_PI * radius_px * radius_px * kCamera.fy / kCamera.fx;
    EXPECT_NEAR(area / truth, 1, 0.05) << radius_px << " px";
  }
}

TEST(SyntheticCamera, gray_noise_is_normal_white_and_as_strong_as_asked) {
  SyntheticCameraOptions options;
  options.gray_noise = 3;
  options.background = 128;
  const Image image = shot(oneDot(0.001), options, {poseAt({9, 9, 1}), {}, {}, {}, 0});
  const double n = image.getSize();
  double sum = 0, sum2 = 0, sum4 = 0, lag = 0, below = 0;
  for (unsigned i = 0; i < image.getSize(); ++i) {
    const double e = image.bitmap[i] - 128.0;
    sum += e, sum2 += e * e, sum4 += e * e * e * e;
    if (i > 0) lag += e * (image.bitmap[i - 1] - 128.0);
    below += e < -4.5;
  }
  const double variance = 9 + 1.0 / 12;  // and that of rounding
  EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(variance / n));
  EXPECT_NEAR(sum2 / n, variance, 5 * variance * std::sqrt(2 / n));
  EXPECT_NEAR(sum4 / n / (variance * variance), 3, 0.1);
  EXPECT_NEAR(lag / n, 0, 5 * variance / std::sqrt(n));
  EXPECT_NEAR(below / n, 0.0668, 0.005);  // -1.5 sigma
}

TEST(SyntheticCamera, noise_depends_on_seed_and_frame_only) {
  SyntheticCameraOptions options;
  options.gray_noise = 2;
  const auto at = [&](std::uint64_t frame) {
    return SyntheticView{poseAt({0, 0, 1}), {}, {}, {}, frame};
  };
  SyntheticCamera camera(kCamera, oneDot(0.02), options);
  Image first, other;
  camera.render(at(4), first);
  camera.render(at(5), other);
  EXPECT_FALSE(isSame(first, other));
  EXPECT_TRUE(isSame(first, shot(oneDot(0.02), options, at(4))));
  EXPECT_TRUE(isSame(other, shot(oneDot(0.02), options, at(5))));
  options.seed = 2;
  EXPECT_FALSE(isSame(first, shot(oneDot(0.02), options, at(4))));
}

TEST(SyntheticCamera, blur_spreads_along_the_motion_and_keeps_the_centre_of_mid_exposure) {
  SyntheticCameraOptions options;
  const auto cMo = poseAt({0.01, -0.02, 0.6});
  const SyntheticView view{cMo, {{0.3, 0, 0}, {0, 0, 0}}, {}, {}, 0};
  const Blob sharp = blob(shot(oneDot(0.014), options, view), 220, 20);
  options.exposure_s = 0.02;
  const Blob blurred = blob(shot(oneDot(0.014), options, view), 220, 20);
  const double path_px = 600 * 0.3 * 0.02 / 0.6;
  EXPECT_NEAR((blurred.mean - sharp.mean).norm(), 0, 0.01);
  EXPECT_NEAR(blurred.area / sharp.area, 1, 1e-3);
  EXPECT_NEAR(blurred.variance.x() - sharp.variance.x(), path_px * path_px / 12, 0.15);
  EXPECT_NEAR(blurred.variance.y() - sharp.variance.y(), 0, 0.05);
}

TEST(SyntheticCamera, blur_follows_the_direction_of_the_twist) {
  SyntheticCameraOptions options;
  options.exposure_s = 0.1;
  const SyntheticView view{poseAt({0, 0, 0.6}), {{0, 0, 0}, {0, 0, 1.5}}, {}, {}, 0};
  const DotTarget target{{{0.1, 0, 0}}, 0.01};
  const Image image = shot(target, options, view);
  // Rotation by 0.15 rad about the axis at 100 px: an arc, dark 7.5 px above and below, not left
  // and right.
  EXPECT_LT(image[239 + 12][420], 200);
  EXPECT_LT(image[240 - 12][420], 200);
  EXPECT_EQ(image[239][420 + 13], 220);
  EXPECT_EQ(image[239][420 - 14], 220);
}

TEST(SyntheticCamera, vignetting_falls_off_with_the_square_of_the_distance) {
  SyntheticCameraOptions options;
  options.vignetting = 0.4;
  const Image image = shot(oneDot(0.001), options, {poseAt({9, 9, 1}), {}, {}, {}, 0});
  EXPECT_NEAR(image[0][0], 220 * 0.6, 1);
  EXPECT_NEAR(image[479][639], 220 * 0.6, 1);
  EXPECT_NEAR(image[240][320], 220, 0.5);
  EXPECT_NEAR(image[120][160], 220 * 0.9, 1);
}

TEST(SyntheticCamera, occluders_cover_everything_and_are_cut_at_the_border) {
  SyntheticCamera camera(kCamera, oneDot(0.02));
  SyntheticView view{poseAt({0, 0, 0.6}), {}, {}, {}, 0};
  const auto hides = camera.occluderOf(view.cMo, 0);
  ASSERT_TRUE(hides);
  view.occluders = {*hides, {-10, -10, 20, 20, 7}, {630, 470, 2000000000, 2000000000, 9}};
  Image image;
  camera.render(view, image);
  EXPECT_EQ(image[9][9], 7);
  EXPECT_EQ(image[10][10], 220);
  EXPECT_EQ(image[479][639], 9);
  EXPECT_EQ(image[240][320], 128);
  EXPECT_EQ(*std::min_element(image.bitmap + 10 * 640, image.bitmap + 470 * 640), 128)
      << "no trace of the dot";
}

TEST(SyntheticCamera, light_dots_on_a_dark_plate_are_the_negative) {
  const SyntheticView view{poseAt({0.02, 0.01, 0.5}, {0.3, 0.2, 0}), {}, {}, {}, 0};
  SyntheticCameraOptions light;
  std::swap(light.background, light.dot);
  const Image a = shot(oneDot(0.02), {}, view), b = shot(oneDot(0.02), light, view);
  for (unsigned i = 0; i < a.getSize(); ++i) ASSERT_NEAR(a.bitmap[i] + b.bitmap[i], 240, 1);
}

TEST(SyntheticCamera, displacement_moves_the_drawn_dot) {
  SyntheticView view{poseAt({0, 0, 0.6}), {}, {}, {}, 0};
  const Blob before = blob(shot(oneDot(0.014), {}, view), 220, 20);
  view.displacement = {{0.7, -1.3}};
  const Blob after = blob(shot(oneDot(0.014), {}, view), 220, 20);
  EXPECT_NEAR((after.mean - before.mean - view.displacement[0]).norm(), 0, 0.015);
  view.displacement = {{std::nan(""), 0}};
  EXPECT_NEAR((blob(shot(oneDot(0.014), {}, view), 220, 20).mean - before.mean).norm(), 0, 1e-9);
}

TEST(SyntheticCamera, a_dot_at_the_border_is_cut_there) {
  const auto cMo = poseAt({-319.5 / 600 * 0.6, 0, 0.6});  // centre on the first column
  const Image image = shot(oneDot(0.014), {}, {cMo, {}, {}, {}, 0});
  EXPECT_EQ(image[239][0], 20);
  EXPECT_EQ(image[239][639], 220) << "nothing comes in again on the other side";
  EXPECT_NEAR(blob(image, 220, 20).area, 0.5 * M_PI * 14 * 14 * 590 / 600 + 0.5 * 27.5, 3);
}

TEST(SyntheticCamera, what_cannot_be_seen_is_not_drawn) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  for (const auto& cMo :
       {poseAt({0, 0, -1}), poseAt({0, 0, 0}), poseAt({5, 0, 1}), poseAt({1e9, 0, 1}),
        poseAt({0, 0, 0.6}, {M_PI / 2, 0, 0}), poseAt({0, 0, 0.005}, {1.2, 0, 0}),
        poseAt({nan, 0, 1}), poseAt({0, 0, inf}), poseAt({0, 0, 1e12})}) {
    EXPECT_TRUE(isPlain(shot(oneDot(0.014), {}, {cMo, {}, {}, {}, 0}), 220))
        << cMo.translation().transpose();
  }
}

TEST(SyntheticCamera, a_dot_that_fills_the_image_is_drawn_all_over) {
  EXPECT_TRUE(isPlain(shot(oneDot(10), {}, {poseAt({0, 0, 0.1}), {}, {}, {}, 0}), 20));
}

TEST(SyntheticCamera, an_image_of_the_right_size_is_filled_in_place) {
  Image image(480, 640);
  const unsigned char* memory = image.bitmap;
  SyntheticCamera camera(kCamera, oneDot(0.01));
  camera.render({poseAt({0, 0, 0.6}), {}, {}, {}, 0}, image);
  EXPECT_EQ(image.bitmap, memory);
}

TEST(SyntheticCamera, senseless_options_are_refused) {
  const auto refused = [](const DotTarget& target, const SyntheticCameraOptions& options) {
    EXPECT_THROW(SyntheticCamera(kCamera, target, options), std::invalid_argument);
  };
  refused(oneDot(0), {});
  refused(oneDot(std::nan("")), {});
  SyntheticCameraOptions options;
  options.background = 256;
  refused(oneDot(0.01), options);
  options = {};
  options.gray_noise = -1;
  refused(oneDot(0.01), options);
  options = {};
  options.vignetting = 1.1;
  refused(oneDot(0.01), options);
  options = {};
  options.exposure_s = std::nan("");
  refused(oneDot(0.01), options);
  EXPECT_THROW(SyntheticCamera(PinholeCamera{}, oneDot(0.01)), std::invalid_argument);
}

}  // namespace
}  // namespace depthservo
