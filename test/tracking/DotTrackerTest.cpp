#include <gtest/gtest.h>
#include <visp3/blob/vpDot2.h>
#include <visp3/core/vpIoTools.h>
#include <visp3/io/vpImageIo.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/visp/using.h"
#include "support/Poses.h"

namespace depthservo {
namespace {

using test::poseAt;
using Image = vpImage<unsigned char>;
using Points = std::vector<TrackedPoint>;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};
constexpr double kZ = 0.6;

/// 14 px dots on a square of 160 px, unless said otherwise.
DotTarget square(double radius = 0.014) {
  return {{{-0.08, -0.08, 0}, {0.08, -0.08, 0}, {0.08, 0.08, 0}, {-0.08, 0.08, 0}}, radius};
}
DotTarget single(double radius = 0.014) { return {{{0, 0, 0}}, radius}; }

/// A plate in front of the camera, its middle moved by so many pixels.
Eigen::Isometry3d shifted(double u, double v) { return poseAt({u / 600 * kZ, v / 600 * kZ, kZ}); }

SyntheticView viewOf(const Eigen::Isometry3d& cMo, std::vector<Occluder> occluders = {}) {
  return {cMo, {}, {}, std::move(occluders), 0};
}

Image shot(const DotTarget& target, const SyntheticView& view,
           const SyntheticCameraOptions& options = {}) {
  Image image;
  SyntheticCamera(kCamera, target, options).render(view, image);
  return image;
}

std::vector<Eigen::Vector2d> centres(const DotTarget& target, const Eigen::Isometry3d& cMo) {
  const SyntheticCamera camera(kCamera, target);
  std::vector<Eigen::Vector2d> c;
  for (std::size_t i = 0; i < target.points.size(); ++i)
    c.push_back(camera.ellipse(cMo, i)->centre);
  return c;
}

Eigen::Vector2d at(const TrackedPoint& p) { return {p.u, p.v}; }

std::vector<int> ids(const Points& points) {
  std::vector<int> list;
  for (const auto& p : points) list.push_back(p.id);
  return list;
}

/// Every point given is where its own dot is.
void expectTrue(const Points& points, const std::vector<Eigen::Vector2d>& truth, double tolerance) {
  for (const auto& p : points) {
    EXPECT_LT((at(p) - truth.at(static_cast<std::size_t>(p.id))).norm(), tolerance)
        << "id " << p.id << " at " << at(p).transpose() << ", truly "
        << truth[static_cast<std::size_t>(p.id)].transpose();
  }
}

using Ids = std::vector<int>;

// ------------------------------------------------------------------------------------------
// accuracy

struct Accuracy {
  double ours = 0, dot2 = 0,
         nees = 0;  // px rms per axis, px rms per axis, mean square of error/sigma
  int missing = 0;
};
Accuracy accuracy(double radius_px, const SyntheticCameraOptions& options, int n = 200) {
  const DotTarget target = single(radius_px * kZ / 600);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  SyntheticCamera camera(kCamera, target, options);
  Image image;
  Accuracy a;
  for (int i = 0; i < n; ++i) {
    SyntheticView view =
        viewOf(poseAt({0.2 * unit(random), 0.15 * unit(random), kZ},
                      0.6 * Eigen::Vector3d(unit(random), unit(random), unit(random))));
    view.frame = static_cast<std::uint64_t>(i);
    camera.render(view, image);
    const Eigen::Vector2d truth = camera.ellipse(view.cMo, 0)->centre;
    DotTracker tracker({truth});
    const Points points = tracker.track(image, {});
    if (points.empty()) {
      ++a.missing;
      continue;
    }
    const double error2 = (at(points[0]) - truth).squaredNorm() / 2;
    a.ours += error2 / n;
    a.nees += error2 / (points[0].sigma_px * points[0].sigma_px) / n;
    vpDot2 dot;
    dot.initTracking(image, vpImagePoint(truth.y(), truth.x()));
    a.dot2 += (Eigen::Vector2d(dot.getCog().get_u(), dot.getCog().get_v()) - truth).squaredNorm() /
              (2 * n);
  }
  a.ours = std::sqrt(a.ours);
  a.dot2 = std::sqrt(a.dot2);
  return a;
}

TEST(DotTracker, centroids_are_ten_times_better_than_vpDot2s) {
  struct Row {
    double radius_px, most_rms_px;
  };
  for (const Row& row :
       {Row{3, 0.016}, Row{5, 0.011}, Row{8, 0.008}, Row{14, 0.006}, Row{25, 0.005}}) {
    const Accuracy a = accuracy(row.radius_px, {});
    std::printf("r %4.0f px: %.4f px rms, vpDot2 %.4f, nees %.2f\n", row.radius_px, a.ours, a.dot2,
                a.nees);
    EXPECT_EQ(a.missing, 0);
    EXPECT_LT(a.ours, row.most_rms_px) << row.radius_px;
    EXPECT_LT(a.ours, a.dot2 / 10) << row.radius_px;
    EXPECT_LT(a.nees, 1.5) << "sigma_px is too small at " << row.radius_px;
  }
}

TEST(DotTracker, centroids_are_five_times_better_in_gray_noise_and_sigma_says_how_good) {
  SyntheticCameraOptions noisy;
  noisy.gray_noise = 3;
  for (const double radius_px : {3, 5, 8, 14, 25}) {
    const Accuracy a = accuracy(radius_px, noisy);
    std::printf("r %4.0f px: %.4f px rms, vpDot2 %.4f, nees %.2f\n", radius_px, a.ours, a.dot2,
                a.nees);
    EXPECT_EQ(a.missing, 0);
    EXPECT_LT(a.ours, a.dot2 / (radius_px > 14 ? 4.5 : 5)) << radius_px;
    EXPECT_GT(a.nees, 0.4) << radius_px;
    EXPECT_LT(a.nees, 1.6) << radius_px;
  }
}

TEST(DotTracker, uneven_light_does_not_move_centroids) {
  SyntheticCameraOptions uneven;
  uneven.vignetting = 0.5;
  const Accuracy a = accuracy(14, uneven);
  EXPECT_EQ(a.missing, 0);
  EXPECT_LT(a.ours, 0.05);
  EXPECT_LT(a.nees, 3);
}

TEST(DotTracker, motion_blur_does_not_move_centroids) {
  SyntheticCameraOptions options;
  options.exposure_s = 0.02;
  SyntheticView view = viewOf(shifted(30, 10));
  view.twist.linear = {0.3, 0.2, 0};  // 6 px by 4 px
  DotTracker tracker(centres(square(), view.cMo));
  const Points points = tracker.track(shot(square(), view, options), {});
  EXPECT_EQ(ids(points), Ids({0, 1, 2, 3}));
  expectTrue(points, centres(square(), view.cMo), 0.02);
}

TEST(DotTracker, outline_is_that_of_the_dot) {
  const auto cMo = poseAt({0.02, -0.03, 0.5}, {0.5, -0.3, 0.2});
  const Ellipse truth = *SyntheticCamera(kCamera, single(0.02)).ellipse(cMo, 0);
  DotTracker tracker({truth.centre});
  tracker.track(shot(single(0.02), viewOf(cMo)), {});
  const auto seen = tracker.ellipse(0);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->area() / truth.area(), 1, 0.005);
  EXPECT_LT((seen->semiAxes() - truth.semiAxes()).norm(), 0.05);
  EXPECT_FALSE(tracker.ellipse(1));
  EXPECT_FALSE(tracker.ellipse(-1));
}

