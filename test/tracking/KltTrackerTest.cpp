#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/KltTracker.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

using Image = vpImage<unsigned char>;

const PinholeCamera kCamera{320, 240, 300, 300, 159.5, 119.5};

KltTrackerOptions options() {
  KltTrackerOptions options;
  options.points = 80;
  return options;
}

/// A wall at 1 m, the camera before it.
class Wall {
 public:
  explicit Wall(double gray_noise = 2) {
    GrayPatch patch = GrayPatch::random(3, 3, 100, 100, 7);
    patch.oMp.translation().z() = 1;
    SyntheticCameraOptions camera;
    camera.gray_noise = gray_noise;
    camera_ = std::make_unique<SyntheticCamera>(kCamera, std::vector<GrayPatch>{patch}, camera);
  }

  /// The camera moved by (x, y, z) and rolled.
  Image shot(const Eigen::Vector3d& position, double roll = 0) {
    view_.cMo = Eigen::Isometry3d::Identity();
    view_.cMo.linear() = Eigen::AngleAxisd(-roll, Eigen::Vector3d::UnitZ()).matrix();
    view_.cMo.translation() = -(view_.cMo.linear() * position);
    ++view_.frame;
    Image image;
    camera_->render(view_, image);
    return image;
  }

  /// Where the point of the wall is now that was seen at (u, v) from the origin.
  Eigen::Vector2d now(double u, double v) const {
    const Eigen::Vector2d s = kCamera.normalise(u, v);
    const Eigen::Vector3d p = view_.cMo * Eigen::Vector3d(s.x(), s.y(), 1);
    return kCamera.toPixel(p.x() / p.z(), p.y() / p.z());
  }

 private:
  std::unique_ptr<SyntheticCamera> camera_;
  SyntheticView view_;
};

