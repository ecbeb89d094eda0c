#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "depthservo/motion/MotionBuffer.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kEpoch_s = 1.3e9;

struct TwistRow {
  double time_s;
  Twist twist;
};

Twist forward(double speed) { return {{0, 0, speed}, {0, 0, 0}}; }

/// The twist that holds at a time, straight from the definition.
Twist heldAt(const std::vector<TwistRow>& rows, double t) {
  Twist held = rows.front().twist;
  for (const TwistRow& row : rows) {
    if (row.time_s <= t) held = row.twist;
  }
  return held;
}

/// The motion in n equal steps with the twist that holds in the middle of each.
Motion fineGrained(const std::vector<TwistRow>& rows, double t0, double t1, int n) {
  Motion motion;
  const double h = (t1 - t0) / n;
  for (int i = 0; i < n; ++i) {
    motion = motion.then(Motion::fromTwist(heldAt(rows, t0 + (i + 0.5) * h), h));
  }
  return motion;
}

MotionBuffer bufferOf(const std::vector<TwistRow>& rows, double nominalPeriod_s = 0) {
  MotionBuffer buffer(1024, nominalPeriod_s);
  for (const TwistRow& row : rows) EXPECT_TRUE(buffer.push(row.time_s, row.twist));
  return buffer;
}

TEST(MotionBuffer, holdsARowUntilTheNext) {
  const MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(10)}, {2, forward(100)}});
  EXPECT_NEAR(buffer.motion(0, 1).motion.t.z(), -1, 1e-15);
  EXPECT_NEAR(buffer.motion(1, 2).motion.t.z(), -10, 1e-14);
  EXPECT_NEAR(buffer.motion(0, 2).motion.t.z(), -11, 1e-14);
  EXPECT_NEAR(buffer.motion(0, 2).motion.dt, 2, 1e-15);
}

TEST(MotionBuffer, cutsTheFirstAndTheLastRowAtTheEndsOfTheInterval) {
  const MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(10)}, {2, forward(100)}});
  const auto [motion, coverage] = buffer.motion(0.25, 2.5);
  EXPECT_EQ(coverage, Coverage::complete);
  EXPECT_NEAR(motion.t.z(), -(0.75 + 10 + 50), 1e-13);
  EXPECT_NEAR(motion.dt, 2.25, 1e-15);
  EXPECT_NEAR(motion.dt2, 0.75 * 0.75 + 1 + 0.25, 1e-15);
}

TEST(MotionBuffer, cutsOneRowAtBothEnds) {
  const MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(10)}});
  EXPECT_NEAR(buffer.motion(0.2, 0.7).motion.t.z(), -0.5, 1e-15);
}

TEST(MotionBuffer, ofNoDurationIsTheIdentity) {
  const MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(10)}});
  const auto [motion, coverage] = buffer.motion(0.5, 0.5);
  EXPECT_EQ(coverage, Coverage::complete);
  EXPECT_EQ(motion.dt, 0);
  EXPECT_MATRIX_NEAR(motion.R, Eigen::Matrix3d::Identity(), 0);
  EXPECT_MATRIX_NEAR(motion.t, Eigen::Vector3d::Zero(), 0);
}

TEST(MotionBuffer, lastRowIsValidForOneMedianPeriod) {
  // Periods 0.1, 0.3, 0.2: an odd number, median 0.2.
  MotionBuffer buffer =
      bufferOf({{0, forward(1)}, {0.1, forward(1)}, {0.4, forward(1)}, {0.6, forward(1)}});
  EXPECT_NEAR(buffer.end(), 0.8, 1e-12);
  EXPECT_EQ(buffer.motion(0, 0.799).coverage, Coverage::complete);
  EXPECT_EQ(buffer.motion(0, 0.801).coverage, Coverage::afterEnd);
  // One more of 0.4: an even number, the mean of the middle two, 0.25.
  buffer.push(1.0, forward(1));
  EXPECT_NEAR(buffer.end(), 1.25, 1e-12);
}

TEST(MotionBuffer, aSingleRowIsValidForTheNominalPeriod) {
  const MotionBuffer buffer = bufferOf({{5, forward(1)}}, 0.5);
  EXPECT_EQ(buffer.motion(5, 5.5).coverage, Coverage::complete);
  EXPECT_EQ(buffer.motion(5, 5.6).coverage, Coverage::afterEnd);
}