// ---------------------------------------------------------------------------------------------
// start

TEST(DotTracker, a_start_position_may_be_beside_its_dot) {
  const auto cMo = shifted(0, 0);
  std::vector<Eigen::Vector2d> starts = centres(square(), cMo);
  for (auto& start : starts) start += Eigen::Vector2d(24, -18);
  DotTracker tracker(starts);
  const Points points = tracker.track(shot(square(), viewOf(cMo)), {});
  EXPECT_EQ(ids(points), Ids({0, 1, 2, 3}));
  expectTrue(points, centres(square(), cMo), 0.02);
}

TEST(DotTracker, a_dot_that_is_missing_at_first_starts_later) {
  const auto cMo = shifted(0, 0);
  const auto hides = *SyntheticCamera(kCamera, square()).occluderOf(cMo, 2);
  DotTracker tracker(centres(square(), cMo));
  EXPECT_EQ(ids(tracker.track(shot(square(), viewOf(cMo, {hides})), {})), Ids({0, 1, 3}));
  EXPECT_EQ(ids(tracker.track(shot(square(), viewOf(cMo)), {})), Ids({0, 1, 2, 3}));
}

/// Two dots of a radius side by side, `gap_px` between their outlines, the first at the middle.
DotTarget pair(double radius_px, double gap_px) {
  const double metres = kZ / 600;
  return {{{0, 0, 0}, {(2 * radius_px + gap_px) * metres, 0, 0}}, radius_px * metres};
}

