#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/TaughtTracker.h"
#include "depthservo/visp/using.h"
#include "tracking/lastingCorners.h"

namespace depthservo::test {
namespace {

using Image = vpImage<unsigned char>;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};

/// A wall in the plane z = 0 of the object frame, and one in front of it.
class Walls {
 public:
  explicit Walls(bool isFlat, double noise = 2) {
    SyntheticCameraOptions options;
    options.gray_noise = noise;
    std::vector<GrayPatch> patches{GrayPatch::random(4, 3, 100, 75, 5)};
    if (!isFlat) {
      patches.push_back(GrayPatch::random(0.6, 0.6, 20, 20, 6));
      patches.back().oMp.translation() = Eigen::Vector3d(0.2, 0.1, -0.5);
    }
    camera_.emplace(kCamera, patches, options);
  }

  Image seenFrom(const Eigen::Isometry3d& cMo) {
    SyntheticView view;
    view.cMo = cMo;
    view.frame = frame_++;
    Image image;
    camera_->render(view, image);
    return image;
  }

 private:
  std::optional<SyntheticCamera> camera_;
  std::uint64_t frame_ = 0;
};

Eigen::Isometry3d pose(double x, double y, double z, double yaw = 0, double roll = 0) {
  Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
  cMo.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
                     .toRotationMatrix();
  cMo.translation() = Eigen::Vector3d(x, y, z);
  return cMo;
}

/// Where a pixel of one view of the plane z = 0 is in another: through the point on the plane.
Eigen::Vector2d seenAgain(const Eigen::Vector2d& pixel, const Eigen::Isometry3d& cMo,
                          const Eigen::Isometry3d& otherMo) {
  const Eigen::Isometry3d oMc = cMo.inverse();
  const Eigen::Vector3d ray((pixel.x() - kCamera.cx) / kCamera.fx,
                            (pixel.y() - kCamera.cy) / kCamera.fy, 1);
  const Eigen::Vector3d direction = oMc.linear() * ray, origin = oMc.translation();
  const Eigen::Vector3d point = origin - origin.z() / direction.z() * direction;
  const Eigen::Vector3d seen = otherMo * point;
  return {kCamera.cx + kCamera.fx * seen.x() / seen.z(),
          kCamera.cy + kCamera.fy * seen.y() / seen.z()};
}

/// As `teach` chooses them.
TaughtImage taughtBy(const Image& image) {
  TaughtImage taught{image, {}};
  for (const TrackedPoint& p : detail::lastingCorners(image, 30))
    taught.points.emplace_back(p.u, p.v);
  EXPECT_EQ(taught.points.size(), 30u);
  return taught;
}

struct Score {
  int measured = 0, outside = 0;
  double rms_px = 0, worst_px = 0;
};
Score score(const std::vector<TrackedPoint>& found, const std::vector<Eigen::Vector2d>& points,
            const Eigen::Isometry3d& goal, const Eigen::Isometry3d& now) {
  Score s;
  double squared = 0;
  for (const TrackedPoint& p : found) {
    if (p.sigma_px > 2) {  // by its place only
      ++s.outside;
      continue;
    }
    const Eigen::Vector2d truth = seenAgain(points[static_cast<std::size_t>(p.id)], goal, now);
    const double error = (Eigen::Vector2d(p.u, p.v) - truth).norm();
    squared += error * error;
    s.worst_px = std::max(s.worst_px, error);
    ++s.measured;
  }
  s.rms_px = std::sqrt(squared / std::max(1, s.measured));
  return s;
}

class TaughtTrackerStarts : public testing::TestWithParam<int> {};

const Eigen::Isometry3d kGoal = pose(0, 0, 1.2);
const Eigen::Isometry3d kStarts[] = {kGoal, pose(0.1, 0.02, 1.3, 0.05),
                                     pose(-0.2, 0, 1.8, -0.15, 0.1), pose(0.1, 0.1, 2.4, 0.1, -0.3),
                                     pose(0.05, 0, 0.9, 0.1, 1.2)};

TEST_P(TaughtTrackerStarts, finds_the_points_from_other_places) {
  Walls walls(true);
  const TaughtImage taught = taughtBy(walls.seenFrom(kGoal));
  const auto& points = taught.points;
  TaughtTracker tracker(taught);
  const Eigen::Isometry3d& now = kStarts[GetParam()];
  const auto& found = tracker.track(walls.seenFrom(now), {});
  int inView = 0;
  for (const Eigen::Vector2d& p : points) {
    const Eigen::Vector2d q = seenAgain(p, kGoal, now);
    inView += q.x() > 25 && q.x() < 614 && q.y() > 25 && q.y() < 454;
  }
  const Score s = score(found, points, kGoal, now);
  EXPECT_GE(s.measured, 0.85 * inView);
  EXPECT_GE(inView, 10);
  if (2 * s.measured >= static_cast<int>(points.size())) {
    EXPECT_EQ(found.size(), points.size()) << "the others by their place";
  }
  EXPECT_LT(s.rms_px, 0.15);
  EXPECT_LT(s.worst_px, 0.5);
  EXPECT_NE(tracker.news().find("is found"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(TaughtTracker, TaughtTrackerStarts, testing::Range(0, 5));

TEST(TaughtTracker, follows_without_drift_all_the_way_to_the_goal) {
  Walls walls(true);
  const TaughtImage taught = taughtBy(walls.seenFrom(kGoal));
  const auto& points = taught.points;
  TaughtTracker tracker(taught);
  Score s;
  for (int i = 0; i <= 60; ++i) {
    const double way = 1 - i / 60.0;
    const Eigen::Isometry3d now = pose(-0.2 * way, 0.05 * way, 1.2 + 0.8 * way, -0.15 * way);
    const auto& found = tracker.track(walls.seenFrom(now), {});
    s = score(found, points, kGoal, now);
    ASSERT_GE(s.measured, 15) << "image " << i;
    ASSERT_LT(s.rms_px, 0.3) << "image " << i;
  }
  EXPECT_LT(s.rms_px, 0.08);
  EXPECT_GE(s.measured, 25);
}

TEST(TaughtTracker, finds_them_where_the_scene_is_not_flat) {
  Walls walls(false);
  const Eigen::Isometry3d start = pose(-0.1, 0, 1.6, -0.05);
  TaughtTracker tracker(taughtBy(walls.seenFrom(kGoal)));
  const auto& found = tracker.track(walls.seenFrom(start), {});
  const auto sure = std::count_if(found.begin(), found.end(),
                                  [](const TrackedPoint& p) { return p.sigma_px < 1; });
  EXPECT_GE(sure, 12);
}

TEST(TaughtTracker, finds_nothing_in_another_scene_and_says_so) {
  Walls walls(true);
  TaughtTracker tracker(taughtBy(walls.seenFrom(kGoal)));
  SyntheticCamera other(kCamera, {GrayPatch::random(4, 3, 100, 75, 77)});
  SyntheticView view;
  view.cMo = kGoal;
  Image image;
  other.render(view, image);
  EXPECT_TRUE(tracker.track(image, {}).empty());
  EXPECT_NE(tracker.news().find("not found"), std::string::npos);
  EXPECT_TRUE(tracker.track(Image(480, 640, 128), {}).empty());
  EXPECT_TRUE(tracker.track(Image(24, 32, 128), {}).empty());
  EXPECT_TRUE(tracker.track(Image(), {}).empty());
}

TEST(TaughtTracker, finds_them_again_after_they_were_covered) {
  Walls walls(true);
  const TaughtImage taught = taughtBy(walls.seenFrom(kGoal));
  const auto& points = taught.points;
  TaughtTracker tracker(taught);
  tracker.track(walls.seenFrom(kStarts[1]), {});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(tracker.track(Image(480, 640, 128), {}).empty());
  const Score s = score(tracker.track(walls.seenFrom(kStarts[2]), {}), points, kGoal, kStarts[2]);
  EXPECT_GE(s.measured, 15);
  EXPECT_LT(s.rms_px, 0.25);
}

TEST(TaughtTracker, gives_the_same_every_time) {
  Walls walls(true);
  const TaughtImage taught = taughtBy(walls.seenFrom(kGoal));
  const Image now = walls.seenFrom(kStarts[3]);
  TaughtTracker one(taught), other(taught);
  const auto a = one.track(now, {});
  const auto b = other.track(now, {});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].u, b[i].u);
    EXPECT_EQ(a[i].v, b[i].v);
  }
}

TEST(TaughtTracker, refuses_what_it_cannot_track) {
  EXPECT_THROW(TaughtTracker({Image(48, 64, 0), {{1, 1}, {2, 2}}}), std::invalid_argument);
  EXPECT_THROW(TaughtTracker({Image(48, 64, 0), {{1, 1}, {2, 2}, {3, 3}, {64, 3}}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace depthservo::test
