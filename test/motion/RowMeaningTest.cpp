// What a row of odometry means: held, sampled, or the mean of the time before it.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/motion/OdometryNoise.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

constexpr double kPeriod = 0.1;

using Speed = std::function<double(double)>;

/// Along an axis and about it, which leaves the way straight.
Twist along(double speed) { return {{0, 0, speed}, {0, 0, speed}}; }

/// Way by a speed, by small steps.
double way(const Speed& speed, double from, double to) {
  constexpr int kSteps = 2000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) sum += speed(from + (i + 0.5) * (to - from) / kSteps);
  return sum * (to - from) / kSteps;
}

/// Rows of a robot, straight from their definition.
MotionBuffer told(RowMeaning meaning, const Speed& speed, int rows) {
  MotionBuffer buffer;
  buffer.setMeaning(meaning);
  for (int i = 0; i <= rows; ++i) {
    const double t = i * kPeriod;
    const double v = meaning == RowMeaning::instant ? speed(t)
                     : meaning == RowMeaning::hold  ? way(speed, t, t + kPeriod) / kPeriod
                     : i == 0                       ? 99  // of a time before the first
                                                    : way(speed, t - kPeriod, t) / kPeriod;
    EXPECT_TRUE(buffer.push(t, along(v)));
  }
  return buffer;
}

TEST(RowMeaning, samplesAreInterpolated) {
  const Speed ramp = [](double t) { return .5 + 2 * t; };
  const MotionBuffer buffer = told(RowMeaning::instant, ramp, 10);
  for (const auto& [from, to] : {std::pair{0., 1.}, {.03, .07}, {.05, .68}, {.1, .2}}) {
    const auto [motion, coverage] = buffer.motion(from, to);
    EXPECT_EQ(coverage, Coverage::complete);
    EXPECT_NEAR(-motion.t.z(), way(ramp, from, to), 1e-12);
    EXPECT_NEAR(buffer.meanTwist(from, to).twist.linear.z(), way(ramp, from, to) / (to - from),
                1e-12);
  }
}

TEST(RowMeaning, meansOfTheTimeBeforeAreRightOverTheirRows) {
  const Speed wave = [](double t) { return .5 + .3 * std::sin(7 * t); };
  const MotionBuffer buffer = told(RowMeaning::meanBefore, wave, 10);
  for (const auto& [from, to] : {std::pair{0., 1.}, {.1, .2}, {.3, .9}}) {
    const auto [motion, coverage] = buffer.motion(from, to);
    EXPECT_EQ(coverage, Coverage::complete);
    EXPECT_NEAR(-motion.t.z(), way(wave, from, to), 1e-7);
    EXPECT_LT(motion.within.t2, 1e-25);  // nothing is cut
  }
}

TEST(RowMeaning, rowsThatHoldTellAllThereIs) {
  const MotionBuffer buffer = told(
      RowMeaning::hold, [](double t) { return t; }, 10);
  const Motion motion = buffer.motion(.03, .87).motion;
  EXPECT_EQ(motion.within.t2, 0);
  EXPECT_EQ(motion.within.theta2, 0);
}

TEST(RowMeaning, isKeptThroughHoles) {
  for (const RowMeaning meaning : {RowMeaning::instant, RowMeaning::meanBefore}) {
    MotionBuffer buffer;
    buffer.setMeaning(meaning);
    for (const double t : {0., .1, .2, .3, 2., 2.1, 2.2}) buffer.push(t, along(1 + t));
    EXPECT_EQ(buffer.coverage(.25, .35), Coverage::complete);
    EXPECT_EQ(buffer.coverage(.3, 1.), Coverage::hole);
    // Beyond the hole nobody knows: what is known there is known of the row before it.
    EXPECT_NEAR(-buffer.motion(.3, .4).motion.t.z(), .13, 1e-12);
    EXPECT_NEAR(buffer.unknownSince(.3, 1.), .4, 1e-12);
  }
}