/// The image with a part of the first dot painted over, so that it cannot be measured.
Image halved(Image image, double radius_px) {
  for (int v = 0; v < static_cast<int>(image.getHeight()); ++v) {
    for (int u = 319; u > 319 - 2 * radius_px; --u) image[v][u] = 220;
  }
  return image;
}

TEST(DotTracker, never_starts_on_a_neighbour_while_a_blob_lies_under_the_start) {
  for (const double radius_px : {6.0, 9.0, 20.0}) {
    const DotTarget both = pair(radius_px, 3);
    const Image image = halved(shot(both, viewOf(shifted(0, 0))), radius_px);
    // The neighbour is whole, and found by one who means it.
    const auto truth = centres(both, shifted(0, 0));
    EXPECT_EQ(DotTracker({truth[1]}).track(image, {}).size(), 1u) << radius_px;
    for (const Eigen::Vector2d& off : {Eigen::Vector2d(1, 0), {2, 1}, {-1, -2}}) {
      DotTracker tracker({truth[0] + off});
      EXPECT_TRUE(tracker.track(image, {}).empty()) << radius_px << ", " << off.transpose();
      const Points later = tracker.track(shot(single(both.radius), viewOf(shifted(0, 0))), {});
      EXPECT_EQ(ids(later), Ids({0}));
      expectTrue(later, truth, 0.05);
    }
  }
}

TEST(DotTracker, never_starts_beside_a_blob_of_two_that_touch) {
  DotTarget three = pair(10, -2);
  three.points.emplace_back(0, 24 * kZ / 600, 0);
  const auto truth = centres(three, shifted(0, 0));
  const Image image = shot(three, viewOf(shifted(0, 0)));
  DotTracker tracker({truth[0], truth[2]});
  const Points points = tracker.track(image, {});
  EXPECT_EQ(ids(points), Ids({1}));
  expectTrue(points, {truth[0], truth[2]}, 0.05);
}

TEST(DotTracker, is_not_found_again_on_a_neighbour_while_a_part_of_it_is_in_view) {
  const double radius_px = 8;
  const DotTarget both = pair(radius_px, 4), alone = single(both.radius);
  const auto truth = centres(both, shifted(0, 0));
  for (const int hiddenFor : {0, 1, 20}) {
    DotTracker tracker({truth[0]});
    ASSERT_EQ(tracker.track(shot(alone, viewOf(shifted(0, 0))), {}).size(), 1u);
    for (int k = 0; k < hiddenFor; ++k) tracker.track(Image(480, 640, 220), {});
    for (int k = 0; k < 5; ++k) {
      const Image image = halved(shot(both, viewOf(shifted(0, 0))), radius_px);
      EXPECT_TRUE(tracker.track(image, {{0, truth[0].x(), truth[0].y(), 1}}).empty());
    }
    EXPECT_EQ(tracker.track(shot(alone, viewOf(shifted(0, 0))), {}).size(), 1u);
  }
}

TEST(DotTracker, a_start_beside_a_dot_on_a_small_plate_is_no_start_on_the_plate) {
  Image image(480, 640, 40);
  const Image plate = shot(single(), viewOf(shifted(0, 0)));
  for (int v = 180; v < 300; ++v) {
    for (int u = 250; u < 390; ++u) image[v][u] = plate[v][u];
  }
  DotTracker tracker({{340, 257}});
  const Points points = tracker.track(image, {});
  EXPECT_EQ(ids(points), Ids({0}));
  expectTrue(points, centres(single(), shifted(0, 0)), 0.05);
}

TEST(DotTracker, polarity_is_as_asked_or_found_out) {
  SyntheticCameraOptions light;
  std::swap(light.background, light.dot);
  const auto cMo = shifted(0, 0);
  const auto found = [&](const SyntheticCameraOptions& look, DotPolarity polarity) {
    DotTrackerOptions options;
    options.polarity = polarity;
    DotTracker tracker(centres(square(), cMo), options);
    const Points points = tracker.track(shot(square(), viewOf(cMo), look), {});
    expectTrue(points, centres(square(), cMo), 0.02);
    return points.size();
  };
  EXPECT_EQ(found({}, DotPolarity::automatic), 4u);
  EXPECT_EQ(found({}, DotPolarity::darkOnLight), 4u);
  EXPECT_EQ(found({}, DotPolarity::lightOnDark), 0u);
  EXPECT_EQ(found(light, DotPolarity::automatic), 4u);
  EXPECT_EQ(found(light, DotPolarity::lightOnDark), 4u);
  EXPECT_EQ(found(light, DotPolarity::darkOnLight), 0u);
}