TEST(MotionBuffer, holdUntilLengthensTheLastRowUntilTheNextPush) {
  MotionBuffer buffer = bufferOf({{0, forward(1)}, {0.1, forward(2)}});
  EXPECT_EQ(buffer.motion(0, 0.5).coverage, Coverage::afterEnd);
  buffer.holdUntil(0.5);
  EXPECT_EQ(buffer.motion(0, 0.5).coverage, Coverage::complete);
  EXPECT_NEAR(buffer.motion(0, 0.5).motion.t.z(), -(0.1 + 0.8), 1e-14);
  buffer.holdUntil(0.05);
  EXPECT_NEAR(buffer.end(), 0.2, 1e-15) << "never shortens it";
  buffer.holdUntil(10);
  buffer.push(0.2, forward(1));
  EXPECT_NEAR(buffer.end(), 0.3, 1e-15);
}

TEST(MotionBuffer, namesEveryReasonWhyItDoesNotKnow) {
  MotionBuffer buffer;
  EXPECT_EQ(buffer.motion(0, 1).coverage, Coverage::empty);
  buffer.push(1, forward(1));
  buffer.push(2, forward(1));
  EXPECT_EQ(buffer.motion(1, 3).coverage, Coverage::complete);
  EXPECT_EQ(buffer.motion(0.9, 2).coverage, Coverage::beforeStart);
  EXPECT_EQ(buffer.motion(1, 3.1).coverage, Coverage::afterEnd);
  EXPECT_EQ(buffer.motion(2, 1.5).coverage, Coverage::reversed);
  for (double bad : {kNaN, kInf, -kInf}) {
    EXPECT_EQ(buffer.motion(bad, 2).coverage, Coverage::reversed);
    EXPECT_EQ(buffer.motion(1, bad).coverage, Coverage::reversed);
  }
  for (const auto& [t0, t1] : {std::pair{0.9, 2.0}, {1.0, 3.1}, {2.0, 1.5}, {kNaN, 1.0}}) {
    EXPECT_EQ(buffer.motion(t0, t1).motion.dt, 0) << "no motion unless it is complete";
  }
}

TEST(MotionBuffer, everyCoverageHasItsOwnWords) {
  const std::vector<Coverage> all{Coverage::complete, Coverage::hole,    Coverage::ended,
                                  Coverage::refused,  Coverage::empty,   Coverage::beforeStart,
                                  Coverage::afterEnd, Coverage::reversed};
  for (Coverage a : all) {
    EXPECT_STRNE(toString(a), "");
    for (Coverage b : all) {
      if (a != b) {
        EXPECT_STRNE(toString(a), toString(b));
      }
    }
  }
}

TEST(MotionBuffer, whatIsNoCoverageHasNoWords) {
  EXPECT_STREQ(toString(static_cast<Coverage>(99)), "");
}

TEST(MotionBuffer, refusesRowsItCannotUseAndKeepsTheRest) {
  MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(2)}});
  EXPECT_FALSE(buffer.push(1, forward(3))) << "twice the same time";
  EXPECT_FALSE(buffer.push(0.5, forward(3))) << "backwards";
  EXPECT_FALSE(buffer.push(kNaN, forward(3)));
  EXPECT_FALSE(buffer.push(kInf, forward(3)));
  EXPECT_FALSE(buffer.push(2, forward(kNaN)));
  EXPECT_FALSE(buffer.push(2, {{0, 0, 0}, {0, kInf, 0}}));
  EXPECT_FALSE(buffer.push(2, forward(1.001 * Twist::kLargestSpeed_mps)));
  EXPECT_FALSE(buffer.push(2, {{0, 0, 0}, {0, 1e300, 0}}));
  EXPECT_EQ(buffer.refused(), 8u);
  EXPECT_EQ(buffer.size(), 2u);
  EXPECT_NEAR(buffer.motion(0, 2).motion.t.z(), -3, 1e-15);
}

