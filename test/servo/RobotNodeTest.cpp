#include <gtest/gtest.h>

#include <thread>

#include "depthservo/motion/Motion.h"
#include "depthservo/motion/RpyPose.h"
#include "depthservo/servo/RobotNode.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::inputErrorOf;
using test::isRefusal;

constexpr double kRate = 30, kSpeed = 0.1;
const PinholeCamera kCamera{320, 240, 300, 300, 159.5, 119.5};
const DotTarget kPlate{{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {-0.1, 0.1, 0}, {0.1, 0.1, 0}}, 0.03};

/// From a small motion of the body, which the camera makes with it: independent of the formula.
TEST(RobotNode, camera_twist_has_the_lever_arm_and_the_tilt) {
  const Twist body{{0.4, -0.1, 0.2}, {0.3, -0.5, 0.7}};
  const Eigen::Isometry3d bTc = RpyPose{{0.2, -0.1, 0.4}, {-1.9, 0.05, -1.5}}.isometry();
  constexpr double h = 1e-4;
  const auto moved = [&](double dt) {  // pose of the camera after dt in the body of before
    Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
    const double angle = body.angular.norm() * dt;
    step.linear() = Eigen::AngleAxisd(angle, body.angular.normalized()).toRotationMatrix();
    step.translation() = body.linear * dt;
    return Eigen::Isometry3d(bTc.inverse() * step * bTc);
  };
  const Eigen::Isometry3d after = moved(h), before = moved(-h);
  const Eigen::Vector3d v = (after.translation() - before.translation()) / (2 * h);
  const Eigen::Matrix3d W = (after.linear() - before.linear()) / (2 * h);
  const Twist camera = twistOfCamera(bTc, body);
  EXPECT_TRUE(camera.linear.isApprox(v, 1e-6))
      << camera.linear.transpose() << "; " << v.transpose();
  EXPECT_TRUE(camera.angular.isApprox(Eigen::Vector3d(W(2, 1), W(0, 2), W(1, 0)), 1e-6));
}

/// A camera that moves to the right before the plate.
class MovingCamera {
 public:
  TimedImage image(int k) {
    TimedImage image;
    image.time_s = 1000 + k / kRate;
    SyntheticView view;
    view.cMo.translation() = Eigen::Vector3d(0.1 - kSpeed * k / kRate, 0, 1.2);
    camera_.render(view, image.image);
    return image;
  }

 private:
  SyntheticCamera camera_{kCamera, kPlate};
};

RobotNodeOptions playback() {
  RobotNodeOptions options;
  options.images.isPlayback = true;
  options.images.most = 1000;
  options.patience_s = 2;
  options.target.target = kPlate;
  options.observation.tracker = TrackerKind::dots;
  options.observation.rows = RowMeaning::hold;
  options.baseFromCamera = RpyPose{{0.2, -0.1, 0.4}, {-1.9, 0.05, -1.5}}.isometry();
  return options;
}

class Records : public RunWatcher {
 public:
  bool onFrame(const RunFrame& frame) override {
    frames.push_back(frame.record);
    return true;
  }
  std::vector<FrameRecord> frames;
};

TEST(RobotNode, observes_every_pushed_image_by_the_base_odometry) {
  constexpr int kImages = 30;
  const RobotNodeOptions options = playback();
  RobotNode node(options);
  Records records;
  std::thread middleware([&] {
    MovingCamera camera;
    const Twist still{{kSpeed, 0, 0}, Eigen::Vector3d::Zero()};  // of the camera
    const Eigen::Matrix3d R = options.baseFromCamera.linear();
    for (int k = 0; k < kImages; ++k) {
      node.pushBaseTwist(1000 + k / kRate, {R * still.linear, Eigen::Vector3d::Zero()});
      node.push(camera.image(k));
    }
    node.setCamera(kCamera);  // what came before waits for it
    while (node.status().images < kImages - 1) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    node.stop("enough");
  });
  node.observe(&records);
  middleware.join();
  ASSERT_GE(records.frames.size(), kImages - 1u);
  const FrameRecord& last = records.frames.back();
  ASSERT_EQ(last.features.size(), 4u);
  for (const FeatureRecord& feature : last.features) EXPECT_NEAR(feature.estimate.Z(), 1.2, 0.06);
  EXPECT_TRUE(last.twist.linear.isApprox(Eigen::Vector3d(kSpeed, 0, 0), 1e-9));
  EXPECT_EQ(node.status().leftOut, 0u);
}

TEST(RobotNode, stopped_before_a_camera_is_known_ends) {
  RobotNode node(playback());
  std::thread stopper([&] { node.stop("over"); });
  EXPECT_TRUE(node.observe().frames.empty());
  stopper.join();
}

TEST(RobotNode, teaches_the_newest_image) {
  const test::TemporaryFolder folder;
  RobotNode node(playback());
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { node.teach({}, folder / "goal"); }), {"no image"}));
  node.setCamera(kCamera);
  MovingCamera camera;
  node.push(camera.image(0));
  node.push(camera.image(1));
  TeachOptions how;
  how.tracker = TrackerKind::dots;
  EXPECT_EQ(node.teach(how, folder / "goal").points.size(), 4u);
  EXPECT_TRUE(readGoal(folder / "goal").image == camera.image(1).image);
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { node.teach(how, folder / "goal"); }), {"exists"}));
}

class Commands : public CommandSink {
 public:
  bool write(CommandRow row) noexcept override {
    last = row.velocities;
    ++count;
    return true;
  }
  Velocities last;
  int count = 0;
};

TEST(RobotNode, servo_that_is_not_armed_commands_zero_and_ends_with_zero) {
  const test::TemporaryFolder folder;
  RobotNodeOptions options = playback();
  RobotNode node(options);
  node.setCamera(kCamera);
  MovingCamera camera;
  node.push(camera.image(0));
  TeachOptions how;
  how.tracker = TrackerKind::dots;
  const TaughtGoal goal = node.teach(how, folder / "goal");
  const std::atomic<bool> isArmed{false};
  ServoTask task;
  task.arm = &isArmed;
  Commands commands;
  Records records;
  std::thread middleware([&] {
    for (int k = 0; node.status().images < 5 && k < 300; ++k) {
      node.pushCameraTwist(1000 + k / kRate, {});
      node.push(camera.image(k));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    node.stop("enough");
  });
  node.servo(goal, task, commands, &records);
  middleware.join();
  EXPECT_GE(records.frames.size(), 5u);
  EXPECT_GT(commands.count, 3);
  EXPECT_TRUE(commands.last.isZero(0));
}

}  // namespace
}  // namespace depthservo
