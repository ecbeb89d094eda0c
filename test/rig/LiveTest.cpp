#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "depthservo/rig/LiveRig.h"
#include "depthservo/sequence/TwistStream.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::inputErrorOf;
using test::isRefusal;

constexpr double kRate = 30, kSpeed = 0.1;

/// A camera before a plate with four dots that moves to the right at a constant speed and is
/// unplugged after some images.
class UnpluggedCamera : public ImageSource {
 public:
  UnpluggedCamera(const PinholeCamera& camera, const DotTarget& plate, std::size_t images)
      : camera_(camera, plate), images_(images) {}

  ImageStatus next(TimedImage& image) override {
    if (taken_ == images_) return ImageStatus::ended;
    image.time_s = static_cast<double>(taken_) / kRate - (taken_ == setBackAt ? 0.5 : 0);
    SyntheticView view;
    view.cMo.translation() =
        Eigen::Vector3d(0.1 - kSpeed * static_cast<double>(taken_) / kRate, 0, 1.2);
    camera_.render(view, image.image);
    if (taken_ >= smallerFrom) image.image.resize(60, 80);
    ++taken_;
    if (taken_ == skippedAt) return ImageStatus::skipped;
    return ImageStatus::image;
  }
  bool isLive() const override { return true; }
  std::string reason() const override {
    return taken_ == images_     ? "the camera gives no more images"
           : taken_ == skippedAt ? "the image is torn"
                                 : "";
  }
  std::size_t setBackAt = ~std::size_t{0}, skippedAt = ~std::size_t{0},
              smallerFrom = ~std::size_t{0};

 private:
  SyntheticCamera camera_;
  std::size_t images_, taken_ = 0;
};

class LiveTest : public testing::Test {
 protected:
  LiveTest() {
    options_.camera = {320, 240, 300, 300, 159.5, 119.5};
    options_.target.target = {{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {-0.1, 0.1, 0}, {0.1, 0.1, 0}},
                              0.03};
    std::ofstream twists(folder_ / "twists");
    for (int i = 0; i < 200; ++i) twists << i / kRate << "," << kSpeed << ",0,0,0,0,0\n";
  }
  test::TemporaryFolder folder_;
  LiveOptions options_;
};

TEST_F(LiveTest, ends_in_order_when_the_camera_is_unplugged) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 60);
  TwistStream twists(folder_ / "twists");
  const RunLog log = live(options_, camera, &twists);
  ASSERT_EQ(log.frames.size(), 60u);
  EXPECT_NE(log.reason.find("no more images"), std::string::npos) << log.reason;
  EXPECT_NE(log.events.back().what.find("no more images"), std::string::npos);
  EXPECT_EQ(log.images.size(), 2u);
  for (const FeatureRecord& feature : log.frames.back().features) {
    EXPECT_NEAR(feature.estimate.Z(), 1.2, 3 * feature.estimate.sigma_Z()) << feature.id;
    EXPECT_NEAR(feature.estimate.Z(), 1.2, 0.05) << feature.id;
  }
}

TEST_F(LiveTest, leaves_out_an_image_whose_clock_was_set_back) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 60);
  camera.setBackAt = 20;
  TwistStream twists(folder_ / "twists");
  const RunLog log = live(options_, camera, &twists);
  EXPECT_EQ(log.frames.size(), 59u);
  EXPECT_TRUE(std::any_of(log.events.begin(), log.events.end(), [](const Event& event) {
    return event.what.find("not later than the one before") != std::string::npos;
  }));
}

TEST_F(LiveTest, leaves_out_an_image_that_cannot_be_used_and_says_why) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 60);
  camera.skippedAt = 25;
  TwistStream twists(folder_ / "twists");
  const RunLog log = live(options_, camera, &twists);
  EXPECT_EQ(log.frames.size(), 59u);
  const auto told = std::find_if(log.events.begin(), log.events.end(), [](const Event& event) {
    return event.what == "the image is torn";
  });
  ASSERT_NE(told, log.events.end());
  EXPECT_NEAR(told->time_s, 23 / kRate, 1e-9);
}

/// Watches whether an event is there with the image it belongs to.
class EventWatcher : public RunWatcher {
 public:
  bool onFrame(const RunFrame& frame) override {
    for (const Event& event : frame.log.events) seen += event.what == "the image is torn";
    mostFrames = std::max(mostFrames, frame.log.frames.size());
    return frame.log.events.empty() || seen == 0;
  }
  int seen = 0;
  std::size_t mostFrames = 0;
};

