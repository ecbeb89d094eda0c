// What can go wrong between a camera and a moving robot, on two real processes in real time.

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <thread>

#include "cli/RobotPair.h"

namespace depthservo::test {
namespace {

constexpr double kFault_s = 1.2;       // after the first image: the robot has its full speed
constexpr double kDeadline_s = 0.1;    // of the watchdogs
constexpr double kBrake = 4;           // m/s^2
constexpr double kTimeToLive_s = 0.2;  // of a command
/// Beside what is promised: a machine that does other things, a period of the commands (20 ms) and
/// one of the robot (10 ms).
constexpr double kSlack_s = 0.15;

std::string scenario(const std::string& more = "") {
  return data("scenarios/unicycle-4dots.yaml") +
         " --set 'camera={width: 320, height: 240, fx: 300, fy: 300, cx: 159.5, cy: 119.5, rate: "
         "30}'"
         " --set target.radius=0.03 --set odometry.rate=100 --set duration=20 "
         "--set sensing.gray_noise=2 "
         "--set 'robot.initial={x: -3.4, y: 0.1, theta: 0}' " +
         more;
}

class ServoFault : public testing::Test {
 protected:
  void begin(const std::string& more = "", const std::string& servo = "--arm --prior 3") {
    pair_.emplace(scenario(more));
    pair_->teach("{x: -1, y: 0, theta: 0}", "--tracker dots");
    prepare_();
    pair_->start(servo);
  }

  /// A tap that does `what` from the fault on. Remembers when that was.
  template <class What>
  Tap fromFaultOn(What what) {
    return [this, what](double time_s, std::string piece) mutable -> std::vector<std::string> {
      if (time_s < kFault_s) return {piece};
      if (cause_s_ == 0) cause_s_ = RobotPair::now_s();
      return what(time_s, std::move(piece));
    };
  }

  void expectStopped(double within_s, const std::string& why, int exitCode = 4) {
    pair_->wait();
    ASSERT_GT(cause_s_, 0) << pair_->words;
    const double v = pair_->speedAt(cause_s_);
    EXPECT_GT(v, 0.3) << "it should have been under way\n" << pair_->words;
    const double stopped_s = pair_->stoppedAfter(cause_s_);
    RecordProperty("stopped_ms", static_cast<int>(1000 * stopped_s));
    EXPECT_LE(stopped_s, within_s + v / kBrake + kSlack_s) << pair_->words;
    EXPECT_EQ(pair_->servoExit, exitCode) << pair_->words;
    EXPECT_NE(pair_->words.find(why), std::string::npos) << pair_->words;
    expectWithinLimits();
  }

  /// At every instant, by what the servo wrote.
  void expectWithinLimits() const {
    const auto& commands = pair_->written();
    ASSERT_GT(commands.size(), 20u);
    constexpr double kClock_s = 2e-3;  // between the step and its stamp
    for (std::size_t i = 1; i < commands.size(); ++i) {
      const auto& before = commands[i - 1];
      const auto& now = commands[i];
      const double dt = now.time_s - before.time_s + kClock_s;
      ASSERT_LE(std::abs(now.v), 0.5 + 1e-9);
      ASSERT_LE(std::abs(now.w), 1 + 1e-9);
      ASSERT_LE(std::abs(now.v - before.v), kBrake * dt) << "command " << i;
      if (std::abs(now.v) > std::abs(before.v)) {
        ASSERT_LE(std::abs(now.v - before.v), 1 * dt) << "command " << i;
      }
    }
  }