TEST(DotTracker, a_blank_image_shows_nothing) {
  Image blank(480, 640, 220);
  DotTracker byStart(centres(square(), shifted(0, 0)));
  EXPECT_TRUE(byStart.track(blank, {}).empty());
  DotTracker byPattern(square());
  EXPECT_TRUE(byPattern.track(blank, {}).empty());
  // Lost in it after having been there, and found again.
  const Image image = shot(square(), viewOf(shifted(0, 0)));
  EXPECT_EQ(byStart.track(image, {}).size(), 4u);
  EXPECT_TRUE(byStart.track(blank, {}).empty());
  EXPECT_EQ(byStart.track(image, {}).size(), 4u);
}

TEST(DotTracker, images_of_no_or_another_size_show_nothing_and_do_no_harm) {
  const auto cMo = shifted(0, 0);
  const Image image = shot(square(), viewOf(cMo));
  DotTracker tracker(centres(square(), cMo));
  EXPECT_TRUE(tracker.track(Image(), {}).empty());
  EXPECT_EQ(tracker.track(image, {}).size(), 4u);
  EXPECT_TRUE(tracker.track(Image(48, 64, 220), {}).empty());
  EXPECT_TRUE(tracker.track(Image(1, 1, 220), {}).empty());
  EXPECT_TRUE(tracker.track(Image(960, 1280, 220), {}).empty());
  EXPECT_EQ(tracker.track(image, {}).size(), 4u);
  DotTracker tiny(centres(square(), cMo));
  EXPECT_TRUE(tiny.track(Image(1, 1, 220), {}).empty());
}

TEST(DotTracker, random_pixels_show_nothing) {
  Image image(480, 640);
  std::mt19937 random(5);
  for (unsigned i = 0; i < image.getSize(); ++i)
    image.bitmap[i] = static_cast<unsigned char>(random());
  EXPECT_TRUE(DotTracker(centres(square(), shifted(0, 0))).track(image, {}).empty());
  EXPECT_TRUE(DotTracker(square()).track(image, {}).empty());
}

TEST(DotTracker, senseless_set_ups_are_refused) {
  EXPECT_THROW(DotTracker(std::vector<Eigen::Vector2d>{}), std::invalid_argument);
  EXPECT_THROW(DotTracker(std::vector<Eigen::Vector2d>{{std::nan(""), 1}}), std::invalid_argument);
  EXPECT_THROW(DotTracker{single()}, std::invalid_argument);
  EXPECT_THROW(DotTracker(DotTarget{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, 0.1}),
               std::invalid_argument);
  DotTarget bent = square();
  bent.points[2].z() = 0.01;
  EXPECT_THROW(DotTracker{bent}, std::invalid_argument);
  EXPECT_THROW(DotTracker{square(0.0801)}, std::invalid_argument);  // its dots overlap
  EXPECT_NO_THROW(DotTracker{square(0.0799)});
  DotTrackerOptions options;
  options.most_radius_px = 1000;
  EXPECT_THROW(DotTracker(square(), options), std::invalid_argument);
  options.most_radius_px = std::nan("");
  EXPECT_THROW(DotTracker(square(), options), std::invalid_argument);
}

// ------------------------------------------------------------------------------------------
// tracking

TEST(DotTracker, follows_dots_that_move_turn_and_grow) {
  DotTracker tracker(centres(square(), poseAt({0, 0, 1})));
  for (int k = 0; k < 120; ++k) {
    const auto cMo =
        poseAt({0.05 * std::sin(0.1 * k), 0.02 * std::cos(0.07 * k) - 0.02, 1 - 0.0045 * k},
               {0.3 * std::sin(0.05 * k), 0.004 * k, -0.02 * k});
    const Points points = tracker.track(shot(square(), viewOf(cMo)), {});
    ASSERT_EQ(ids(points), Ids({0, 1, 2, 3})) << "frame " << k;
    expectTrue(points, centres(square(), cMo), 0.03);
  }
}