TEST(MotionBuffer, knowsNothingOfTimesTooLongForAMotion) {
  MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(2)}});
  EXPECT_EQ(buffer.coverage(0, Motion::kLongest_s), Coverage::ended);
  EXPECT_TRUE(buffer.motion(0, Motion::kLongest_s).motion.isUsable());
  EXPECT_EQ(buffer.coverage(0, 1.001 * Motion::kLongest_s), Coverage::beforeStart);
  EXPECT_EQ(buffer.coverage(0, 1e300), Coverage::beforeStart);
}

TEST(MotionBuffer, forgetsTheOldestRowsWhenFull) {
  MotionBuffer buffer(4);
  std::vector<TwistRow> rows;
  for (int i = 0; i < 11; ++i) {
    const double t = 0.1 * i + (i % 3) * 0.01;
    rows.push_back({t, forward(i)});
    buffer.push(t, forward(i));
  }
  EXPECT_EQ(buffer.size(), 4u);
  EXPECT_EQ(buffer.motion(rows[6].time_s, rows[8].time_s).coverage, Coverage::beforeStart);
  const auto [motion, coverage] = buffer.motion(rows[7].time_s, rows[10].time_s);
  EXPECT_EQ(coverage, Coverage::complete);
  EXPECT_NEAR(motion.t.z(), -(7 * 0.11 + 8 * 0.08 + 9 * 0.11), 1e-13);
  // The median is that of the rows at hand: 0.11 (7 to 8), 0.08 (8 to 9), 0.11 (9 to 10).
  EXPECT_NEAR(buffer.end(), rows[10].time_s + 0.11, 1e-12);
}

TEST(MotionBuffer, anyCapacityBelowTwoIsTwo) {
  MotionBuffer buffer(0);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(buffer.push(i, forward(1)));
  EXPECT_EQ(buffer.size(), 2u);
  EXPECT_EQ(buffer.motion(3, 5).coverage, Coverage::complete);
}

TEST(MotionBuffer, clearForgetsEverything) {
  MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(2)}});
  buffer.push(kNaN, {});
  buffer.holdUntil(100);
  buffer.clear();
  EXPECT_EQ(buffer.size(), 0u);
  EXPECT_EQ(buffer.refused(), 0u);
  EXPECT_EQ(buffer.motion(0, 1).coverage, Coverage::empty);
  EXPECT_TRUE(buffer.push(-5, forward(1))) << "time may start anew";
  EXPECT_LT(buffer.end(), 0);
}

TEST(MotionBuffer, isTheProductOfFineSteps) {
  Random random(1);
  std::vector<TwistRow> rows;
  for (int i = 0; i < 20; ++i) rows.push_back({0.05 * i, random.twist(0.5, 1)});
  const MotionBuffer buffer = bufferOf(rows);
  // Steps that divide the rows: the product is the same but for rounding.
  const auto [motion, coverage] = buffer.motion(0.0125, 0.9125);
  ASSERT_EQ(coverage, Coverage::complete);
  const Motion fine = fineGrained(rows, 0.0125, 0.9125, 7200);
  EXPECT_MATRIX_NEAR(motion.R, fine.R, 1e-11);
  EXPECT_MATRIX_NEAR(motion.t, fine.t, 1e-11);
}

TEST(MotionBuffer, findsItsRowsHoweverUnevenTheirPeriods) {
  Random random(11);
  for (int run = 0; run < 200; ++run) {
    std::vector<TwistRow> rows;
    double t = random.uniform(-5, 5);
    for (int i = 0; i < 60; ++i) {
      rows.push_back({t, random.twist(1, 1)});
      t += std::pow(10, random.uniform(-4, 1));
    }
    MotionBuffer buffer;
    for (const TwistRow& row : rows) {
      buffer.push(row.time_s, row.twist);
      buffer.holdUntil(kInf);  // however long
    }
    for (int k = 0; k < 20; ++k) {
      const double at = random.uniform(rows.front().time_s, rows.back().time_s);
      const double h = 1e-9;
      const Twist held = heldAt(rows, at + h / 2);
      const auto [motion, coverage] = buffer.motion(at, at + h);
      ASSERT_EQ(coverage, Coverage::complete);
      ASSERT_NEAR((motion.t + h * held.linear).norm(), 0, 1e-14)
          << "run " << run << ", time " << at;
    }
  }
}