TEST(RowMeaning, afterAHoleNothingIsKnownOfChanges) {
  for (const RowMeaning meaning : {RowMeaning::instant, RowMeaning::meanBefore}) {
    MotionBuffer buffer(100, kPeriod);
    buffer.setMeaning(meaning);
    buffer.push(0, along(1));
    const Motion alone = buffer.motion(0, kPeriod).motion;
    EXPECT_NEAR(alone.t.z(), -kPeriod, 1e-12);
    EXPECT_EQ(alone.within.t2, 0);
    for (const double t : {.1, .2, .3}) buffer.push(t, along(1 + t));
    EXPECT_GT(buffer.motion(.3, .35).motion.within.t2, 0);
    buffer.push(2, along(3));
    EXPECT_EQ(buffer.motion(2, 2.05).motion.within.t2, 0);
    EXPECT_NEAR(buffer.motion(2, 2.05).motion.t.z(), -.15, 1e-12);
    // A sample goes on to the next; of a mean after a hole nobody knows how it has risen.
    buffer.push(2.1, along(3.2));
    const double speed = meaning == RowMeaning::instant ? 3.05 : 3.2;
    EXPECT_NEAR(buffer.motion(2, 2.05).motion.t.z(), -.05 * speed, 1e-12);
  }
}

TEST(RowMeaning, whatIsToldAsUnknownStaysUnknown) {
  for (const RowMeaning meaning : {RowMeaning::hold, RowMeaning::instant, RowMeaning::meanBefore}) {
    MotionBuffer buffer;
    buffer.setMeaning(meaning);
    buffer.push(0, along(2));
    buffer.push(.1, along(2));
    buffer.pushUnknown(.15);
    for (const double t : {.2, .3}) buffer.push(t, along(5));
    EXPECT_EQ(buffer.coverage(0, .15), Coverage::complete);
    EXPECT_NEAR(buffer.motion(.1, .15).motion.t.z(), -.1, 1e-12);
    EXPECT_EQ(buffer.coverage(.15, .2), Coverage::refused);
    EXPECT_EQ(buffer.motion(.15, .2).motion.t.z(), 0);
    EXPECT_NEAR(buffer.motion(.2, .3).motion.t.z(), -.5, 1e-12);
  }
}

TEST(RowMeaning, onlyRowsThatHoldSayAllBeforeTheNext) {
  for (const RowMeaning meaning : {RowMeaning::hold, RowMeaning::instant, RowMeaning::meanBefore}) {
    const bool isHeld = meaning == RowMeaning::hold;
    MotionBuffer buffer;
    buffer.setMeaning(meaning);
    EXPECT_EQ(buffer.saysUntil(0), isHeld);
    buffer.push(1, along(1));
    EXPECT_TRUE(buffer.saysUntil(1));
    EXPECT_EQ(buffer.saysUntil(1.01), isHeld);
  }
}

struct Part {
  const char* what;
  RowMeaning meaning;
  int rows;
  double from, to;
};

class Within : public ::testing::TestWithParam<Part> {};