TEST(DotTracker, a_dot_cut_by_the_border_is_dropped_not_biased) {
  DotTracker tracker(centres(square(), shifted(-100, 0)));
  std::size_t fewest = 4;
  for (double u = -100; u > -280; u -= 3) {
    const Points points = tracker.track(shot(square(), viewOf(shifted(u, 0))), {});
    expectTrue(points, centres(square(), shifted(u, 0)), 0.03);
    fewest = std::min(fewest, points.size());
  }
  EXPECT_EQ(fewest, 2u);
}

TEST(DotTracker, a_partly_hidden_dot_is_not_reported) {
  const SyntheticCamera camera(kCamera, square());
  const auto cMo = shifted(0.3, 0.2);
  const auto truth = centres(square(), cMo);
  for (const double gray : {220.0, 128.0, 20.0}) {  // like the plate, between, like the dot
    DotTracker tracker(truth);
    ASSERT_EQ(tracker.track(shot(square(), viewOf(cMo)), {}).size(), 4u);
    // A rectangle slides over dot 1 from the left, slowly enough for its size to change only
    // little.
    for (int right = -16; right <= 12; ++right) {
      const Occluder o{static_cast<int>(truth[1].x()) - 60, static_cast<int>(truth[1].y()) - 30,
                       60 + right, 60, gray};
      const Points points = tracker.track(shot(square(), viewOf(cMo, {o})), {});
      if (right > -9) {
        EXPECT_EQ(ids(points), Ids({0, 2, 3})) << "gray " << gray << ", " << right;
      }
      expectTrue(points, truth, 0.3);
    }
    EXPECT_EQ(ids(tracker.track(shot(square(), viewOf(cMo)), {})), Ids({0, 1, 2, 3}));
  }
}

TEST(DotTracker, a_hidden_dot_is_found_again_elsewhere_when_it_is_expected_there) {
  const SyntheticCamera camera(kCamera, square());
  DotTracker tracker(centres(square(), shifted(0, 0)));
  ASSERT_EQ(tracker.track(shot(square(), viewOf(shifted(0, 0))), {}).size(), 4u);
  for (double u = 4; u <= 120; u += 4) {
    const auto hides = *camera.occluderOf(shifted(u, 0), 1);
    const auto cMo = shifted(u, 0);
    const Points points = tracker.track(shot(square(), viewOf(cMo, {hides})), {});
    EXPECT_EQ(ids(points), Ids({0, 2, 3})) << u;
    expectTrue(points, centres(square(), cMo), 0.03);
  }
  const auto cMo = shifted(124, 0);
  const auto truth = centres(square(), cMo);
  EXPECT_EQ(ids(tracker.track(shot(square(), viewOf(cMo)), {})), Ids({0, 2, 3}))
      << "124 px from where it was last seen";
  const std::vector<ExpectedPoint> expected{{1, truth[1].x() + 15, truth[1].y() - 15, 10}};
  const Points points = tracker.track(shot(square(), viewOf(cMo)), expected);
  EXPECT_EQ(ids(points), Ids({0, 1, 2, 3}));
  expectTrue(points, truth, 0.03);
}

TEST(DotTracker, the_search_grows_with_the_uncertainty_of_the_expectation) {
  const auto found = [](double sigma_px) {
    const auto truth = centres(single(), shifted(100, 0));
    DotTracker tracker(centres(single(), shifted(0, 0)));
    tracker.track(shot(single(), viewOf(shifted(0, 0))), {});
    tracker.track(Image(480, 640, 220), {});
    return tracker
        .track(shot(single(), viewOf(shifted(100, 0))),
               {{0, truth[0].x() + 90, truth[0].y(), sigma_px}})
        .size();
  };
  EXPECT_EQ(found(1), 0u);
  EXPECT_EQ(found(30), 1u);
}

TEST(DotTracker, a_wrong_or_senseless_expectation_does_not_lose_a_dot_in_view) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  for (const ExpectedPoint& wrong :
       {ExpectedPoint{0, 500, 400, 1}, ExpectedPoint{0, nan, 3, 1}, ExpectedPoint{0, 3, 3, inf},
        ExpectedPoint{0, 1e300, -1e300, 5}, ExpectedPoint{0, 3, 3, -1},
        ExpectedPoint{77, 3, 3, 1}}) {
    DotTracker tracker(centres(single(), shifted(0, 0)));
    tracker.track(shot(single(), viewOf(shifted(0, 0))), {});
    const Points points = tracker.track(shot(single(), viewOf(shifted(5, 0))), {wrong});
    EXPECT_EQ(ids(points), Ids({0}));
    expectTrue(points, centres(single(), shifted(5, 0)), 0.03);
  }
}

