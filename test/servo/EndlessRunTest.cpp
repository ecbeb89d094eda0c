// Who does not arm a robot can wait for days: nothing that the loop keeps may grow.

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <utility>

#include "depthservo/servo/ServoLoop.h"
#include "robots/makeRobot.h"

namespace depthservo {
namespace {

constexpr double kPeriod_s = 1. / 30, kZ = 1.5;
constexpr std::size_t kImages = 230000;  // two hours

/// Four points before a camera that swings aside, by a robot that nobody has armed until late.
class WaitingRig : public Rig {
 public:
  WaitingRig(std::size_t images, std::size_t armedAt)
      : images_(images), armedAt_(armedAt), robot_(makeRobot({}, {})) {
    source_.place = "test";
    source_.camera = {640, 480, 600, 600, 319.5, 239.5};
    source_.hasImages = false;
    source_.ids = {0, 1, 2, 3};
    source_.frameRate = source_.fastestRate = 1 / kPeriod_s;
    source_.rowPeriod_s = kPeriod_s;
  }

  const ObservedSource& source() const override { return source_; }
  std::optional<Exposure> next(Listener*) override {
    if (image_ == images_) return std::nullopt;
    Exposure exposure;
    exposure.time_s = time();
    const double x = 0.3 * std::sin(time());
    for (int id = 0; id < 4; ++id) {
      const double X = id % 2 ? 0.2 : -0.2, Y = id < 2 ? 0.2 : -0.2;
      const auto pixel = source_.camera.toPixel((X - x) / kZ, Y / kZ);
      exposure.points.push_back({id, pixel.x(), pixel.y(), 0.5});
    }
    if (image_ % 7 == 0) exposure.points.pop_back();  // which is told in events
    ++image_;
    return exposure;
  }
  void readOdometry(MotionBuffer& odometry, double time_s) override {
    rows_.assign(1, {time_s, {{0.3 * std::cos(time_s), 0, 0}, {0, 0, 0}}});
    odometry.push(time_s, rows_[0].twist);
  }
  const std::vector<OdometryRow>& odometry() const override { return rows_; }
  const RobotModel* robot() const override { return robot_.get(); }
  bool isHeld() const override { return image_ < armedAt_; }
  double time() const override { return static_cast<double>(image_) * kPeriod_s; }

 private:
  ObservedSource source_;
  std::size_t images_, armedAt_, image_ = 0;
  std::vector<OdometryRow> rows_;
  std::unique_ptr<SimulatedRobot> robot_;
};

class MemoryWatcher : public RunWatcher {
 public:
  bool onFrame(const RunFrame& frame) override {
    mostFrames = std::max(mostFrames, frame.log.frames.size());
    mostEvents = std::max(mostEvents, frame.log.events.size());
    if (++images_ == kImages / 2) before_ = mallinfo2().uordblks;
    if (images_ == kImages - 1) after_ = mallinfo2().uordblks;
    if (frame.log.frames.size() <= std::exchange(frames_, frame.log.frames.size())) told_ = 0;
    events += frame.log.events.size() - std::exchange(told_, frame.log.events.size());
    return true;
  }
  double growth() const { return static_cast<double>(after_) - static_cast<double>(before_); }

  std::size_t mostFrames = 0, mostEvents = 0, events = 0;

 private:
  std::size_t images_ = 0, before_ = 0, after_ = 0, frames_ = 0, told_ = 0;
};

ServoGoal goal() {
  ServoGoal goal;
  goal.pixels = {{200, 360}, {440, 360}, {200, 120}, {440, 120}};
  goal.Z.assign(4, kZ);
  return goal;
}

ObservationOptions observation() {
  ObservationOptions options;
  options.depth.errors = ErrorKind::declared;
  options.depth.initial = 1;
  return options;
}

TEST(EndlessRun, an_unarmed_robot_waits_in_bounded_memory) {
  WaitingRig rig(kImages, kImages + 1);
  ServoLoop loop(rig, observation(), {}, goal());
  MemoryWatcher watcher;
  const RunLog log = loop.run(&watcher);
  EXPECT_EQ(log.outcome, Outcome::timeout);
  EXPECT_LE(watcher.mostFrames, 600u);
  EXPECT_LE(watcher.mostEvents, 1300u);
  EXPECT_GT(watcher.events, kImages / 10) << "all are heard, though they are not kept";
  EXPECT_LT(watcher.growth(), 256e3) << "bytes in the second hour";
  for (const auto& [stage, seconds] : log.timings) EXPECT_LE(seconds.size(), kImages / 2) << stage;
}

TEST(EndlessRun, all_frames_are_kept_from_the_moment_it_is_armed) {
  constexpr std::size_t kArmed = 3000;
  WaitingRig rig(kArmed + 2000, kArmed);
  ServoLoop loop(rig, observation(), {}, goal());
  const RunLog log = loop.run();
  ASSERT_FALSE(log.frames.empty());
  EXPECT_LE(log.frames.front().time_s, static_cast<double>(kArmed) * kPeriod_s);
  for (std::size_t i = 1; i < log.frames.size(); ++i) {
    EXPECT_NEAR(log.frames[i].time_s - log.frames[i - 1].time_s, kPeriod_s, 1e-6);
  }
  EXPECT_GT(log.frames.back().time_s, static_cast<double>(kArmed) * kPeriod_s);
}

}  // namespace
}  // namespace depthservo
