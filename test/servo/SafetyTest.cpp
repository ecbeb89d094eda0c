#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "depthservo/servo/Safety.h"
#include "support/Random.h"

namespace depthservo::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kTick_s = 0.02;

SafetyLimits unicycle() {
  SafetyLimits limits;
  limits.velocity = Eigen::Vector2d(0.5, 1);
  limits.acceleration = Eigen::Vector2d(1, 2);
  limits.braking = Eigen::Vector2d(4, 8);
  return limits;
}

Velocities of(double v, double w) { return Eigen::Vector2d(v, w); }

/// Steps at 50 Hz; what was commanded last, and when.
struct Driver {
  explicit Driver(const SafetyOptions& options = {}, bool isArmed = true)
      : safety(unicycle(), options) {
    if (isArmed) safety.arm();
  }

  const Velocities& step(const Velocities& wanted, double dt = kTick_s) {
    input.time_s += dt;
    return safety.step(input, wanted);
  }
  void run(const Velocities& wanted, double duration_s) {
    for (int i = 0; i < std::lround(duration_s / kTick_s); ++i) step(wanted);
  }
  /// Time until it stands [s].
  double stopped(const Velocities& wanted) {
    double time_s = 0;
    for (; !safety.isStanding() && time_s < 10; time_s += kTick_s) step(wanted);
    return time_s;
  }

  Safety safety;
  SafetyInput input;
};

/// What a hostile law, clock or sensor may give.
double anything(Random& random) {
  switch (random.integer(0, 9)) {
    case 0:
      return kNaN;
    case 1:
      return random.integer(0, 1) == 0 ? kInf : -kInf;
    case 2:
      return random.uniform(-1, 1) * 1e308;
    case 3:
      return 0;
    default:
      return random.uniform(-3, 3);
  }
}

TEST(Safety, whatever_comes_commands_stay_within_limits_and_change_within_them) {
  Random random(1);
  for (int run = 0; run < 200; ++run) {
    Driver driver;
    Velocities before = of(0, 0);
    for (int i = 0; i < 300; ++i) {
      if (random.integer(0, 40) == 0) driver.safety.disarm();
      if (random.integer(0, 10) == 0) driver.safety.arm();
      for (double* age :
           {&driver.input.imageAge_s, &driver.input.odometryAge_s, &driver.input.trackAge_s,
            &driver.input.contradictedFor_s, &driver.input.busyFor_s, &driver.input.unreadFor_s}) {
        *age = random.integer(0, 30) == 0 ? anything(random) : 0.01;
      }
      const double dt =
          random.integer(0, 20) == 0 ? random.uniform(-1, 1) : random.uniform(0, 0.05);
      const Velocities now = driver.step(of(anything(random), anything(random)), dt);
      const double allowed_s = std::min(std::max(dt, 0.), 0.1);
      const bool isHeld = driver.safety.reason() != SafetyReason::none;
      const Velocities& most = isHeld ? unicycle().braking : unicycle().acceleration;
      ASSERT_TRUE(now.allFinite());
      for (int k = 0; k < 2; ++k) {
        ASSERT_LE(std::abs(now[k]), unicycle().velocity[k] * (1 + 1e-12));
        ASSERT_LE(std::abs(now[k] - before[k]), most[k] * allowed_s + 1e-12)
            << toString(driver.safety.reason());
      }
      if (isHeld) {
        ASSERT_NEAR(now[0] * before[1], now[1] * before[0], 1e-12) << "braking leaves the curve";
        ASSERT_LE(now.norm(), before.norm());
      }
      before = now;
    }
  }
}

TEST(Safety, scales_all_velocities_by_a_common_factor) {
  Driver driver;
  driver.run(of(5, -2), 3);
  EXPECT_NEAR(driver.safety.command()[0], 0.5, 1e-12);
  EXPECT_NEAR(driver.safety.command()[1], -0.2, 1e-12);
}

