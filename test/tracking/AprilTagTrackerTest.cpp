#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/visp/using.h"
#include "support/Poses.h"

namespace depthservo {
namespace {

using test::poseAt;
using Image = vpImage<unsigned char>;
using Points = std::vector<TrackedPoint>;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};

AprilTagTarget oneTag(const std::string& family = "36h11", int id = 5, double size = 0.16) {
  return {family, {{id, size, Eigen::Isometry3d::Identity()}}};
}

Image shot(const AprilTagTarget& target, const Eigen::Isometry3d& cMo,
           const SyntheticCameraOptions& options = {}, std::uint64_t frame = 0,
           const Twist& twist = {}) {
  SyntheticView view;
  view.cMo = cMo;
  view.twist = twist;
  view.frame = frame;
  Image image;
  SyntheticCamera(kCamera, target.patches(), options).render(view, image);
  return image;
}

Eigen::Vector2d project(const Eigen::Isometry3d& cMo, const Eigen::Vector3d& P) {
  const Eigen::Vector3d p = cMo * P;
  return kCamera.toPixel(p.x() / p.z(), p.y() / p.z());
}

struct Errors {
  double worst_px = 0, mean_u = 0, mean_v = 0, squared = 0, normalised = 0;
  int corners = 0;
  double rms() const { return std::sqrt(squared / (2 * corners)); }
  double nees() const { return normalised / (2 * corners); }  // 1 when sigma is honest
};
void compare(const Points& points, const AprilTagTarget& target, const Eigen::Isometry3d& cMo,
             Errors& errors) {
  const auto corners = target.corners();
  for (const TrackedPoint& point : points) {
    const Eigen::Vector2d e = Eigen::Vector2d(point.u, point.v) -
                              project(cMo, corners[static_cast<std::size_t>(point.id)]);
    errors.worst_px = std::max(errors.worst_px, e.norm());
    errors.mean_u += e.x();
    errors.mean_v += e.y();
    errors.squared += e.squaredNorm();
    errors.normalised += e.squaredNorm() / (point.sigma_px * point.sigma_px);
    ++errors.corners;
  }
}

/// Random tilts and rolls of a tag at about this distance.
std::vector<Eigen::Isometry3d> randomPoses(int n, double Z) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < n; ++i) {
    poses.push_back(poseAt({0.15 * Z * unit(random), 0.1 * Z * unit(random), Z},
                           {0.5 * unit(random), 0.5 * unit(random), 3 * unit(random)}));
  }
  return poses;
}

class AprilTagFamily : public testing::TestWithParam<const char*> {};

TEST_P(AprilTagFamily, corners_are_those_that_project_there_without_half_a_pixel_of_shift) {
  const AprilTagTarget target = oneTag(GetParam());
  AprilTagTracker tracker(target);
  Errors errors;
  for (const auto& cMo : randomPoses(10, 1))
    compare(tracker.track(shot(target, cMo), {}), target, cMo, errors);
  EXPECT_EQ(errors.corners, 40);
  EXPECT_LT(errors.worst_px, 0.03);
  EXPECT_LT(std::hypot(errors.mean_u, errors.mean_v) / errors.corners, 0.005);
}

INSTANTIATE_TEST_SUITE_P(Families, AprilTagFamily,
                         testing::Values("36h11", "25h9", "16h5", "Standard41h12", "36h10",
                                         "Circle21h7"));

TEST(AprilTagTracker, sigma_is_that_of_the_error_in_noise) {
  const AprilTagTarget target = oneTag();
  SyntheticCameraOptions options;
  options.gray_noise = 4;
  for (const double Z : {0.6, 1.2, 2.4}) {
    AprilTagTracker tracker(target);
    Errors errors;
    std::uint64_t frame = 0;
    for (const auto& cMo : randomPoses(30, Z)) {
      compare(tracker.track(shot(target, cMo, options, frame++), {}), target, cMo, errors);
    }
    ASSERT_GE(errors.corners, 100);
    // 4 corners x 2 axes x 30 images, neighbours share a side: some 120 degrees of freedom.
    EXPECT_GT(errors.nees(), 0.6) << Z;
    EXPECT_LT(errors.nees(), 1.5) << Z;
    EXPECT_LT(errors.rms(), 0.05) << Z;
  }
}

TEST(AprilTagTracker, motion_blur_and_vignetting_move_no_corner) {
  const AprilTagTarget target = oneTag();
  SyntheticCameraOptions options;
  options.exposure_s = 0.02;
  options.vignetting = 0.4;
  Twist twist;
  twist.linear = {0.15, 0.05, 0.1};  // about 2 px of blur
  twist.angular = {0, 0.05, 0.1};
  AprilTagTracker tracker(target);
  Errors errors;
  for (const auto& cMo : randomPoses(12, 1)) {
    compare(tracker.track(shot(target, cMo, options, 0, twist), {}), target, cMo, errors);
  }
  EXPECT_GE(errors.corners, 40);
  EXPECT_LT(errors.worst_px, 0.1);
}

