#include <gtest/gtest.h>
#include <visp3/core/vpException.h>
#include <visp3/core/vpExponentialMap.h>
#include <visp3/robot/vpPioneer.h>

#include "depthservo/features/cameraTwist.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

TEST(CameraTwist, isWhatMovesTheCameraOfAPioneer) {
  // The robot frame moves by exp(eJe q h) in itself; the camera, fixed to it, by what that means.
  vpPioneer pioneer;
  const vpHomogeneousMatrix eMc = pioneer.get_cMe().inverse();
  vpColVector q(2);
  for (const auto& [speed, turn] : {std::pair{.3, .0}, {.0, .8}, {.2, -.5}}) {
    q[0] = speed;
    q[1] = turn;
    const vpColVector v = cameraTwist(pioneer.get_cVe(), pioneer.get_eJe(), q);
    ASSERT_EQ(v.size(), 6u);
    const double h = 1e-3;
    const vpHomogeneousMatrix eMe = vpExponentialMap::direct(pioneer.get_eJe() * q, h);
    const vpColVector expected = vpExponentialMap::inverse(eMc.inverse() * eMe * eMc, h);
    EXPECT_NEAR((v - expected).frobeniusNorm(), 0, 1e-10);
  }
}

TEST(CameraTwist, turnsAndLeversTheTwistOfTheEndEffector) {
  // Camera 0.2 m along x of the end effector, same orientation; turning about z moves it along y.
  const vpVelocityTwistMatrix cVe(vpHomogeneousMatrix(-.2, 0, 0, 0, 0, 0));
  vpMatrix eJe(6, 1, 0.);
  eJe[5][0] = 1;
  const vpColVector v = cameraTwist(cVe, eJe, vpColVector(1, .5));
  EXPECT_NEAR(v[1], .1, 1e-12);
  EXPECT_NEAR(v[5], .5, 1e-12);
  EXPECT_NEAR(v[0], 0, 1e-12);
}

TEST(CameraTwist, refusesSizesThatDoNotMatch) {
  EXPECT_THROW(cameraTwist(vpVelocityTwistMatrix(), vpMatrix(6, 3, 0.), vpColVector(2, 0.)),
               vpException);
  EXPECT_THROW(cameraTwist(vpVelocityTwistMatrix(), vpMatrix(5, 2, 0.), vpColVector(2, 0.)),
               vpException);
}

}  // namespace
}  // namespace depthservo