TEST(MotionBuffer, meanTwistWeighsEachRowByItsTime) {
  const MotionBuffer buffer = bufferOf(
      {{0, {{1, 0, 0}, {0, 0, 8}}}, {1, {{0, 2, 0}, {0, 4, 0}}}, {3, {{0, 0, 3}, {0, 0, 0}}}});
  const auto [twist, coverage] = buffer.meanTwist(.5, 4.5);
  EXPECT_EQ(coverage, Coverage::complete);
  EXPECT_NEAR((twist.linear - Eigen::Vector3d(.125, 1, 1.125)).norm(), 0, 1e-15);
  EXPECT_NEAR((twist.angular - Eigen::Vector3d(0, 2, 1)).norm(), 0, 1e-15);
  EXPECT_EQ(buffer.meanTwist(-1, 1).coverage, Coverage::beforeStart);
  EXPECT_EQ(buffer.meanTwist(-1, 1).twist.linear, Eigen::Vector3d::Zero());
  EXPECT_EQ(buffer.meanTwist(1, 1).twist.linear, Eigen::Vector3d::Zero());
}

TEST(MotionBuffer, coverageIsThatOfTheMotion) {
  Random random(12);
  const MotionBuffer buffer = bufferOf({{0, forward(1)}, {1, forward(2)}, {2, forward(3)}});
  for (int k = 0; k < 200; ++k) {
    const double t0 = random.uniform(-1, 4), t1 = random.uniform(-1, 4);
    EXPECT_EQ(buffer.coverage(t0, t1), buffer.motion(t0, t1).coverage);
  }
  EXPECT_EQ(buffer.coverage(0, kNaN), Coverage::reversed);
}

TEST(MotionBuffer, aConstantTwistGivesTheSameMotionAtAnyRate) {
  const Twist twist{{.1, -.2, .3}, {.4, .5, -.6}};
  const Motion expected = Motion::fromTwist(twist, 1.7);
  for (double rate : {10.0, 33.3, 100.0, 400.0}) {
    MotionBuffer buffer;
    for (int i = 0; i / rate < 2.5; ++i) buffer.push(i / rate, twist);
    const auto [motion, coverage] = buffer.motion(0.3, 2.0);
    ASSERT_EQ(coverage, Coverage::complete);
    EXPECT_MATRIX_NEAR(motion.R, expected.R, 1e-13);
    EXPECT_MATRIX_NEAR(motion.t, expected.t, 1e-13);
    EXPECT_NEAR(motion.dt, 1.7, 1e-13);
  }
}

TEST(MotionBuffer, worksInEpochSeconds) {
  Random random(2);
  MotionBuffer zeroBased, epochBased;
  for (int i = 0; i < 100; ++i) {
    const Twist twist = random.twist(0.5, 1);
    zeroBased.push(i / 128.0, twist);  // exact in binary at either epoch
    epochBased.push(kEpoch_s + i / 128.0, twist);
  }
  const auto expected = zeroBased.motion(0.125, 0.6875);
  const auto [motion, coverage] = epochBased.motion(kEpoch_s + 0.125, kEpoch_s + 0.6875);
  ASSERT_EQ(coverage, Coverage::complete);
  EXPECT_MATRIX_NEAR(motion.t, expected.motion.t, 1e-15);
  // Image times that were written with 9 decimals may miss the ends by a rounding.
  const double end = epochBased.end();
  EXPECT_EQ(epochBased.motion(kEpoch_s - 5e-7, end + 5e-7).coverage, Coverage::complete);
}