  std::optional<RobotPair> pair_;
  std::function<void()> prepare_ = [] {};
  std::atomic<double> cause_s_{0};
};

TEST_F(ServoFault, camera_unplugged) {
  prepare_ = [&] {
    pair_->images = fromFaultOn([](double, std::string) { return std::vector<std::string>{}; });
  };
  begin();
  expectStopped(kDeadline_s, "no image that shows anything new");
}

TEST_F(ServoFault, camera_frozen) {
  std::string frozen;
  prepare_ = [&] {
    pair_->images = fromFaultOn([&](double, std::string piece) -> std::vector<std::string> {
      const std::size_t pixels = piece.find("255\n");
      if (frozen.empty()) frozen = piece.substr(pixels);
      return {piece.substr(0, pixels) + frozen};  // its stamps go on
    });
  };
  begin();
  expectStopped(kDeadline_s, "no image that shows anything new");
}

TEST_F(ServoFault, camera_black) {
  prepare_ = [&] {
    pair_->images = fromFaultOn([](double, std::string piece) -> std::vector<std::string> {
      const std::size_t pixels = piece.find("255\n") + 4;
      return {piece.substr(0, pixels) + std::string(piece.size() - pixels, '\x05')};
    });
  };
  begin();
  expectStopped(kDeadline_s, "no image that shows anything new");
}

TEST_F(ServoFault, odometry_stops) {
  prepare_ = [&] {
    pair_->twists = fromFaultOn([](double, std::string) { return std::vector<std::string>{}; });
  };
  begin();
  expectStopped(kDeadline_s, "no odometry of now");
}

TEST_F(ServoFault, odometry_is_late) {
  std::deque<std::pair<double, std::string>> underway;
  prepare_ = [&] {
    pair_->twists = fromFaultOn([&](double time_s, std::string row) {
      underway.emplace_back(time_s + 0.3, std::move(row));
      std::vector<std::string> arrived;
      for (; underway.front().first <= time_s; underway.pop_front()) {
        arrived.push_back(underway.front().second);
      }
      return arrived;
    });
  };
  begin();
  expectStopped(kDeadline_s, "no odometry of now");
}

TEST_F(ServoFault, odometry_jumps) {
  prepare_ = [&] {
    pair_->twists = fromFaultOn([](double, const std::string& row) {
      return std::vector<std::string>{row.substr(0, row.find(',')) + ",0.3,0,5,0,0,0\n"};
    });
  };
  begin();
  expectStopped(kDeadline_s, "faster than the robot can be");
}

TEST_F(ServoFault, odometry_is_not_a_number) {
  prepare_ = [&] {
    pair_->twists = fromFaultOn([](double, const std::string& row) {
      return std::vector<std::string>{row.substr(0, row.find(',')) + ",nan,0,nan,0,nan,0\n"};
    });
  };
  begin();
  expectStopped(kDeadline_s, "nan");
}

TEST_F(ServoFault, stamps_of_odometry_jump_ahead) {
  prepare_ = [&] {
    pair_->twists = fromFaultOn([](double, const std::string& row) {
      const std::size_t comma = row.find(',');
      const double time_s = std::stod(row.substr(0, comma)) + 10;
      return std::vector<std::string>{std::to_string(time_s) + row.substr(comma)};
    });
  };
  begin();
  expectStopped(kDeadline_s, "no odometry of now");
}

TEST_F(ServoFault, target_is_covered_the_robot_slows_down_and_goes_on) {
  begin("--set sensing.hidden=[[1.5,3.5]]");
  pair_->wait();
  EXPECT_EQ(pair_->servoExit, 0) << pair_->words;
  EXPECT_NE(pair_->words.find("hidden"), std::string::npos) << pair_->words;
  expectWithinLimits();
}

TEST_F(ServoFault, target_is_moved_away) {
  // 0.6 m in 0.4 s, on its own plane.
  begin(
      "--set 'target.twist=[{until: 1.5, v: [0,0,0,0,0,0]}, {until: 1.9, v: [1.5,0,0,0,0,0]}, "
      "{until: 30, v: [0,0,0,0,0,0]}]'");
  pair_->wait();
  const double stopped_s = pair_->stoppedAfter(pair_->log().front().time_s + 1.5);
  RecordProperty("stopped_ms", static_cast<int>(1000 * stopped_s));
  EXPECT_LE(stopped_s, 2 + kSlack_s) << pair_->words;
  EXPECT_EQ(pair_->servoExit, 4) << pair_->words;
  EXPECT_NE(pair_->words.find("contradict the odometry"), std::string::npos) << pair_->words;
  expectWithinLimits();
}

TEST_F(ServoFault, servo_is_killed_the_robot_stops_by_itself) {
  begin();
  std::this_thread::sleep_for(std::chrono::duration<double>(kFault_s + 0.6));
  cause_s_ = RobotPair::now_s();
  pair_->killServo(SIGKILL);
  expectStopped(kTimeToLive_s, "for want of a command", -SIGKILL);
  EXPECT_EQ(pair_->robot["watchdog_stops"], 1);
}

TEST_F(ServoFault, robot_is_killed_the_servo_ends) {
  begin();
  std::this_thread::sleep_for(std::chrono::duration<double>(kFault_s + 0.6));
  const double killed_s = RobotPair::now_s();
  pair_->killRobot(SIGKILL);
  pair_->wait();
  EXPECT_EQ(pair_->servoExit, 4) << pair_->words;
  EXPECT_NE(pair_->words.find("has gone"), std::string::npos) << pair_->words;
  EXPECT_LT(RobotPair::now_s() - killed_s, 2);
  EXPECT_EQ(pair_->written().back().v, 0) << "zero is commanded last";
  expectWithinLimits();
}

TEST_F(ServoFault, commands_come_through_too_slowly) {
  prepare_ = [&] {
    pair_->commands = fromFaultOn([](double time_s, std::string line) -> std::vector<std::string> {
      if (time_s < kFault_s + 2) std::this_thread::sleep_for(std::chrono::milliseconds(200));
      return {std::move(line)};
    });
  };
  begin();
  pair_->wait();
  // The newest command that gets through lives as long as it may; those behind it are too old.
  const double stopped_s = pair_->stoppedAfter(cause_s_);
  RecordProperty("stopped_ms", static_cast<int>(1000 * stopped_s));
  EXPECT_LE(stopped_s, kTimeToLive_s + 0.2 + 0.5 / kBrake + kSlack_s) << pair_->words;
  EXPECT_EQ(pair_->servoExit, 4) << pair_->words;
  EXPECT_NE(pair_->words.find("nobody takes the commands"), std::string::npos) << pair_->words;
}

TEST_F(ServoFault, interrupted_it_brakes_first) {
  begin();
  std::this_thread::sleep_for(std::chrono::duration<double>(kFault_s + 0.6));
  cause_s_ = RobotPair::now_s();
  pair_->killServo(SIGINT);
  expectStopped(0, "interrupted", 130);
  EXPECT_EQ(pair_->written().back().v, 0);
}

TEST_F(ServoFault, not_armed_it_only_says_what_it_would_command) {
  begin("", "--prior 3 --duration 1.5");
  pair_->wait();
  EXPECT_EQ(pair_->servoExit, 3) << pair_->words;
  EXPECT_NE(pair_->words.find("would command v 0."), std::string::npos) << pair_->words;
  for (const auto& command : pair_->written()) ASSERT_EQ(command.v, 0);
  for (const auto& row : pair_->log()) ASSERT_EQ(row.v, 0);
}

TEST_F(ServoFault, armed_by_a_signal_it_drives) {
  begin("", "--prior 3 --duration 2.5");
  std::this_thread::sleep_for(std::chrono::duration<double>(1.2));
  pair_->killServo(SIGUSR1);
  pair_->wait();
  double most = 0;
  for (const auto& row : pair_->log()) most = std::max(most, row.v);
  EXPECT_GT(most, 0.3) << pair_->words;
  expectWithinLimits();
}

}  // namespace
}  // namespace depthservo::test
