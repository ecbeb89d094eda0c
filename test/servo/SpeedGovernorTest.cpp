#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "servo/SpeedGovernor.h"
#include "support/Random.h"
#include "support/ToldEstimates.h"

namespace depthservo::test {
namespace {

constexpr double kFocal_px = 500, kStop_px = 10, kRamp_s = 0.5, kFrame_s = 0.04;

class SpeedGovernorTest : public testing::Test {
 protected:
  /// An image: every point is measured that is not predicted.
  void image(double dt = kFrame_s) {
    time_s_ += dt;
    std::vector<PointObservation> measured;
    for (int i = 0; i < 4; ++i) {
      if (told_.estimate(i).status == DepthStatus::valid) measured.push_back({i, {0, 0, 1e-3}});
    }
    for (int i = 0; i < strangers_; ++i) measured.push_back({10 + i, {0, 0, 1e-3}});
    features_.publish(told_, measured, MotionBuffer(), 0);
    governor_.update(time_s_, features_, measured);
  }
  void images(double duration_s) {
    for (int i = 0; i < std::lround(duration_s / kFrame_s); ++i) image();
  }

  /// A point is not seen, and predicted with this sigma.
  void hide(std::size_t point, double sigma_px) {
    told_.estimates[point].status = DepthStatus::coasting;
    told_.estimates[point].sigma_xy = sigma_px / kFocal_px;
  }
  static DepthEstimate valid() {
    DepthEstimate estimate;
    estimate.chi = 1;
    estimate.sigma_chi = 0.01;
    estimate.status = DepthStatus::valid;
    return estimate;
  }

  ToldEstimates told_{std::vector<DepthEstimate>(4, valid())};
  PointFeatures features_{4, DepthRange()};
  SpeedGovernor governor_{kStop_px, kFocal_px};
  int strangers_ = 0;  // points that are measured, too, and are not of the task
  double time_s_ = 1000;
};

TEST_F(SpeedGovernorTest, points_that_are_measured_have_full_speed_however_vague) {
  told_.estimates[2].sigma_xy = 1;
  images(2);
  EXPECT_TRUE(governor_.isFree());
  EXPECT_EQ(governor_.speed(), 1);
}

TEST_F(SpeedGovernorTest, the_hidden_point_counts_whichever_it_is_and_whatever_else_is_seen) {
  for (std::size_t hidden = 0; hidden < 4; ++hidden) {
    for (strangers_ = 0; strangers_ < 6; ++strangers_) {
      hide(hidden, 0.75 * kStop_px);
      images(2);
      EXPECT_NEAR(governor_.speed(), 0.5, 1e-9) << "point " << hidden << ", " << strangers_;
      told_.estimates[hidden] = valid();
      images(2);
      EXPECT_EQ(governor_.speed(), 1);
    }
  }
}

TEST_F(SpeedGovernorTest, slows_down_in_proportion_to_sigma_from_half_of_the_stop_on) {
  struct {
    double sigma_px, speed;
    Basis basis;
  } const cases[] = {{0.5 * kStop_px, 1, Basis::features},  {0.6 * kStop_px, 0.8, Basis::slowed},
                     {0.75 * kStop_px, 0.5, Basis::slowed}, {0.94 * kStop_px, 0.12, Basis::slowed},
                     {0.96 * kStop_px, 0, Basis::waiting},  // slower it would hardly get on
                     {kStop_px, 0, Basis::waiting},         {100 * kStop_px, 0, Basis::waiting}};
  for (const auto& now : cases) {
    hide(1, now.sigma_px);
    images(2);
    EXPECT_NEAR(governor_.speed(), now.speed, 1e-9) << now.sigma_px;
    EXPECT_EQ(governor_.basis(), now.basis) << now.sigma_px;
    EXPECT_EQ(governor_.isFree(), now.basis == Basis::features);
  }
}

TEST_F(SpeedGovernorTest, a_lost_point_fades_the_command_out_within_half_a_second_and_back) {
  for (const DepthStatus status : {DepthStatus::lost, DepthStatus::unset}) {
    images(1);
    ASSERT_TRUE(governor_.isFree());
    told_.estimates[3].status = status;
    image();
    EXPECT_EQ(governor_.basis(), Basis::nothing);
    EXPECT_NEAR(governor_.speed(), 1 - kFrame_s / kRamp_s, 1e-9);
    images(kRamp_s);
    EXPECT_EQ(governor_.speed(), 0);
    told_.estimates[3].status = DepthStatus::valid;
    image();
    EXPECT_EQ(governor_.basis(), Basis::features);
    EXPECT_FALSE(governor_.isFree()) << "it comes back without a jerk, too";
    EXPECT_NEAR(governor_.speed(), kFrame_s / kRamp_s, 1e-9);
  }
}

TEST_F(SpeedGovernorTest, whatever_comes_the_share_is_one_and_changes_no_faster_than_the_ramp) {
  Random random(1);
  for (int k = 0; k < 2000; ++k) {
    const auto point = static_cast<std::size_t>(random.integer(0, 3));
    hide(point, random.uniform(0, 2 * kStop_px));
    if (random.integer(0, 2) > 0) told_.estimates[point].status = DepthStatus::valid;
    if (random.integer(0, 9) == 0) told_.estimates[point].status = DepthStatus::lost;
    const double before = governor_.speed(), dt = random.uniform(-0.1, 0.3);
    image(dt);
    ASSERT_GE(governor_.speed(), 0);
    ASSERT_LE(governor_.speed(), 1);
    const double most = k == 0 ? 0 : std::max(dt, 0.) / kRamp_s;
    ASSERT_LE(std::abs(governor_.speed() - before), most + 1e-9) << "image " << k << ", " << dt;
  }
}

TEST_F(SpeedGovernorTest, a_time_that_is_none_changes_nothing) {
  hide(0, kStop_px);
  images(0.2);
  const double before = governor_.speed();
  ASSERT_GT(before, 0);
  image(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(governor_.speed(), before);
}

TEST_F(SpeedGovernorTest, released_it_holds_nothing_back) {
  told_.estimates[0].status = DepthStatus::lost;
  image();
  ASSERT_EQ(governor_.basis(), Basis::nothing);
  governor_.release();
  EXPECT_EQ(governor_.basis(), Basis::features);
}

TEST(Basis, each_has_a_sentence_of_its_own) {
  const Basis all[] = {Basis::features, Basis::slowed, Basis::waiting, Basis::nothing};
  for (const Basis a : all) {
    EXPECT_STRNE(toString(a), "");
    for (const Basis b : all) EXPECT_EQ(std::string(toString(a)) == toString(b), a == b);
  }
  EXPECT_STREQ(toString(static_cast<Basis>(99)), "") << "one that is none";
}

}  // namespace
}  // namespace depthservo::test