struct Followed {
  double median_px, median_sigmas;
  std::size_t kept, first;
};
/// Follows the corners of the first image along a path; errors of those left at the end.
template <class Path>
Followed follow(KltTracker& tracker, Wall& wall, int frames, const Path& path) {
  std::map<int, TrackedPoint> first;
  for (const TrackedPoint& p : tracker.track(wall.shot({0, 0, 0}), {})) first[p.id] = p;
  std::vector<TrackedPoint> last;
  for (int k = 1; k <= frames; ++k) last = tracker.track(path(wall, k), {});
  std::vector<double> errors, sigmas;
  for (const TrackedPoint& p : last) {
    if (first.count(p.id) == 0) continue;
    const double error =
        (wall.now(first[p.id].u, first[p.id].v) - Eigen::Vector2d(p.u, p.v)).norm();
    errors.push_back(error);
    sigmas.push_back(error / p.sigma_px);
  }
  const auto median = [](std::vector<double>& v) {
    if (v.empty()) return HUGE_VAL;
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  return {median(errors), median(sigmas), errors.size(), first.size()};
}

TEST(KltTracker, follows_corners_sideways_without_drift_and_knows_its_error) {
  Wall wall;
  KltTracker tracker(options());
  const Followed f = follow(tracker, wall, 40, [](Wall& w, int k) {
    return w.shot({0.002 * k, 0.001 * k, 0});
  });
  EXPECT_GE(f.first, 60u);
  EXPECT_GE(f.kept, f.first * 8 / 10);
  EXPECT_LT(f.median_px, 0.05);
  // The median of a Rayleigh variable is 1.18 sigma; sigma shall neither boast nor hide.
  EXPECT_GT(f.median_sigmas, 0.5);
  EXPECT_LT(f.median_sigmas, 1.8);
}

TEST(KltTracker, zoom_and_roll_pull_no_corner_away) {
  Wall wall;
  KltTracker tracker(options());
  const Followed f = follow(tracker, wall, 40, [](Wall& w, int k) {
    return w.shot({0, 0, 0.003 * k}, 0.002 * k);
  });
  EXPECT_GE(f.kept, f.first * 6 / 10);
  EXPECT_LT(f.median_px, 0.15);
}

TEST(KltTracker, gain_and_offset_of_the_light_do_not_matter) {
  Wall wall;
  KltTracker tracker(options());
  const Followed f = follow(tracker, wall, 30, [](Wall& w, int k) {
    Image image = w.shot({0.002 * k, 0, 0});
    const double gain = k < 10 ? 1 : 0.6 + 0.01 * (k - 10), offset = k < 20 ? 0 : 25;
    for (unsigned i = 0; i < image.getSize(); ++i) {
      image.bitmap[i] =
          static_cast<unsigned char>(std::min(255.0, gain * image.bitmap[i] + offset));
    }
    return image;
  });
  EXPECT_GE(f.kept, f.first * 8 / 10);
  EXPECT_LT(f.median_px, 0.05);
}

TEST(KltTracker, corners_that_left_are_retired_once_and_new_ones_have_new_ids) {
  Wall wall;
  KltTracker tracker(options());
  std::set<int> seen, retired;
  std::size_t least = 1000;
  for (int k = 0; k <= 60; ++k) {
    const auto points = tracker.track(wall.shot({0.006 * k, 0, 0}), {});
    for (const int id : tracker.retired()) {
      EXPECT_EQ(seen.count(id), 1u);
      EXPECT_TRUE(retired.insert(id).second) << id;
    }
    int before = -1;
    for (const TrackedPoint& p : points) {
      EXPECT_GT(p.id, before);
      before = p.id;
      EXPECT_EQ(retired.count(p.id), 0u) << p.id;
      EXPECT_TRUE(kCamera.contains(p.u, p.v));
      EXPECT_GT(p.sigma_px, 0);
      seen.insert(p.id);
    }
    least = std::min(least, points.size());
  }
  EXPECT_GT(retired.size(), 10u);
  EXPECT_GT(seen.size(), 90u);
  EXPECT_GE(least, 40u);
}

TEST(KltTracker, a_blank_moment_is_survived_and_given_up_points_do_not_return) {
  Wall wall;
  KltTracker tracker(options());
  const auto first = tracker.track(wall.shot({0, 0, 0}), {});
  std::vector<ExpectedPoint> expected;
  for (const TrackedPoint& p : first) expected.push_back({p.id, p.u, p.v, 0.5});
  const Image blank(240, 320, 100), empty, other(100, 100, 0);
  EXPECT_TRUE(tracker.track(blank, {}).empty());
  EXPECT_TRUE(tracker.track(empty, {}).empty());
  EXPECT_TRUE(tracker.track(other, {}).empty());
  const auto again = tracker.track(wall.shot({0, 0, 0}), expected);
  EXPECT_GE(again.size(), first.size() * 8 / 10);
  const int id = again.front().id;
  tracker.giveUp(id);
  for (const TrackedPoint& p : tracker.track(wall.shot({0, 0, 0}), {})) EXPECT_NE(p.id, id);
  EXPECT_EQ(std::count(tracker.retired().begin(), tracker.retired().end(), id), 1);
}

TEST(KltTracker, the_noise_of_flat_and_of_saturated_images_shows_no_corners) {
  std::mt19937 random(3);
  for (const double level : {60.0, 128.0, 253.0, 262.0}) {
    for (const double noise : {1.0, 3.0, 8.0}) {
      std::normal_distribution<double> pixel(level, noise);
      Image image(240, 320);
      KltTracker tracker;
      for (int k = 0; k < 5; ++k) {
        for (unsigned i = 0; i < image.getSize(); ++i) {
          image.bitmap[i] = static_cast<unsigned char>(std::clamp(pixel(random), 0.0, 255.0));
        }
        EXPECT_TRUE(tracker.track(image, {}).empty()) << level << ", " << noise;
      }
    }
  }
}

TEST(KltTracker, corners_are_chosen_beside_a_flat_part_and_not_in_it) {
  Wall wall;
  KltTracker tracker(options());
  std::mt19937 random(3);
  std::normal_distribution<double> pixel(120, 2);
  for (int k = 0; k < 8; ++k) {
    Image image = wall.shot({0.002 * k, 0, 0});
    for (unsigned v = 0; v < image.getHeight(); ++v) {
      for (unsigned u = 160; u < image.getWidth(); ++u) {
        image[v][u] = static_cast<unsigned char>(pixel(random));
      }
    }
    const auto points = tracker.track(image, {});
    EXPECT_GE(points.size(), 20u);
    for (const TrackedPoint& p : points) EXPECT_LT(p.u, 160 + 8);
  }
}

TEST(KltTracker, the_places_of_lost_points_are_taken_at_once) {
  Wall wall;
  KltTracker tracker(options());
  const std::size_t first = tracker.track(wall.shot({0, 0, 0}), {}).size();
  std::size_t points = 0;
  // Somewhere else of a sudden: four images, one for each quarter.
  for (int k = 0; k < 4; ++k) points = tracker.track(wall.shot({0.8, 0.3, 0}), {}).size();
  EXPECT_GE(points, first * 7 / 10);
  EXPECT_LE(points, 80u);
  // The old ones, found again, and the new ones are never more than were asked for.
  for (int k = 0; k < 4; ++k) {
    EXPECT_LE(tracker.track(wall.shot({0, 0, 0}), {}).size(), 80u);
  }
}

TEST(KltTracker, options_out_of_range_are_refused) {
  for (const auto& spoil : std::vector<void (*)(KltTrackerOptions&)>{
           [](KltTrackerOptions& o) { o.points = 0; },
           [](KltTrackerOptions& o) { o.window_px = 4; },
           [](KltTrackerOptions& o) { o.levels = 7; }, [](KltTrackerOptions& o) { o.quality = 1; },
           [](KltTrackerOptions& o) { o.forward_backward_px = NAN; },
           [](KltTrackerOptions& o) { o.patience = -1; }}) {
    KltTrackerOptions bad;
    spoil(bad);
    EXPECT_THROW(KltTracker{bad}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace depthservo