TEST(AprilTagTracker, ids_are_by_target_order_or_by_tag_and_corners_start_bottom_left) {
  AprilTagTarget target{"36h11", {}};
  target.tags.push_back({17, 0.1, poseAt({0.1, 0, 0})});
  target.tags.push_back({3, 0.1, poseAt({-0.1, 0, 0})});
  const Eigen::Isometry3d cMo = poseAt({0, 0, 0.8});
  const Image image = shot(target, cMo);
  AprilTagTracker ofTarget(target), ofFamily("36h11");
  const Points byOrder = ofTarget.track(image, {}), byTag = ofFamily.track(image, {});
  ASSERT_EQ(byOrder.size(), 8u);
  ASSERT_EQ(byTag.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(byOrder[i].id, static_cast<int>(i));
    EXPECT_EQ(byTag[i].id, (i < 4 ? 4 * 3 : 4 * 17) + static_cast<int>(i % 4));
  }
  EXPECT_LT(byOrder[4].u, byOrder[0].u);  // tag 3 is on the left
  EXPECT_GT(byOrder[0].v, byOrder[3].v);  // corner 0 below corner 3
  EXPECT_LT(byOrder[0].u, byOrder[1].u);  // and left of corner 1
}

TEST(AprilTagTracker, tags_that_are_not_of_the_target_or_seen_twice_are_not_given) {
  AprilTagTarget scene{"36h11", {}};
  scene.tags.push_back({17, 0.1, poseAt({0.15, 0, 0})});
  scene.tags.push_back({3, 0.1, poseAt({-0.15, 0, 0})});
  const Eigen::Isometry3d cMo = poseAt({0, 0, 0.8});
  AprilTagTracker only(oneTag("36h11", 3));
  EXPECT_EQ(only.track(shot(scene, cMo), {}).size(), 4u);
  scene.tags[0].id = 3;
  EXPECT_TRUE(only.track(shot(scene, cMo), {}).empty());
  AprilTagTracker other(oneTag("36h11", 4));
  EXPECT_TRUE(other.track(shot(scene, cMo), {}).empty());
}

TEST(AprilTagTracker, a_hidden_tag_is_absent_and_comes_back_under_its_ids) {
  const AprilTagTarget target = oneTag();
  AprilTagTracker tracker(target);
  const Image image = shot(target, poseAt({0, 0, 1}));
  EXPECT_EQ(tracker.track(image, {}).size(), 4u);
  const Image blank(480, 640, 220), empty, other(100, 30, 0);
  for (const Image* nothing : {&blank, &empty, &other}) {
    EXPECT_TRUE(tracker.track(*nothing, {}).empty());
  }
  const Points again = tracker.track(image, {});
  ASSERT_EQ(again.size(), 4u);
  EXPECT_EQ(again[0].id, 0);
}

TEST(AprilTagTracker, shows_no_tags_in_noise) {
  std::mt19937 random(1);
  AprilTagTracker tracker("36h11");
  for (int k = 0; k < 3; ++k) {
    Image image(480, 640);
    for (unsigned i = 0; i < image.getSize(); ++i) {
      image.bitmap[i] = static_cast<unsigned char>(random() % 256);
    }
    EXPECT_TRUE(tracker.track(image, {}).empty());
  }
}

TEST(AprilTagTracker, refuses_what_does_not_exist) {
  EXPECT_THROW(AprilTagTracker("36h12"), std::invalid_argument);
  EXPECT_THROW(AprilTagTracker(AprilTagTarget{}), std::invalid_argument);
  EXPECT_THROW(AprilTagTracker(oneTag("16h5", 30)), std::invalid_argument);
  AprilTagTarget twice = oneTag();
  twice.tags.push_back(twice.tags[0]);
  EXPECT_THROW(AprilTagTracker{twice}, std::invalid_argument);
  AprilTagTrackerOptions options;
  options.hamming = 3;
  EXPECT_THROW(AprilTagTracker("36h11", options), std::invalid_argument);
  options = {};
  options.decimate = 0.5;
  EXPECT_THROW(AprilTagTracker("36h11", options), std::invalid_argument);
  EXPECT_THROW(aprilTagBitmap("36h11", 587), std::invalid_argument);
  EXPECT_THROW(aprilTagBitmap("36h11", -1), std::invalid_argument);
  EXPECT_EQ(aprilTagCount("36h11"), 587);
}

}  // namespace
}  // namespace depthservo