TEST(DotTracker, a_jump_is_followed_within_the_gate_and_refused_beyond) {
  const auto after = [](double jump) {
    DotTracker tracker(centres(single(), shifted(0, 0)));
    tracker.track(shot(single(), viewOf(shifted(0, 0))), {});
    const Points points = tracker.track(shot(single(), viewOf(shifted(jump, 0))), {});
    expectTrue(points, centres(single(), shifted(jump, 0)), 0.03);
    return points.size();
  };
  EXPECT_EQ(after(20), 1u);
  EXPECT_EQ(after(40), 1u);
  EXPECT_EQ(after(60), 0u);
  EXPECT_EQ(after(80), 0u);
}

TEST(DotTracker, dots_of_different_size_that_swap_places_are_refused) {
  // Two plates of one dot each, drawn into one image.
  const auto image = [](double left, double right) {
    const DotTarget target{{{-0.05, 0, 0}}, left}, other{{{0.05, 0, 0}}, right};
    Image a = shot(target, viewOf(shifted(0, 0)));
    const Image b = shot(other, viewOf(shifted(0, 0)));
    for (unsigned i = 0; i < a.getSize(); ++i) a.bitmap[i] = std::min(a.bitmap[i], b.bitmap[i]);
    return a;
  };
  DotTracker tracker({{269.5, 239.5}, {369.5, 239.5}});
  EXPECT_EQ(tracker.track(image(0.01, 0.016), {}).size(), 2u);
  EXPECT_EQ(tracker.track(image(0.016, 0.01), {}).size(), 0u);
  EXPECT_EQ(tracker.track(image(0.01, 0.016), {}).size(), 2u);
}

TEST(DotTracker, a_hidden_dots_id_never_goes_to_its_neighbour) {
  const DotTarget target{{{-0.025, 0, 0}, {0.025, 0, 0}}, 0.014};  // 50 px apart
  const SyntheticCamera camera(kCamera, target);
  for (const int hidden : {0, 1}) {
    DotTracker tracker(centres(target, shifted(0, 0)));
    ASSERT_EQ(tracker.track(shot(target, viewOf(shifted(0, 0))), {}).size(), 2u);
    for (double u = 2; u < 60; u += 2) {
      const auto cMo =
          shifted(hidden == 0 ? -u : u, 0);  // the other one passes over the lost place
      const auto truth = centres(target, cMo);
      const auto hides = *camera.occluderOf(cMo, static_cast<std::size_t>(hidden));
      const Points points = tracker.track(shot(target, viewOf(cMo, {hides})), {});
      EXPECT_EQ(ids(points), Ids({1 - hidden})) << u;
      expectTrue(points, truth, 0.05);
    }
  }
}

/// The image by `gain` times as much light.
Image lit(Image image, double gain) {
  for (unsigned i = 0; i < image.getSize(); ++i) {
    image.bitmap[i] = static_cast<unsigned char>(std::min(255.0, gain * image.bitmap[i]));
  }
  return image;
}

TEST(DotTracker, dots_are_found_again_after_the_light_was_switched) {
  SyntheticCameraOptions noisy;
  noisy.gray_noise = 1;
  for (const auto& [first, then] : {std::pair(1.0, 0.35), {1.0, 0.5}, {0.4, 1.0}, {0.3, 1.1}}) {
    const auto cMo = shifted(0, 0);
    const auto truth = centres(square(), cMo);
    const Image image = shot(square(), viewOf(cMo), noisy);
    DotTracker tracker(truth);
    ASSERT_EQ(tracker.track(lit(image, first), {}).size(), 4u);
    int images = 0;
    for (Points points; points.size() < 4 && images < 30; ++images) {
      points = tracker.track(lit(image, then), {});
      expectTrue(points, truth, 0.05);
    }
    EXPECT_LE(images, 20) << first << " -> " << then;
    EXPECT_EQ(tracker.track(lit(image, then), {}).size(), 4u);
  }
}

TEST(DotTracker, dots_stay_while_the_light_fades_and_returns) {
  const auto cMo = shifted(0, 0);
  DotTracker tracker(centres(square(), cMo));
  for (int k = 0; k <= 80; ++k) {
    const double gain = std::pow(0.2, 1 - std::abs(k - 40) / 40.0);
    const Points points = tracker.track(lit(shot(square(), viewOf(cMo)), gain), {});
    EXPECT_EQ(points.size(), 4u) << k;
    expectTrue(points, centres(square(), cMo), 0.1);
  }
}

