// The servo's recording cannot be written, or the servo is killed at one of its output calls.

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <memory>

#include "cli/RobotPair.h"
#include "faults/Faults.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

/// Calls of a kind that are tried where all are asked for: each takes seconds.
constexpr int kMany = 50;

/// A short way to the goal.
class RecordingServo : public testing::Test {
 protected:
  /// \return calls below the place of the recording
  OutputCalls run(int at, const std::string& kind) {
    pair_ = std::make_unique<RobotPair>(data("servo/dots.yaml") +
                                        " --set duration=6 --set "
                                        "'robot.initial={x: -1.1, y: 0.01, theta: 0}'");
    fs::create_directory(place());
    pair_->teach("{x: -1, y: 0, theta: 0}", "--tracker dots");
    pair_->servoEnvironment = "PATH=/nowhere " + faultAt(at, kind, place(), pair_->path("told"));
    pair_->start(
        "--arm --prior 1 --tolerance 8 --record " + place() + "/record --out " + place() + "/out",
        true);
    pair_->wait();
    return toldCalls(pair_->path("told"));
  }
  std::string place() const { return pair_->path("place"); }
  bool isThere(const std::string& name) const { return fs::exists(place() + "/" + name); }

  /// Whole, as far as the next one who reads it can tell.
  void expectWholeOrAbsent() const {
    for (const std::string& command : {std::string("replay record"), std::string("report out")}) {
      const std::string what = command.substr(0, 7), name = command.substr(7);
      if (!isThere(name)) continue;
      EXPECT_EQ(depthservo(what + place() + "/" + name).exitCode, 0) << command;
    }
  }

  std::unique_ptr<RobotPair> pair_;
};

TEST_F(RecordingServo, that_cannot_write_brakes_and_says_so) {
  const OutputCalls calls = run(0, "full");
  ASSERT_EQ(pair_->servoExit, 0) << pair_->words;
  ASSERT_GT(calls.of("full"), 20);
  EXPECT_TRUE(isThere("record") && isThere("out"));
  for (const char* kind : {"full", "file-limit"}) {
    for (const int at : callsToTry(calls.of(kind), 1, 5, kMany)) {
      run(at, kind);
      SCOPED_TRACE(std::string(kind) + " at " + std::to_string(at) + ": " + pair_->words);
      EXPECT_EQ(pair_->servoExit, 2);
      EXPECT_NE(pair_->words.find(place()), std::string::npos);
      if (!pair_->written().empty()) {
        EXPECT_EQ(pair_->written().back().v, 0) << "zero is commanded last";
        EXPECT_EQ(pair_->written().back().w, 0);
      }
      expectWholeOrAbsent();
      for (const auto& entry : fs::directory_iterator(place())) {
        EXPECT_NE(entry.path().filename().string()[0], '.') << entry.path();
      }
    }
  }
}

TEST_F(RecordingServo, killed_at_any_call_leaves_what_is_whole) {
  const OutputCalls calls = run(0, "kill");
  for (const int at : callsToTry(calls.of("kill"), 1, 6, kMany)) {
    run(at, "kill");
    SCOPED_TRACE("at " + std::to_string(at) + ": " + pair_->words);
    EXPECT_EQ(pair_->servoExit, -SIGKILL);
    expectWholeOrAbsent();
  }
}

}  // namespace
}  // namespace depthservo::test
