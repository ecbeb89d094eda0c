// Poses in words and velocities over time, against ViSP's rotations and the formula.
#include <gtest/gtest.h>
#include <visp3/core/vpRotationMatrix.h>
#include <visp3/core/vpRzyxVector.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "depthservo/motion/RpyPose.h"
#include "depthservo/motion/VelocityProfile.h"
#include "depthservo/visp/using.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

Eigen::VectorXd vectorOf(std::initializer_list<double> values) {
  Eigen::VectorXd vector(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), vector.begin());
  return vector;
}

TEST(RpyPose, turnsAsVispSaysAndComesBack) {
  Random random(21);
  for (int i = 0; i < 100; ++i) {
    const RpyPose words{
        {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)},
        {random.uniform(-3.1, 3.1), random.uniform(-1.5, 1.5), random.uniform(-3.1, 3.1)}};
    const vpRotationMatrix expected(vpRzyxVector(words.rpy.z(), words.rpy.y(), words.rpy.x()));
    const Eigen::Isometry3d pose = words.isometry();
    for (unsigned row = 0; row < 3; ++row) {
      for (unsigned column = 0; column < 3; ++column) {
        EXPECT_NEAR(pose.linear()(row, column), expected[row][column], 1e-14);
      }
    }
    EXPECT_EQ(pose.translation(), words.xyz);
    EXPECT_MATRIX_NEAR(RpyPose::of(pose).rpy, words.rpy, 1e-12);
    EXPECT_EQ(RpyPose::of(pose).xyz, words.xyz);
  }
}

TEST(RpyPose, straightUpOrDownIsTheSamePoseWithoutYaw) {
  for (const double pitch : {M_PI_2, -M_PI_2}) {
    const Eigen::Isometry3d pose = RpyPose{{1, 2, 3}, {.3, pitch, -.8}}.isometry();
    const RpyPose words = RpyPose::of(pose);
    EXPECT_EQ(words.rpy.z(), 0);
    EXPECT_NEAR(words.rpy.y(), pitch, 1e-7);
    EXPECT_MATRIX_NEAR(words.isometry().matrix(), pose.matrix(), 1e-7);
  }
}

TEST(VelocityProfile, isItsSegmentsOneAfterTheOther) {
  const VelocityProfile profile{
      {2, vectorOf({1, -2}), {}, {}, {}},
      {5, vectorOf({.5, .25}), vectorOf({.3}), vectorOf({4}), vectorOf({.2})},  // the first swings
      {6, {}, vectorOf({1, 1}), {}, vectorOf({M_PI_2, 0})}};
  EXPECT_EQ(velocityAt(profile, 0, 2), Velocities(vectorOf({1, -2})));
  EXPECT_EQ(velocityAt(profile, 1.99, 2), Velocities(vectorOf({1, -2})));
  for (const double t : {2., 3.3, 4.9}) {
    EXPECT_NEAR(velocityAt(profile, t, 2)[0], .5 + .3 * std::sin(4 * t + .2), 1e-15) << t;
    EXPECT_EQ(velocityAt(profile, t, 2)[1], .25) << t;
  }
  EXPECT_NEAR(velocityAt(profile, 5.5, 2)[0], 1, 1e-15);
  EXPECT_EQ(velocityAt(profile, 5.5, 2)[1], 0);
  EXPECT_EQ(velocityAt(profile, 6, 2), Velocities(vectorOf({0, 0}))) << "after the last";
  EXPECT_EQ(velocityAt({}, 0, 3).size(), 3);
  EXPECT_EQ(objection(profile, 2), "amplitude: expected 2 numbers, got 1");
}

TEST(VelocityProfile, objectionsNameWhatIsWrong) {
  EXPECT_EQ(objection({}, 2), "");
  EXPECT_EQ(objection({{1, vectorOf({1, 2}), {}, {}, {}}, {2, {}, vectorOf({1, 2}), {}, {}}}, 2),
            "");
  EXPECT_EQ(objection({{1, {}, {}, {}, {}}, {1, {}, {}, {}, {}}}, 2),
            "until = 1 s comes after 1 s; times must increase");
  EXPECT_EQ(objection({{0, {}, {}, {}, {}}}, 2),
            "until = 0 s comes after 0 s; times must increase");
  EXPECT_NE(objection({{std::nan(""), {}, {}, {}, {}}}, 2), "");
  EXPECT_EQ(objection({{1, vectorOf({1}), {}, {}, {}}}, 2), "v: expected 2 numbers, got 1");
  EXPECT_EQ(objection({{1, {}, {}, vectorOf({1, 2, 3}), {}}}, 2),
            "omega: expected 2 numbers, got 3");
}

}  // namespace
}  // namespace depthservo