/// The claim of Motion::within against robots whose speed changes by a step somewhere in each row.
TEST_P(Within, isHowMuchTheMotionIsOffWhereTheSpeedChangesSomewhereInARow) {
  const Part part = GetParam();
  Random random(7);
  constexpr int kRobots = 4000;
  double squares = 0, claimed = 0;
  for (int robot = 0; robot < kRobots; ++robot) {
    std::vector<double> steps, sizes;
    for (int i = 0; i < 6; ++i) {
      steps.push_back((i + random.uniform(0, 1)) * kPeriod);
      sizes.push_back(random.uniform(0, 1) < .5 ? .1 : -.1);
    }
    const Speed speed = [&](double t) {
      double v = 1;
      for (std::size_t i = 0; i < steps.size(); ++i) v += t > steps[i] ? sizes[i] : 0;
      return v;
    };
    const auto exactWay = [&](double from, double to) {
      double sum = to - from;
      for (std::size_t i = 0; i < steps.size(); ++i) {
        sum += sizes[i] * std::max(0., to - std::max(from, steps[i]));
      }
      return sum;
    };
    MotionBuffer buffer;
    buffer.setMeaning(part.meaning);
    for (int i = 0; i <= part.rows; ++i) {
      const double t = i * kPeriod;
      const bool samples = part.meaning == RowMeaning::instant;
      buffer.push(t, along(samples ? speed(t) : i == 0 ? 0 : exactWay(t - kPeriod, t) / kPeriod));
    }
    const Motion motion = buffer.motion(part.from, part.to).motion;
    squares += std::pow(motion.t.z() + exactWay(part.from, part.to), 2) / kRobots;
    claimed += motion.within.t2 / kRobots;
    EXPECT_NEAR(motion.within.theta2, motion.within.t2, 1e-12);
  }
  // Samples: as errors that last for 2 s.
  const double lasting = part.meaning == RowMeaning::instant ? 1 / std::tanh(kPeriod / 4) : 1;
  EXPECT_GT(claimed, .6 * lasting * squares) << part.what;
  EXPECT_LT(claimed, 3 * lasting * squares) << part.what;
}

INSTANTIATE_TEST_SUITE_P(
    Parts, Within,
    ::testing::Values(Part{"between two samples", RowMeaning::instant, 5, .2, .3},
                      Part{"from a sample on", RowMeaning::instant, 5, .2, .24},
                      Part{"in the middle", RowMeaning::instant, 5, .23, .26},
                      Part{"two rows and a part", RowMeaning::instant, 5, .15, .38},
                      Part{"after the newest sample", RowMeaning::instant, 3, .3, .36},
                      Part{"a part of a mean", RowMeaning::meanBefore, 5, .2, .24},
                      Part{"in the middle of a mean", RowMeaning::meanBefore, 5, .23, .28},
                      Part{"two means and a part", RowMeaning::meanBefore, 5, .15, .38},
                      Part{"after the newest mean", RowMeaning::meanBefore, 3, .3, .36}));

TEST(RowMeaning, samplesOfARobotThatSlowsDownAlwaysAtTheWrongTimeAreWithinTwoSigma) {
  MotionBuffer buffer;
  buffer.setMeaning(RowMeaning::instant);
  double speed = 1, way = 0;
  for (int i = 0; i <= 20; ++i) {  // brakes right after each sample, as after an image
    buffer.push(i * kPeriod, along(speed));
    speed -= .02;
    if (i < 20) way += speed * kPeriod;
  }
  const Motion motion = buffer.motion(0, 20 * kPeriod).motion;
  const double error = std::abs(-motion.t.z() - way);
  EXPECT_GT(error, .015);
  EXPECT_LT(error, 2 * std::sqrt(motion.within.t2));
}

TEST(RowMeaning, whatIsNotShownEntersTheNoiseAndBiasesNothing) {
  Motion motion = Motion::fromTwist({{.1, 0, .3}, {0, .2, 0}}, .1);
  const OdometryNoise noise = OdometryNoise::white(.01, .02);
  const OdometryNoise::Step plain = noise.over(motion);
  motion.within = {4e-6, 9e-6};
  const OdometryNoise::Step step = noise.over(motion);
  EXPECT_DOUBLE_EQ(step.variance_t, plain.variance_t + 4e-6);
  EXPECT_DOUBLE_EQ(step.variance_theta, plain.variance_theta + 9e-6);
  EXPECT_EQ(step.rho, plain.rho);
  EXPECT_EQ(step.bias_variance, plain.bias_variance);
  EXPECT_EQ(OdometryNoise::none().over(motion).variance_t, 4e-6);
  const Motion both = motion.then(motion.inverse());
  EXPECT_DOUBLE_EQ(both.within.t2, 8e-6);
}

}  // namespace
}  // namespace depthservo