TEST(Safety, accelerates_by_a_common_factor) {
  Driver driver;
  driver.run(of(0.5, 0.5), 0.1);
  // The first step only tells the time; 1 m/s^2 binds before 2 rad/s^2 does.
  EXPECT_NEAR(driver.safety.command()[0], 0.08, 1e-12);
  EXPECT_NEAR(driver.safety.command()[1], 0.08, 1e-12);
}

TEST(Safety, decelerates_gently_while_it_follows_the_law) {
  Driver driver;
  driver.run(of(0.5, 0), 2);
  driver.step(of(0, 0));
  EXPECT_NEAR(driver.safety.command()[0], 0.5 - 1 * kTick_s, 1e-12);
}

TEST(Safety, shows_only_what_it_would_command_until_it_is_armed) {
  Driver driver({}, false);
  driver.run(of(0.5, 1), 2);
  EXPECT_TRUE(driver.safety.isStanding());
  EXPECT_EQ(driver.safety.reason(), SafetyReason::notArmed);
  driver.safety.arm();
  driver.run(of(0.5, 1), 2);
  EXPECT_NEAR(driver.safety.command()[0], 0.5, 1e-12);
  EXPECT_EQ(driver.safety.reason(), SafetyReason::none);
}

struct Fault {
  const char* name;
  SafetyReason reason;
  double SafetyInput::*age;
  double SafetyOptions::*deadline;
};

class Watchdogs : public testing::TestWithParam<Fault> {};

TEST_P(Watchdogs, stop_at_their_deadline_and_not_before) {
  const Fault& fault = GetParam();
  Driver driver;
  driver.run(of(0.5, 0.5), 2);
  const double deadline_s = SafetyOptions{}.*fault.deadline;
  driver.input.*fault.age = 0.99 * deadline_s;
  driver.step(of(0.5, 0.5));
  EXPECT_EQ(driver.safety.reason(), SafetyReason::none);
  driver.input.*fault.age = 1.01 * deadline_s;
  EXPECT_LE(driver.stopped(of(0.5, 0.5)), 0.5 / 4 + kTick_s);
  EXPECT_EQ(driver.safety.reason(), fault.reason);
  EXPECT_GT(driver.safety.heldFor_s(), 0);
}

TEST_P(Watchdogs, stop_for_an_age_that_is_no_number_or_of_the_future) {
  const Fault& fault = GetParam();
  for (const double age : {kNaN, kInf, -1.01 * (SafetyOptions{}.*fault.deadline)}) {
    Driver driver;
    driver.run(of(0.5, 0.5), 2);
    driver.input.*fault.age = age;
    driver.step(of(0.5, 0.5));
    EXPECT_EQ(driver.safety.reason(), fault.reason) << age;
  }
}

TEST_P(Watchdogs, let_the_robot_go_on_gently_after_a_calm) {
  const Fault& fault = GetParam();
  Driver driver;
  driver.run(of(0.5, 0), 2);
  driver.input.*fault.age = 100;
  driver.run(of(0.5, 0), 1);
  driver.input.*fault.age = 0;
  driver.run(of(0.5, 0), SafetyOptions{}.calm - 2 * kTick_s);
  EXPECT_TRUE(driver.safety.isStanding());
  EXPECT_EQ(driver.safety.reason(), fault.reason);
  driver.run(of(0.5, 0), 3 * kTick_s);
  EXPECT_EQ(driver.safety.reason(), SafetyReason::none);
  EXPECT_EQ(driver.safety.heldFor_s(), 0);
  EXPECT_GT(driver.safety.command()[0], 0);
  EXPECT_LE(driver.safety.command()[0], 3 * kTick_s * 1);
}

