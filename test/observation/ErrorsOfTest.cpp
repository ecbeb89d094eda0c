// What an estimator is told of a robot's errors, from its profile and what its source declares.
#include <gtest/gtest.h>

#include "observation/errorsOf.h"

namespace depthservo {
namespace {

ObservationOptions typical() {
  ObservationOptions options;
  options.depth.errors = ErrorKind::typical;
  return options;
}

TEST(ErrorsOf, a_source_without_noise_does_not_make_a_profile_exact) {
  const OdometryNoise own = ErrorProfile::typical().odometry;
  ObservationOptions options = typical();
  options.odometryNoise = OdometryNoise::none();
  ASSERT_GT(own.sigma_w, 0);
  EXPECT_EQ(errorsOf(options)->odometry.sigma_w, own.sigma_w);
  EXPECT_EQ(errorsOf(options)->odometry.sigma_v, own.sigma_v);
}

TEST(ErrorsOf, declared_noise_replaces_that_of_a_profile) {
  ObservationOptions options = typical();
  for (const OdometryNoise& declared :
       {OdometryNoise::white(0.01, 0), OdometryNoise::white(0, 0.0001),
        OdometryNoise{0, 0, 0.1, 0}}) {
    options.odometryNoise = declared;
    const OdometryNoise told = errorsOf(options)->odometry;
    EXPECT_EQ(told.sigma_v, declared.sigma_v);
    EXPECT_EQ(told.sigma_w, declared.sigma_w);
    EXPECT_EQ(told.relative_v, declared.relative_v);
  }
}

TEST(ErrorsOf, without_a_profile_there_are_no_lasting_errors) {
  ObservationOptions options;
  options.odometryNoise = OdometryNoise::none();
  options.depth.errors = ErrorKind::automatic;
  EXPECT_FALSE(errorsOf(options));
}

}  // namespace
}  // namespace depthservo
