#include <gtest/gtest.h>

#include "depthservo/depth/ConstantDepth.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::StillPoint;

const Twist kTwist{{.1, 0, .3}, {0, .1, 0}};
const Motion kMotion = Motion::fromTwist(kTwist, 1. / 30);

TEST(ConstantDepth, neverChangesItsDepthAndDoesNotClaimToKnowAGuess) {
  ConstantDepth constant;
  StillPoint point = StillPoint::at(.1, -.1, 2);
  constant.reset(point.measured(), {1.3});
  for (int i = 0; i < 60; ++i) {
    point.move(kTwist, 1. / 30);
    constant.predict(kMotion);
    EXPECT_EQ(constant.estimate().status, DepthStatus::coasting);
    constant.correct(point.measured());
    EXPECT_EQ(constant.estimate().status, DepthStatus::unexcited);
    EXPECT_EQ(constant.estimate().x, point.x());
    EXPECT_EQ(constant.estimate().Z(), 1.3);
    EXPECT_EQ(constant.estimate().sigma_chi, DepthPrior::kWideSigma_chi);
  }
}

TEST(ConstantDepth, predictsTheHiddenPointWithItsDepth) {
  ConstantDepth constant;
  StillPoint point = StillPoint::at(.1, -.1, 2);
  constant.reset(point.measured(), {2});
  const Twist sideways{{.1, 0, 0}, {0, 0, 0}};  // Z stays: the prediction is right
  for (int i = 0; i < 30; ++i) {
    point.move(sideways, 1. / 30);
    constant.predict(Motion::fromTwist(sideways, 1. / 30));
  }
  EXPECT_NEAR(constant.estimate().x, point.x(), 1e-12);
  EXPECT_NEAR(constant.estimate().y, point.y(), 1e-12);
}

TEST(ConstantDepth, pointBehindTheCameraIsLost) {
  ConstantDepth constant;
  constant.reset({.1, .1, 0}, {1});
  constant.predict(Motion::fromTwist({{0, 0, 2}, {0, 0, 0}}, 1));
  EXPECT_EQ(constant.estimate().status, DepthStatus::lost);
  constant.correct({.2, .1, 0});
  EXPECT_EQ(constant.estimate().status, DepthStatus::unexcited);
}

TEST(ConstantDepth, takesAMeasuredDepth) {
  ConstantDepth constant;
  constant.reset({.1, .1, 0}, {1});
  constant.correctDepth({1.7, .02});
  EXPECT_NEAR(constant.estimate().Z(), 1.7, 1e-15);
  EXPECT_EQ(constant.estimate().sigma_chi, .02);
  constant.correct({.1, .1, 0});
  EXPECT_EQ(constant.estimate().status, DepthStatus::valid) << "known to 10 %";
}

}  // namespace
}  // namespace depthservo
