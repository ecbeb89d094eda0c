#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "depthservo/depth/Excitation.h"

namespace depthservo {
namespace {

constexpr double kDt = 1.0 / 30;

Excitation after(const Twist& twist, double duration_s = 2) {
  Excitation excitation;
  for (int i = 0; i < std::lround(duration_s / kDt); ++i) {
    excitation.add(Motion::fromTwist(twist, kDt));
  }
  return excitation;
}

TEST(Excitation, cameraAtRestHasNoMotion) {
  const Excitation rest = after({});
  EXPECT_EQ(rest.ofDepth(.1, .2), Hindrance::noMotion);
  EXPECT_EQ(rest.ofFocal(.1, .2), Hindrance::noMotion);
  EXPECT_EQ(Excitation().ofDepth(.1, .2), Hindrance::noMotion) << "nor before the first motion";
}

TEST(Excitation, pureRotationIsNoTranslation) {
  EXPECT_EQ(after({{0, 0, 0}, {.1, .2, .3}}).ofDepth(.1, .2), Hindrance::noTranslation);
}

TEST(Excitation, motionTowardsAPointIsAlongItsLineOfSightAndNotThatOfOthers) {
  const Excitation ahead = after({{.02, .04, .2}, {0, .1, 0}});
  EXPECT_EQ(ahead.ofDepth(.1, .2), Hindrance::alongLineOfSight);
  EXPECT_NE(ahead.ofDepth(-.3, .2), Hindrance::alongLineOfSight);
  EXPECT_EQ(describe(ahead.ofDepth(.1, .2), 3), "moving along the line of sight of point 3");
}

TEST(Excitation, everyHindranceHasWordsOfItsOwn) {
  std::set<std::string> all;
  for (const Hindrance hindrance :
       {Hindrance::noMotion, Hindrance::noTranslation, Hindrance::alongLineOfSight,
        Hindrance::tooSlow, Hindrance::noRotation, Hindrance::opticalAxisOnly,
        Hindrance::radialOnly}) {
    const std::string words = describe(hindrance, 7);
    EXPECT_FALSE(words.empty());
    const bool isOfThePoint = hindrance == Hindrance::alongLineOfSight ||
                              hindrance == Hindrance::tooSlow || hindrance == Hindrance::radialOnly;
    EXPECT_EQ(words.find("point 7") != std::string::npos, isOfThePoint) << words;
    all.insert(words);
  }
  EXPECT_EQ(all.size(), 7u);
  EXPECT_EQ(describe(Hindrance::none, 7), "");
}

TEST(Excitation, motionAcrossTheLineOfSightIsOnlyTooSlow) {
  EXPECT_EQ(after({{.003, 0, 0}, {0, 0, 0}}).ofDepth(0, 0), Hindrance::tooSlow);
}

TEST(Excitation, translationTellsNoFocalLength) {
  EXPECT_EQ(after({{.1, 0, .1}, {0, 0, 0}}).ofFocal(.1, .2), Hindrance::noRotation);
  EXPECT_EQ(describe(Hindrance::noRotation, 0), "no rotation");
}

TEST(Excitation, rotationAboutTheOpticalAxisTellsNoFocalLength) {
  const Excitation rolling = after({{0, 0, 0}, {.001, 0, .5}});
  EXPECT_EQ(rolling.ofFocal(.1, .2), Hindrance::opticalAxisOnly);
  EXPECT_EQ(describe(rolling.ofFocal(.1, .2), 3), "rotation about the optical axis only");
}

TEST(Excitation, rotationAcrossTheRadiusOfAPointMovesItOnlyRadially) {
  const Excitation across = after({{0, 0, 0}, {.2, -.1, 0}});  // eta1 = y1 wx + y2 wy = 0
  EXPECT_EQ(across.ofFocal(.1, .2), Hindrance::radialOnly);
  EXPECT_NE(across.ofFocal(.2, -.1), Hindrance::radialOnly);
}

TEST(Excitation, acrossIsTheSpeedPerpendicularToTheLineOfSightTimesDepth) {
  const Twist twist{{.03, -.02, .2}, {.1, .2, .3}};
  const double x = .1, y = -.2;
  const double expected = std::hypot(-twist.linear.x() + x * twist.linear.z(),
                                     -twist.linear.y() + y * twist.linear.z());
  EXPECT_NEAR(after(twist).across(x, y), expected, 1e-6 * expected);
  EXPECT_NEAR(after(twist).speed(), twist.linear.norm(), 1e-6);
  EXPECT_NEAR(after(twist).turnRate(), twist.angular.norm(), 1e-6);
}

TEST(Excitation, speaksOfTheLastSecondOnly) {
  Excitation excitation = after({{.2, 0, 0}, {0, 0, 0}});
  for (int i = 0; i < 300; ++i) {
    excitation.add(Motion::fromTwist({{0, 0, 0}, {0, .1, 0}}, kDt));
  }
  EXPECT_EQ(excitation.ofDepth(0, 0), Hindrance::noTranslation);
}

TEST(Excitation, unusableMotionIsIgnored) {
  Excitation excitation = after({{.2, 0, 0}, {0, 0, 0}});
  const double speed = excitation.speed();
  const double bad = std::numeric_limits<double>::quiet_NaN();
  excitation.add(Motion::fromTwist({{bad, 0, 0}, {0, 0, 0}}, kDt));
  excitation.add(Motion::fromTwist({{1, 0, 0}, {0, 0, 0}}, -1));
  excitation.add(Motion::fromTwist({{1e200, 0, 0}, {0, 0, 0}}, kDt));
  EXPECT_EQ(excitation.speed(), speed);
}

}  // namespace
}  // namespace depthservo
