// The motion from image to image, as it is told: also where it cannot be used.
#include <gtest/gtest.h>

#include <limits>

#include "depthservo/motion/ToldMotion.h"

namespace depthservo {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Motion forwardFor(double dt) { return Motion::fromTwist({{0, 0, .5}, {0, 0, 0}}, dt); }

Motion uselessFor(double dt) {
  Motion motion = forwardFor(.1);
  motion.t.x() = kNaN;
  motion.dt = dt;
  return motion;
}

TEST(ToldMotion, isPassedOnAsItIs) {
  ToldMotion told;
  for (const double dt : {.1, .2}) {
    const Motion motion = told.take(forwardFor(dt));
    EXPECT_EQ(motion.t, forwardFor(dt).t);
    EXPECT_EQ(motion.dt, dt);
  }
  EXPECT_EQ(told.refused(), 0u);
  EXPECT_EQ(told.unknownFor_s(), 0);
}

TEST(ToldMotion, thatCannotBeUsedIsUnknownForAsLongAsTheImageSays) {
  ToldMotion told;
  told.setBounds({2, .5, 1.5, 3});
  told.take(forwardFor(.1));
  const Motion first = told.take(uselessFor(.4)), second = told.take(uselessFor(.6));
  EXPECT_TRUE(first.isUsable());
  EXPECT_EQ(first.t.norm(), 0);
  EXPECT_NEAR(first.unknown.duration_s, .4, 1e-12);
  // From the last known speed of 0.5 m/s up by 0.5 m/s^2, in 1 s as a whole.
  EXPECT_NEAR(first.unknown.distance_m, .5 * .4 + .25 * .4 * .4, 1e-12);
  EXPECT_NEAR(first.unknown.distance_m + second.unknown.distance_m, .5 + .25, 1e-12);
  EXPECT_EQ(told.refused(), 2u);
  EXPECT_NEAR(told.unknownFor_s(), 1, 1e-12);
  told.take(forwardFor(.1));
  EXPECT_EQ(told.unknownFor_s(), 0);
}

TEST(ToldMotion, withoutATimeLastsAsLongAsTheOneBefore) {
  ToldMotion told;
  EXPECT_EQ(told.take(uselessFor(kNaN)).dt, 0) << "nothing is known of the time either";
  told.take(forwardFor(.1));
  for (const double bad : {kNaN, -1., 0.}) {
    const Motion motion = told.take(uselessFor(bad));
    EXPECT_NEAR(motion.dt, .1, 1e-12);
    EXPECT_NEAR(motion.unknown.duration_s, .1, 1e-12);
  }
  EXPECT_EQ(told.refused(), 4u);
}

TEST(ToldMotion, thatIsToldAsUnknownAddsUpAndIsNotRefused) {
  ToldMotion told;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(told.take(Motion::notKnown({.1, 1, 1})).unknown.distance_m, 1);
  }
  EXPECT_NEAR(told.unknownFor_s(), .3, 1e-12);
  EXPECT_EQ(told.refused(), 0u);
}

}  // namespace
}  // namespace depthservo