TEST(DotTracker, nothing_is_found_in_place_of_dots_that_stay_hidden_under_switched_light) {
  const SyntheticCamera camera(kCamera, square());
  const auto cMo = shifted(0, 0);
  const auto truth = centres(square(), cMo);
  SyntheticCameraOptions noisy;
  noisy.gray_noise = 3;
  DotTracker tracker(truth);
  ASSERT_EQ(tracker.track(shot(square(), viewOf(cMo), noisy), {}).size(), 4u);
  for (int k = 0; k < 100; ++k) {
    SyntheticView view = viewOf(cMo, {*camera.occluderOf(cMo, 1)});
    view.frame = static_cast<std::uint64_t>(k);
    const Points points = tracker.track(lit(shot(square(), view, noisy), k < 50 ? 0.4 : 1), {});
    for (const auto& p : points) EXPECT_NE(p.id, 1);
    expectTrue(points, truth, 0.1);
  }
}

TEST(DotTracker, nothing_is_printed) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const SyntheticCamera camera(kCamera, square());
  DotTracker tracker(square());
  for (int k = 0; k < 20; ++k) {
    std::vector<Occluder> hides;
    if (k > 5 && k < 12) hides = {*camera.occluderOf(shifted(8 * k, 0), 1)};
    tracker.track(shot(square(), viewOf(shifted(8 * k, 0), hides)), {});
  }
  tracker.track(Image(480, 640, 220), {});
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// -------------------------------------------------------------------------------------------
// pattern

struct PatternCount {
  int found = 0, right = 0;
};
PatternCount patternsFound(const DotTarget& target, double roll, double radiusKnown,
                           const SyntheticCameraOptions& options = {}, bool extraBlobs = false) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> unit(-1, 1);
  PatternCount count;
  for (int n = 0; n < 50; ++n) {
    const auto cMo = poseAt({0.08 * unit(random), 0.04 * unit(random), 0.7 + 0.15 * unit(random)},
                            {0.5 * unit(random), 0.5 * unit(random), roll * unit(random)});
    SyntheticView view = viewOf(cMo);
    view.frame = static_cast<std::uint64_t>(n);
    Image image = shot(target, view, options);
    if (extraBlobs) {
      const DotTarget blobs{{{-0.3, 0.17, 0}, {0.31, -0.2, 0}, {0.3, 0.2, 0}}, 0.012};
      const Image other = shot(blobs, viewOf(poseAt({0, 0, 0.65})));
      for (unsigned i = 0; i < image.getSize(); ++i) {
        image.bitmap[i] = std::min(image.bitmap[i], other.bitmap[i]);
      }
    }
    DotTracker tracker(DotTarget{target.points, radiusKnown});
    const Points points = tracker.track(image, {});
    const auto truth = centres(target, cMo);
    if (points.size() != target.points.size()) continue;
    ++count.found;
    bool isRight = true;
    for (const auto& p : points)
      isRight &= (at(p) - truth[static_cast<std::size_t>(p.id)]).norm() < 0.1;
    count.right += isRight;
  }
  return count;
}

TEST(DotTracker, finds_and_orders_a_square_plate_that_is_nearly_upright) {
  const PatternCount count = patternsFound(square(0.01), 0.6, 0.01);
  EXPECT_EQ(count.found, 50);
  EXPECT_EQ(count.right, 50);
}

TEST(DotTracker, finds_and_orders_an_uneven_plate_at_any_angle) {
  const DotTarget trapezium{{{-0.05, -0.08, 0}, {0.08, -0.08, 0}, {0.1, 0.07, 0}, {-0.09, 0.05, 0}},
                            0.01};
  for (const double radius : {0.01, 0.0}) {
    const PatternCount count = patternsFound(trapezium, 3, radius);
    EXPECT_EQ(count.found, 50) << radius;
    EXPECT_EQ(count.right, 50) << radius;
  }
}

TEST(DotTracker, finds_and_orders_a_plate_among_other_blobs_in_noise) {
  SyntheticCameraOptions noisy;
  noisy.gray_noise = 3;
  noisy.vignetting = 0.3;
  DotTarget five = square(0.01);
  five.points.emplace_back(0.03, 0.0, 0);
  for (const auto& target : {square(0.01), five}) {
    const PatternCount count = patternsFound(target, 0.5, 0.01, noisy, true);
    EXPECT_EQ(count.found, 50) << target.points.size();
    EXPECT_EQ(count.right, 50) << target.points.size();
  }
}