INSTANTIATE_TEST_SUITE_P(
    Safety, Watchdogs,
    testing::Values(
        Fault{"image", SafetyReason::image, &SafetyInput::imageAge_s, &SafetyOptions::image_age},
        Fault{"odometry", SafetyReason::odometry, &SafetyInput::odometryAge_s,
              &SafetyOptions::odometry_age},
        Fault{"track", SafetyReason::track, &SafetyInput::trackAge_s, &SafetyOptions::track_age},
        Fault{"contradiction", SafetyReason::contradiction, &SafetyInput::contradictedFor_s,
              &SafetyOptions::contradiction},
        Fault{"overrun", SafetyReason::overrun, &SafetyInput::busyFor_s, &SafetyOptions::overrun},
        Fault{"unread", SafetyReason::unread, &SafetyInput::unreadFor_s, &SafetyOptions::unread}),
    [](const auto& fault) { return std::string(fault.param.name); });

TEST(Safety, brakes_for_a_command_that_is_not_finite_or_of_another_size_and_goes_on_after_it) {
  for (const Velocities& bad : {of(kNaN, 0), of(0, kInf), Velocities(Eigen::Vector3d(0.1, 0, 0))}) {
    Driver driver;
    driver.run(of(0.5, 0), 2);
    EXPECT_LE(driver.stopped(bad), 0.5 / 4 + kTick_s);
    EXPECT_EQ(driver.safety.reason(), SafetyReason::command);
    driver.run(of(0.5, 0), 2);
    EXPECT_NEAR(driver.safety.command()[0], 0.5, 1e-12);
  }
}

TEST(Safety, ends_for_good) {
  Driver driver;
  driver.run(of(0.5, 1), 2);
  driver.safety.end();
  EXPECT_LE(driver.stopped(of(0.5, 1)), 1. / 8 + kTick_s);
  driver.safety.arm();
  driver.run(of(0.5, 1), 1);
  EXPECT_TRUE(driver.safety.isStanding());
  EXPECT_EQ(driver.safety.reason(), SafetyReason::ended);
}

TEST(Safety, a_clock_that_stands_still_or_goes_back_moves_nothing) {
  Driver driver;
  driver.run(of(0.5, 0), 0.2);
  const double before = driver.safety.command()[0];
  for (const double dt : {0., -5., kNaN}) {
    SafetyInput input = driver.input;
    input.time_s += dt;
    driver.safety.step(input, of(0.5, 0));
    EXPECT_EQ(driver.safety.command()[0], before) << dt;
  }
  driver.step(of(0.5, 0));
  EXPECT_NEAR(driver.safety.command()[0], before + kTick_s, 1e-12) << "the clock goes on";
}

TEST(Safety, refuses_limits_that_are_none) {
  SafetyLimits limits = unicycle();
  limits.braking[0] = 0;
  EXPECT_THROW(Safety(limits, {}), std::invalid_argument);
  limits = unicycle();
  limits.velocity = Eigen::Vector3d(1, 1, 1);
  EXPECT_THROW(Safety(limits, {}), std::invalid_argument);
  EXPECT_THROW(Safety(SafetyLimits{}, {}), std::invalid_argument);
  SafetyOptions options;
  options.image_age = 0;
  EXPECT_THROW(Safety(unicycle(), options), std::invalid_argument);
}

TEST(Safety, every_reason_has_a_word_and_a_sentence_of_its_own) {
  for (int i = 0; i <= static_cast<int>(SafetyReason::unread); ++i) {
    EXPECT_STRNE(toString(static_cast<SafetyReason>(i)), "");
    EXPECT_STRNE(wordsOf(static_cast<SafetyReason>(i)), "");
    for (int j = 0; j < i; ++j) {
      EXPECT_STRNE(toString(static_cast<SafetyReason>(i)), toString(static_cast<SafetyReason>(j)));
    }
  }
  EXPECT_STREQ(toString(static_cast<SafetyReason>(99)), "") << "one that is none";
  EXPECT_STREQ(wordsOf(static_cast<SafetyReason>(99)), "");
}

}  // namespace
}  // namespace depthservo::test