RC_GTEST_PROP(MotionBufferLaws, aMotionIsThatOfItsParts, ()) {
  MotionBuffer buffer(64);
  const double start = 0.5;
  double t = start;
  const int rows = *rc::gen::inRange(2, 60);
  for (int i = 0; i < rows; ++i) {
    const double a = *rc::gen::inRange(-1000, 1000) * 1e-3;
    buffer.push(t, {{a, 1 - a, 0.5 * a}, {-a, 0.3, a}});
    t += *rc::gen::inRange(1, 200) * 1e-3;
  }
  const double end = buffer.end();
  const double middle = start + (end - start) * *rc::gen::inRange(0, 1000) * 1e-3;
  const auto whole = buffer.motion(start, end);
  RC_ASSERT(hasMotion(whole.coverage));
  const Motion parts = buffer.motion(start, middle).motion.then(buffer.motion(middle, end).motion);
  RC_ASSERT((parts.R - whole.motion.R).cwiseAbs().maxCoeff() < 1e-11);
  RC_ASSERT((parts.t - whole.motion.t).cwiseAbs().maxCoeff() < 1e-11);
  RC_ASSERT(std::abs(parts.dt - whole.motion.dt) < 1e-11);
  RC_ASSERT(std::abs(parts.unknown.duration_s - whole.motion.unknown.duration_s) < 1e-11);
  RC_ASSERT(std::abs(parts.unknown.distance_m - whole.motion.unknown.distance_m) < 1e-11);
  RC_ASSERT(std::abs(parts.unknown.angle_rad - whole.motion.unknown.angle_rad) < 1e-11);
}

// ---- motion that is not known ----

/// Rows at 50 Hz over [0, 1) and [from, from + 1), forward at 0.5 m/s.
MotionBuffer withHole(double from) {
  MotionBuffer buffer;
  for (double start : {0., from}) {
    for (int i = 0; i < 50; ++i) buffer.push(start + .02 * i, forward(.5));
  }
  return buffer;
}

TEST(MotionBuffer, rowsAtMostFourPeriodsApartLeaveNoHole) {
  // The last row of the first part begins at 0.98 s.
  EXPECT_EQ(withHole(.98 + .079).coverage(.5, 1.5), Coverage::complete);
  EXPECT_EQ(withHole(.98 + .081).coverage(.5, 1.5), Coverage::hole);
}

TEST(MotionBuffer, fastRowsMayBeFortyMillisecondsApart) {
  const auto apart = [](double gap) {
    MotionBuffer buffer;
    for (int i = 0; i < 1000; ++i) buffer.push(.001 * i + (i > 500 ? gap : 0), forward(1));
    return buffer.coverage(.4, .6);
  };
  EXPECT_EQ(apart(.0385), Coverage::complete);
  EXPECT_EQ(apart(.0395), Coverage::hole) << "0.0405 s from row to row";
}

TEST(MotionBuffer, inAHoleTheCameraMayGoAsFarAsTheBoundsAllow) {
  MotionBuffer buffer = withHole(3);
  buffer.setBounds({2, .5, 1.5, 3});
  const auto [motion, coverage] = buffer.motion(.5, 3.5);
  ASSERT_EQ(coverage, Coverage::hole);
  EXPECT_NEAR(motion.dt, 3, 1e-12);
  EXPECT_NEAR(motion.t.z(), -.5 * (.5 + .5), 1e-12) << "the row before holds for one period";
  EXPECT_NEAR(motion.unknown.duration_s, 2, 1e-12);
  // From 0.5 m/s up by 0.5 m/s^2 for 2 s; from 0 rad/s up by 3 rad/s^2 for 0.5 s, then 1.5 rad/s.
  EXPECT_NEAR(motion.unknown.distance_m, .5 * 2 + .5 * .5 * 4, 1e-12);
  EXPECT_NEAR(motion.unknown.angle_rad, .5 * 3 * .25 + 1.5 * 1.5, 1e-12);
  EXPECT_NEAR(buffer.unknownSince(.5, 3.5), 1, 1e-12);
  EXPECT_NEAR(buffer.unknownSince(2, 2.5), 1, 1e-12) << "however late one asks";
  EXPECT_EQ(buffer.coverage(2, 2), Coverage::hole);
  EXPECT_EQ(buffer.coverage(3, 3.9), Coverage::complete);
  EXPECT_TRUE(std::isnan(buffer.unknownSince(3, 3.9)));
  EXPECT_EQ(buffer.meanTwist(.5, 3.5).twist.linear.norm(), 0) << "nothing is known of it";
}

