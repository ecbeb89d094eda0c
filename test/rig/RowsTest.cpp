// What the rows of a simulated robot mean, against its true poses.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <map>

#include "depthservo/motion/Motion.h"
#include "depthservo/rig/SimulatedRig.h"

namespace depthservo {
namespace {

constexpr double kImages = 600, kRows = 25;  // [Hz]; every 24th image falls on a row

/// A unicycle whose command changes all the time, between rows, too.
struct Drive {
  std::map<long, Eigen::Isometry3d> wMc;  // by number of the image
  std::vector<OdometryRow> rows;
  std::deque<double> arrivals;  // [s] after the exposure

  Drive(RowMeaning meaning, double turning, double ticks = 0) {
    SimulatedRigOptions options;
    options.duration = 2;
    options.camera.rate = {kImages};
    options.odometry.rate = kRows;
    options.odometry.rows = meaning;
    options.odometry.ticks = ticks;
    options.target.points = {{0, 0, 0}};
    options.target.pose = {{50, 0, 0.2}, {-M_PI_2, 0, -M_PI_2}};
    options.sensing.source = SensingSource::geometry;
    options.robot.limits.dv = options.robot.limits.dw = 4;
    SimulatedRig rig(options);
    while (const auto exposure = rig.next(nullptr)) {
      wMc.emplace(std::lround(exposure->time_s * kImages), *exposure->wMc);
      arrivals.push_back(rig.time() - exposure->time_s);
      const double t = rig.time();
      rig.command(Eigen::Vector2d(.5 + .3 * std::sin(5 * t), turning * std::cos(4 * t)));
    }
    rows = rig.odometry();
  }

  Motion motion(long from, long to) const {
    return Motion::fromPoses(wMc.at(from), wMc.at(to), double(to - from) / kImages);
  }
};

constexpr long kImagesPerRow = std::lround(kImages / kRows);

TEST(RowsOfASimulatedRobot, thatHoldAreTheTwistOfEveryPartOfTheirTime) {
  const Drive drive(RowMeaning::hold, .5);
  double change = 0;
  for (long k = 1; k < 40; ++k) {
    const Twist& row = drive.rows[static_cast<std::size_t>(k)].twist;
    for (const auto& [from, to] : {std::pair{0L, 24L}, {0L, 7L}, {7L, 24L}}) {
      const Twist is = drive.motion(k * kImagesPerRow + from, k * kImagesPerRow + to).twist();
      EXPECT_LT((row.vector() - is.vector()).norm(), 1e-6) << k;
    }
    const Twist& next = drive.rows[static_cast<std::size_t>(k + 1)].twist;
    change = std::max(change, (next.vector() - row.vector()).norm());
  }
  EXPECT_GT(change, .02);
  EXPECT_LT(*std::max_element(drive.arrivals.begin(), drive.arrivals.end()), 1e-9);
}

TEST(RowsOfASimulatedRobot, thatTellTheMeanBeforeAreThat) {
  const Drive drive(RowMeaning::meanBefore, 0);  // straight on: means are exact
  double change = 0;
  for (long k = 1; k < 40; ++k) {
    const auto mean = [&](long from, long to) {
      return drive.motion((k - 1) * kImagesPerRow + from, (k - 1) * kImagesPerRow + to)
          .twist()
          .vector();
    };
    const Vector6d row = drive.rows[static_cast<std::size_t>(k)].twist.vector();
    EXPECT_LT((row - mean(0, 24)).norm(), 1e-9) << k;
    change = std::max(change, (row - mean(0, 7)).norm());
  }
  EXPECT_GT(change, .01);
}

TEST(RowsOfASimulatedRobot, thatAreInstantAreTheVelocityAtTheirTime) {
  const Drive drive(RowMeaning::instant, .5);
  for (long k = 1; k < 40; ++k) {
    const Twist before = drive.motion(k * kImagesPerRow - 1, k * kImagesPerRow).twist();
    const Twist& row = drive.rows[static_cast<std::size_t>(k)].twist;
    EXPECT_LT((row.vector() - before.vector()).norm(), 1e-6) << k;
  }
}

TEST(RowsOfASimulatedRobot, withTicksLoseNoWay) {
  for (const RowMeaning meaning : {RowMeaning::hold, RowMeaning::meanBefore}) {
    const Drive drive(meaning, 0, .01);
    double told = 0;
    const std::size_t first = meaning == RowMeaning::hold ? 0 : 1;
    for (std::size_t k = 0; k < 40; ++k) told += drive.rows[first + k].twist.linear.z() / kRows;
    const double is = -drive.motion(0, 40 * kImagesPerRow).t.z();
    EXPECT_NEAR(told, is, .01 + 1e-9);
    EXPECT_GT(is, .5);
  }
}

TEST(RowsOfASimulatedRobot, letAnImageWaitUntilTheySayHowTheCameraHasMovedUpToIt) {
  for (const RowMeaning meaning : {RowMeaning::instant, RowMeaning::meanBefore}) {
    const Drive drive(meaning, .5);
    for (std::size_t k = 0; k < 200; ++k) {
      const double toRow = double((kImagesPerRow - long(k) % kImagesPerRow) % kImagesPerRow);
      EXPECT_NEAR(drive.arrivals[k], toRow / kImages, 1e-8) << k;
    }
  }
}

}  // namespace
}  // namespace depthservo