TEST(DotTracker, finds_light_dots_on_a_dark_plate) {
  SyntheticCameraOptions light;
  std::swap(light.background, light.dot);
  const PatternCount count = patternsFound(square(0.01), 0.6, 0.01, light);
  EXPECT_EQ(count.found, 50);
  EXPECT_EQ(count.right, 50);
}

TEST(DotTracker, a_square_plate_turned_by_a_quarter_is_read_upright) {
  const auto cMo = poseAt({0, 0, 0.6}, {0, 0, M_PI / 2});
  DotTracker tracker(square(0.01));
  const Points points = tracker.track(shot(square(0.01), viewOf(cMo)), {});
  ASSERT_EQ(points.size(), 4u);
  expectTrue(points, centres(square(0.01), poseAt({0, 0, 0.6})), 0.05);
}

TEST(DotTracker, a_plate_whose_dot_may_be_either_of_two_is_waited_for) {
  const DotTarget plate = square(0.01);
  DotTarget doubled = plate;
  doubled.points.emplace_back(0.08 + 26 * kZ / 600, 0.08, 0);  // beside dot 2, 6 px between them
  const auto truth = centres(plate, shifted(0, 0));
  Image image = shot(doubled, viewOf(shifted(0, 0)));
  DotTracker tracker(plate);
  EXPECT_TRUE(tracker.track(image, {}).empty());
  // Neither when the dot itself is partly hidden, and so no measured one.
  for (int v = 300; v < 340; ++v) image[v][static_cast<int>(truth[2].x()) - 6] = 220;
  EXPECT_TRUE(tracker.track(image, {}).empty());
  const Points points = tracker.track(shot(plate, viewOf(shifted(0, 0))), {});
  EXPECT_EQ(ids(points), Ids({0, 1, 2, 3}));
  expectTrue(points, truth, 0.05);
}

TEST(DotTracker, a_plate_shown_only_in_part_is_waited_for) {
  DotTracker tracker(square(0.01));
  EXPECT_TRUE(tracker.track(shot(square(0.01), viewOf(shifted(250, 0))), {}).empty());
  EXPECT_EQ(tracker.track(shot(square(0.01), viewOf(shifted(100, 0))), {}).size(), 4u);
}

// --------------------------------------------------------------------------------------- real
// images

TEST(DotTracker, follows_the_four_white_dots_through_all_of_mire_2) {
  const std::string folder = vpIoTools::getViSPImagesDataPath() + "/mire-2";
  if (!std::ifstream(folder + "/image.0001.pgm")) {
    GTEST_SKIP() << "no images in '" << folder << "': install visp-images-data";
  }
  const DotTarget plate{{{-0.07, -0.06, 0}, {0.07, -0.06, 0}, {0.07, 0.06, 0}, {-0.07, 0.06, 0}},
                        0};
  const std::vector<Eigen::Vector2d> starts{{86, 180}, {216, 168}, {242, 248}, {93, 267}};
  DotTracker byStart(starts), byPattern(plate);
  std::vector<std::vector<Eigen::Vector2d>> path(4);
  std::vector<double> jerk;
  for (int k = 1; k <= 501; ++k) {
    char name[32];
    std::snprintf(name, sizeof name, "/image.%04d.pgm", k);
    Image image;
    vpImageIo::read(image, folder + name);
    const Points points = byStart.track(image, {});
    const Points alike = byPattern.track(image, {});
    ASSERT_EQ(ids(points), Ids({0, 1, 2, 3})) << "frame " << k;
    ASSERT_EQ(ids(alike), Ids({0, 1, 2, 3})) << "frame " << k;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT((at(points[i]) - at(alike[i])).norm(), 0.1);
      EXPECT_LT(points[i].sigma_px, 0.2);
      auto& p = path[i];
      p.push_back(at(points[i]));
      const std::size_t n = p.size();
      if (n == 1) {
        EXPECT_LT((p[0] - starts[i]).norm(), 3);
      }
      if (n < 4) continue;
      // White noise of sigma per axis gives third differences of sqrt(2 * 20) sigma.
      jerk.push_back((p[n - 1] - 3 * p[n - 2] + 3 * p[n - 3] - p[n - 4]).norm() / std::sqrt(40.0));
    }
  }
  std::sort(jerk.begin(), jerk.end());
  const double median = jerk[jerk.size() / 2];
  std::printf("mire-2: median roughness %.3f px\n", median);
  EXPECT_LT(median, 0.15);
}

}  // namespace
}  // namespace depthservo