TEST_F(LiveTest, tells_what_happens_with_the_image_at_which_old_ones_are_forgotten) {
  constexpr std::size_t kKept = 600;
  UnpluggedCamera camera(options_.camera, options_.target.target, kKept + 20);
  camera.skippedAt = kKept + 1;
  TwistStream twists(folder_ / "twists");
  options_.keep = Keep::theLastFrames;
  EventWatcher watcher;
  live(options_, camera, &twists, &watcher);
  EXPECT_EQ(watcher.mostFrames, kKept) << "some were forgotten";
  EXPECT_EQ(watcher.seen, 1);
}

TEST_F(LiveTest, keeps_its_log_when_the_camera_changes_the_size_of_its_images) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 300);
  camera.smallerFrom = 30;
  TwistStream twists(folder_ / "twists");
  const RunLog log = live(options_, camera, &twists);
  EXPECT_EQ(log.frames.size(), 30u);
  ASSERT_EQ(log.images.size(), 2u);
  EXPECT_EQ(log.images[1].second.size(), 320u * 240u);
  EXPECT_NE(log.reason.find("320x240"), std::string::npos) << log.reason;
  EXPECT_NE(log.reason.find("80x60"), std::string::npos) << log.reason;
  const auto told = std::count_if(log.events.begin(), log.events.end(), [&](const Event& event) {
    return event.what.find("80x60") != std::string::npos;
  });
  EXPECT_EQ(told, 2);  // when it began, and the reason of the end
}

TEST_F(LiveTest, is_less_sure_of_its_depths_when_the_focal_length_is_not) {
  const auto sigma_Z = [&](double focalSigma) {
    options_.observation.focalSigma = focalSigma;
    UnpluggedCamera camera(options_.camera, options_.target.target, 60);
    TwistStream twists(folder_ / "twists");
    const DepthEstimate estimate =
        live(options_, camera, &twists).frames.back().features.at(0).estimate;
    return estimate.sigma_Z();
  };
  // Past a camera that only translates, Z is wrong by the share by which the focal length is.
  const double exact = sigma_Z(0), vague = sigma_Z(0.1);
  EXPECT_NEAR(vague, std::hypot(exact, 0.1 * 1.2), 0.02);
}

TEST_F(LiveTest, says_that_an_estimator_needs_a_known_target) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 1);
  TwistStream twists(folder_ / "twists");
  options_.observation.depth.estimator = EstimatorKind::pose;
  options_.target = {};
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, &twists); }),
                        {"'pose'", "known target", "--target"}));
  options_.target.dots = {{0, 100, 100}, {1, 200, 100}, {2, 100, 200}, {3, 200, 200}};
  options_.targetFile = "plate.yaml";
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, &twists); }),
                        {"'pose'", "four points", "plate.yaml"}));
}

TEST_F(LiveTest, does_not_take_natural_corners_for_the_target) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 1);
  TwistStream twists(folder_ / "twists");
  options_.observation.tracker = TrackerKind::klt;
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, nullptr); }),
                        {"--motion target", "klt"}));
  EXPECT_EQ(inputErrorOf([&] { live(options_, camera, &twists); }), "");
  options_.observation.depth.estimator = EstimatorKind::pose;
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, &twists); }), {"'pose'", "klt"}));
}

TEST_F(LiveTest, without_a_log_only_the_last_frames_stay_in_memory) {
  options_.keep = Keep::theLastFrames;
  UnpluggedCamera camera(options_.camera, options_.target.target, 1000);
  struct Memory : RunWatcher {
    std::size_t most = 0, seen = 0;
    bool onFrame(const RunFrame& frame) override {
      most = std::max(most, frame.log.frames.size());
      return ++seen < 1000;
    }
  } memory;
  live(options_, camera, nullptr, &memory);
  EXPECT_EQ(memory.seen, 1000u);
  EXPECT_LE(memory.most, 601u);
}

TEST_F(LiveTest, needs_something_to_track_and_a_motion) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 1);
  options_.target = {};
  options_.observation.tracker = TrackerKind::dots;
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, nullptr); }), {"no dots"}));
  options_.target.dots = {{0, 100, 100}};
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, nullptr); }), {"motion"}));
}

TEST_F(LiveTest, without_an_image_says_why) {
  UnpluggedCamera camera(options_.camera, options_.target.target, 0);
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { live(options_, camera, nullptr); }),
                        {"no image", "the camera gives no more images"}));
}

}  // namespace
}  // namespace depthservo
