#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/visp/using.h"
#include "support/Poses.h"

namespace depthservo {
namespace {

using test::poseAt;
using Image = vpImage<unsigned char>;

const PinholeCamera kCamera{160, 120, 150, 145, 79.5, 59.5};

GrayPatch plain(double width, double height, unsigned char gray) {
  return {Eigen::Isometry3d::Identity(), width, height, 1, 1, {gray}};
}

SyntheticView viewOf(const Eigen::Isometry3d& cMo) {
  SyntheticView view;
  view.cMo = cMo;
  return view;
}

Image shot(const std::vector<GrayPatch>& patches, const SyntheticView& view,
           const SyntheticCameraOptions& options = {}) {
  Image image;
  SyntheticCamera(kCamera, patches, options).render(view, image);
  return image;
}

/// What a line of sight meets, by intersecting it with the plane of each patch.
struct Hit {
  double Z = HUGE_VAL, gray = 0;
};
Hit lookAt(const std::vector<GrayPatch>& patches, const Eigen::Isometry3d& cMo, double u,
           double v) {
  const Eigen::Vector3d sight((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1);
  Hit hit;
  for (const GrayPatch& patch : patches) {
    const Eigen::Isometry3d pMc = (cMo * patch.oMp).inverse();
    const Eigen::Vector3d eye = pMc.translation(), ray = pMc.linear() * sight;
    const double Z = -eye.z() / ray.z();
    const Eigen::Vector3d at = eye + Z * ray;
    const double column = (at.x() / patch.width + 0.5) * patch.columns;
    const double row = (at.y() / patch.height + 0.5) * patch.rows;
    const bool isOn = column >= 0 && row >= 0 && column < patch.columns && row < patch.rows;
    if (!isOn || Z <= 0 || Z >= hit.Z) continue;
    hit = {Z,
           static_cast<double>(
               patch.gray[static_cast<std::size_t>(row) * static_cast<std::size_t>(patch.columns) +
                          static_cast<std::size_t>(column)])};
  }
  return hit;
}

std::vector<Eigen::Isometry3d> randomPoses(int n) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < n; ++i) {
    poses.push_back(poseAt({0.1 * unit(random), 0.1 * unit(random), 0.8 + 0.3 * unit(random)},
                           {0.6 * unit(random), 0.6 * unit(random), 3 * unit(random)}));
  }
  return poses;
}

TEST(GrayPatch, every_pixel_is_the_mean_of_what_its_lines_of_sight_meet) {
  const std::vector<GrayPatch> wall = {GrayPatch::random(0.5, 0.4, 13, 9, 5)};
  constexpr int n = 24;
  for (const Eigen::Isometry3d& cMo : randomPoses(4)) {
    const Image image = shot(wall, viewOf(cMo));
    double worst = 0;
    for (int v = 0; v < kCamera.height; v += 3) {
      for (int u = 0; u < kCamera.width; u += 3) {
        double sum = 0;
        for (int i = 0; i < n * n; ++i) {
          const Hit hit = lookAt(wall, cMo, u + (i % n + 0.5) / n - 0.5,  // NOLINT: a grid
                                 v + (i / n + 0.5) / n - 0.5);            // NOLINT
          sum += std::isinf(hit.Z) ? 220 : hit.gray;
        }
        worst = std::max(worst, std::abs(image[static_cast<unsigned>(v)][static_cast<unsigned>(u)] -
                                         sum / (n * n)));
      }
    }
    // Rounding, and what a grid of 24 x 24 misses of an edge across the pixel.
    EXPECT_LT(worst, 0.5 + 200. / n);
  }
}

/// Where the edge between two flat grays crosses columns u of the image, from the sum of each
/// column between two rows: exact for an exactly integrated image.
double crossing(const Image& image, unsigned u, unsigned top, unsigned bottom) {
  double sum = 0;
  for (unsigned v = top; v <= bottom; ++v) sum += image[v][u];
  const double above = image[top][u], below = image[bottom][u];
  return top - 0.5 + (sum - below * (bottom - top + 1)) / (above - below);
}

TEST(GrayPatch, edges_lie_where_they_project_to_a_hundredth_of_a_pixel) {
  const GrayPatch patch = plain(0.5, 0.3, 20);
  for (const Eigen::Vector3d& r : {Eigen::Vector3d(0, 0, 0.1), Eigen::Vector3d(0.5, 0.2, 0.2),
                                   Eigen::Vector3d(-0.3, 0.4, -0.2)}) {
    const Eigen::Isometry3d cMo = poseAt({0.01, 0.02, 0.7}, r);
    const Image image = shot({patch}, viewOf(cMo));
    const auto project = [&](double x, double y) {
      const Eigen::Vector3d p = cMo * Eigen::Vector3d(x, y, 0);
      return kCamera.toPixel(p.x() / p.z(), p.y() / p.z());
    };
    const Eigen::Vector2d a = project(-0.25, -0.15), b = project(0.25, -0.15);
    for (unsigned u = 60; u < 100; ++u) {
      const double v = a.y() + (u - a.x()) * (b.y() - a.y()) / (b.x() - a.x());
      const auto middle = static_cast<unsigned>(std::lround(v));
      const double measured = crossing(image, u, middle - 5, middle + 5);
      EXPECT_NEAR(measured, v, 0.01) << u;  // gray levels are rounded: 0.005 px each
    }
  }
}

TEST(GrayPatch, the_nearer_patch_hides_the_farther_and_depth_is_of_what_is_seen) {
  GrayPatch wall = GrayPatch::random(2, 2, 20, 20, 1), box = plain(0.1, 0.1, 240);
  wall.oMp = poseAt({0, 0, 0.4}, {0.2, 0, 0});
  const std::vector<GrayPatch> scene = {box, wall};
  const Eigen::Isometry3d cMo = poseAt({0.02, 0, 0.6});
  const Image image = shot(scene, viewOf(cMo));
  const SyntheticCamera camera(kCamera, scene);
  int onBox = 0;
  for (unsigned v = 5; v < 115; v += 5) {
    for (unsigned u = 5; u < 155; u += 5) {
      const Hit hit = lookAt(scene, cMo, u, v);
      const auto Z = camera.depthAt(viewOf(cMo), u, v);
      ASSERT_TRUE(Z.has_value());
      EXPECT_NEAR(*Z, hit.Z, 1e-12);
      if (hit.gray == 240 && lookAt(scene, cMo, u + 1., v + 1.).gray == 240 &&
          lookAt(scene, cMo, u - 1., v - 1.).gray == 240) {
        EXPECT_EQ(image[v][u], 240);
        ++onBox;
      }
    }
  }
  EXPECT_GT(onBox, 4);
}

TEST(GrayPatch, is_not_seen_from_behind_nor_behind_the_camera) {
  const GrayPatch patch = plain(0.5, 0.5, 20);
  for (const Eigen::Isometry3d& cMo :
       {poseAt({0, 0, 1}, {0, 3.1, 0}), poseAt({0, 0, -1}), poseAt({0, 0, 0})}) {
    const Image image = shot({patch}, viewOf(cMo));
    for (unsigned i = 0; i < image.getSize(); ++i) ASSERT_EQ(image.bitmap[i], 220);
    EXPECT_FALSE(SyntheticCamera(kCamera, {patch}).depthAt(viewOf(cMo), 80, 60).has_value());
  }
}

TEST(GrayPatch, cells_that_reach_behind_the_camera_are_left_out_and_the_others_drawn) {
  const GrayPatch floor = GrayPatch::random(1, 20, 2, 40, 4);
  const Eigen::Isometry3d cMo = poseAt({0, 0.5, 0}, {0.01 - M_PI / 2, 0, 0});
  const Image image = shot({floor}, viewOf(cMo));
  int drawn = 0;
  for (unsigned i = 0; i < image.getSize(); ++i) drawn += image.bitmap[i] != 220;
  EXPECT_GT(drawn, 100);
}

TEST(GrayPatch, moves_when_told_and_blur_keeps_its_middle) {
  const GrayPatch patch = plain(0.2, 0.2, 20);
  SyntheticView view = viewOf(poseAt({0, 0, 0.7}));
  view.twist.linear = {0.3, 0, 0};
  SyntheticCameraOptions options;
  options.exposure_s = 0.05;
  const auto middle = [](const Image& image) {
    double sum = 0, moment = 0;
    for (unsigned v = 0; v < image.getHeight(); ++v) {
      for (unsigned u = 0; u < image.getWidth(); ++u) {
        sum += 220 - image[v][u];
        moment += u * (220. - image[v][u]);
      }
    }
    return moment / sum;
  };
  const Image sharp = shot({patch}, view), blurred = shot({patch}, view, options);
  EXPECT_NEAR(middle(blurred), middle(sharp), 0.01);
  int gray = 0;
  for (unsigned u = 0; u < 160; ++u) gray += blurred[60][u] > 25 && blurred[60][u] < 215;
  EXPECT_GE(gray, 5);  // 3.2 px of blur at either edge

  view.patchPoses = {poseAt({0.07, 0, 0})};
  EXPECT_NEAR(middle(shot({patch}, view)) - middle(sharp), 0.07 / 0.7 * kCamera.fx, 0.01);
  Eigen::Matrix3d warp = Eigen::Matrix3d::Identity();
  warp(0, 2) = 3.25;
  view.patchPoses.clear();
  view.patchWarps = {warp};
  EXPECT_NEAR(middle(shot({patch}, view)) - middle(sharp), 3.25, 0.01);
}

TEST(GrayPatch, a_camera_with_negative_fy_sees_it_too) {
  PinholeCamera mirrored = kCamera;
  mirrored.fy = -kCamera.fy;
  const std::vector<GrayPatch> wall = {GrayPatch::random(0.4, 0.3, 6, 5, 2)};
  const Eigen::Isometry3d cMo = poseAt({0.01, 0, 0.7}, {0.1, 0.2, 0.3});
  Image up, down;
  SyntheticCamera(kCamera, wall).render(viewOf(cMo), up);
  SyntheticCamera(mirrored, wall).render(viewOf(cMo), down);
  for (unsigned v = 0; v < 120; ++v) {
    for (unsigned u = 0; u < 160; ++u) ASSERT_NEAR(up[v][u], down[119 - v][u], 1);
  }
}

TEST(GrayPatch, without_size_or_with_missing_cells_is_refused) {
  EXPECT_THROW(SyntheticCamera(kCamera, {plain(0, 1, 0)}), std::invalid_argument);
  EXPECT_THROW(SyntheticCamera(kCamera, {plain(1, NAN, 0)}), std::invalid_argument);
  GrayPatch patch = plain(1, 1, 0);
  patch.columns = 2;
  EXPECT_THROW(SyntheticCamera(kCamera, {patch}), std::invalid_argument);
}

}  // namespace
}  // namespace depthservo
