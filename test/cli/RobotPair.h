#pragma once

#include <sys/types.h>

#include <atomic>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {

/// What becomes of a piece (an image with its header, a line) on its way; none: it gets lost.
/// \param time_s since the first piece
using Tap = std::function<std::vector<std::string>(double time_s, std::string piece)>;

/// `depthservo robot` and `depthservo servo`, two processes and the pipes between them.
class RobotPair {
 public:
  /// \param scenario and its settings, as typed
  explicit RobotPair(std::string scenario);
  ~RobotPair();

  /// Shows the goal: what the scenario's robot sees from robot.goal. \param how for `teach`
  void teach(const std::string& goalPose, const std::string& how);
  void writeRobot(const std::string& yaml) { folder_.write("robot.yaml", yaml); }

  Tap images, twists, commands;  ///< none: as they come
  std::string servoEnvironment;  ///< "NAME=value" before the servo's command

  void start(const std::string& servoOptions, bool isLockstep = false);
  void killServo(int signal) { kill(servo_, signal); }
  void killRobot(int signal) { kill(robot_, signal); }

  /// Until both have ended; 60 s at most.
  void wait();

  int servoExit = -1, robotExit = -1;
  nlohmann::json servo, robot;  ///< null where it was killed
  std::string words;            ///< of the servo

  /// Rows of the robot's log: what is true.
  struct Row {
    double time_s, v, w;
    bool isExpired;
  };
  std::vector<Row> log() const;

  /// Commands as the servo wrote them.
  struct Command {
    double time_s, v, w;
  };
  const std::vector<Command>& written() const { return written_; }

  /// Time from a cause until the robot stands for good [s]. \param cause_s by the system's clock
  double stoppedAfter(double cause_s) const;
  double speedAt(double time_s) const;

  static double now_s();  ///< of the system's clock

  std::string path(const std::string& name) const { return folder_ / name; }
  std::string fileText(const std::string& name) const { return folder_.read(name); }

 private:
  pid_t launch(const std::string& command, const std::string& name,
               const std::string& environment = "") const;
  void kill(pid_t id, int signal);
  void relay(const std::string& from, const std::string& to, bool isImages, const Tap& tap);
  void keep(const std::string& line);

  TemporaryFolder folder_;
  std::string scenario_;
  pid_t servo_ = -1, robot_ = -1;
  std::atomic<bool> isOver_{false};
  std::vector<std::thread> relays_;
  std::vector<Command> written_;
};

}  // namespace depthservo::test