TEST(MotionBuffer, odometryThatEndsIsLateFirstAndUnknownAfterFourPeriods) {
  MotionBuffer buffer;
  for (int i = 0; i < 50; ++i) buffer.push(.02 * i, forward(.5));
  EXPECT_EQ(buffer.coverage(.5, .999), Coverage::complete);
  EXPECT_EQ(buffer.coverage(.5, 1.05), Coverage::afterEnd);
  EXPECT_EQ(buffer.motion(.5, 1.05).motion.dt, 0) << "its successor may still come";
  const auto [motion, coverage] = buffer.motion(.5, 1.07);
  EXPECT_EQ(coverage, Coverage::ended);
  EXPECT_NEAR(motion.unknown.duration_s, .07, 1e-12);
  EXPECT_NEAR(buffer.unknownSince(.5, 7), 1, 1e-12);
  EXPECT_NEAR(buffer.motion(5, 7).motion.unknown.duration_s, 2, 1e-12);
  EXPECT_GT(buffer.motion(5, 7).motion.unknown.distance_m, 1.99) << "at full speed by then";
}

TEST(MotionBuffer, aRowOfWhichMoreIsKnownLeavesNoHole) {
  MotionBuffer buffer;
  for (int i = 0; i < 20; ++i) buffer.push(.02 * i, forward(1));
  buffer.push(.4, forward(2));
  buffer.holdUntil(2);
  buffer.push(2, forward(1));
  buffer.push(2.02, forward(1));
  const auto [motion, coverage] = buffer.motion(0, 2);
  EXPECT_EQ(coverage, Coverage::complete);
  EXPECT_NEAR(motion.t.z(), -(.4 + 3.2), 1e-12);
}

TEST(MotionBuffer, unknownMotionCanBeTold) {
  MotionBuffer buffer;
  EXPECT_TRUE(buffer.push(0, forward(.5)));
  buffer.holdUntil(.1);
  EXPECT_TRUE(buffer.pushUnknown(.1));
  EXPECT_TRUE(buffer.pushUnknown(.2)) << "still";
  EXPECT_FALSE(buffer.pushUnknown(.05));
  EXPECT_FALSE(buffer.pushUnknown(kNaN));
  EXPECT_EQ(buffer.coverage(0, .3), Coverage::refused);
  EXPECT_NEAR(buffer.unknownSince(0, .3), .1, 1e-12);
  EXPECT_TRUE(buffer.push(.3, forward(1)));
  buffer.holdUntil(.4);
  const auto [motion, coverage] = buffer.motion(0, .4);
  EXPECT_EQ(coverage, Coverage::refused);
  EXPECT_NEAR(motion.t.z(), -(.05 + .1), 1e-12);
  EXPECT_NEAR(motion.unknown.duration_s, .2, 1e-12);
  EXPECT_EQ(buffer.coverage(.3, .4), Coverage::complete);
}

TEST(MotionBuffer, unknownMotionCanBeToldFirst) {
  MotionBuffer buffer;
  buffer.setBounds({2, .5, 1.5, 3});
  buffer.holdUntil(7);  // there is no row that could hold
  EXPECT_TRUE(buffer.pushUnknown(0));
  EXPECT_TRUE(buffer.push(1, forward(2)));
  EXPECT_NEAR(buffer.end(), 2, 1e-12);
  const auto [motion, coverage] = buffer.motion(0, 1.5);
  EXPECT_EQ(coverage, Coverage::refused);
  EXPECT_NEAR(motion.t.z(), -1, 1e-12);
  EXPECT_NEAR(motion.unknown.duration_s, 1, 1e-12);
  EXPECT_NEAR(motion.unknown.distance_m, .5 * .5, 1e-12) << "from rest, by the acceleration";
}

TEST(MotionBuffer, findsItsRowsWhereTheirTimesAreBeyondSense) {
  constexpr double kFar_s = 1.7e308;  // the difference of the first and the last is infinite
  MotionBuffer buffer;
  for (const double t : {-kFar_s, 1., 2., 3.})
    EXPECT_TRUE(buffer.push(t, forward(t > 0 ? 10 * t : 0)));
  EXPECT_TRUE(buffer.push(kFar_s, forward(7)));
  EXPECT_EQ(buffer.coverage(1, 3), Coverage::complete);
  EXPECT_NEAR(buffer.motion(1.5, 2.5).motion.t.z(), -(.5 * 10 + .5 * 20), 1e-12);
}

}  // namespace
}  // namespace depthservo
