// Drives a robot to a goal that was taught; doc/ros.md.

#include <depthservo/text/InputError.h>
#include <geometry_msgs/Twist.h>
#include <std_msgs/String.h>
#include <std_srvs/SetBool.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <thread>

#include "NodeShell.h"
#include "Publisher.h"
#include "parameters.h"

namespace {

using namespace depthservo;

/// Commands as cmd_vel. What keeps a robot that no longer hears from moving is its base, which must
/// stop by itself when cmd_vel falls silent.
class Commands : public CommandSink {
 public:
  Commands(ros::NodeHandle& topics, RobotKind robot)
      : velocity_(topics.advertise<geometry_msgs::Twist>("cmd_vel", 1)),
        isOmni_(robot == RobotKind::omni) {}

  bool write(CommandRow row) noexcept override try {
    geometry_msgs::Twist message;
    message.linear.x = row.velocities[0];
    if (isOmni_) message.linear.y = row.velocities[1];
    message.angular.z = row.velocities[isOmni_ ? 2 : 1];
    velocity_.publish(message);
    return velocity_.getNumSubscribers() > 0;
  } catch (...) {
    return false;
  }

 private:
  ros::Publisher velocity_;
  bool isOmni_;
};

/// Waits for the goal to be taught, and for `~enable`, then drives once.
class ServoNode {
 public:
  ServoNode(ros::NodeHandle& topics, ros::NodeHandle& parameters)
      : parameters_(parameters),
        task_(depthservo_ros::servoTask(parameters)),
        publisher_(topics, parameters),
        commands_(topics, task_.robot.type),
        outcome_(topics.advertise<std_msgs::String>("outcome", 1, true)),
        enable_(parameters_.advertiseService("enable", &ServoNode::enable, this)),
        shell_(topics, parameters) {
    task_.arm = &isEnabled_;
    if (!parameters_.getParam("goal", goal_)) {
      throw InputError({parameters_.getNamespace(), 0, "goal"}, "missing: a folder, see ~teach");
    }
    parameters_.param("enabled", enabledAtStart_, false);
    isEnabled_ = enabledAtStart_;
  }

  RobotNode& node() { return shell_.node(); }

  /// \param isOver once it is true nothing begins any more
  void run(const std::atomic<bool>& isOver) {
    while (ros::ok() && !isOver &&
           !(isEnabled_ && std::filesystem::exists(goal_ + "/sequence.yaml"))) {
      ros::WallDuration(0.05).sleep();
    }
    if (!ros::ok() || isOver) return;
    const RunLog log = node().servo(readGoal(goal_), task_, commands_, &publisher_);
    std_msgs::String words;
    words.data = std::string(toString(log.outcome)) + ": " + log.reason;
    outcome_.publish(words);
    ROS_INFO("%s", words.data.c_str());
  }

 private:
  /// False stops the robot for good: it takes another start of the node to go on.
  bool enable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
    isEnabled_ = request.data;
    if (!request.data) node().stop("disabled");
    response.success = true;
    return true;
  }

  ros::NodeHandle parameters_;
  std::string goal_;
  bool enabledAtStart_ = false;
  std::atomic<bool> isEnabled_{false};
  ServoTask task_;
  depthservo_ros::Publisher publisher_;
  Commands commands_;
  ros::Publisher outcome_;
  ros::ServiceServer enable_;
  depthservo_ros::NodeShell shell_;
};

}  // namespace

int main(int argc, char** argv) {
  // Ctrl-C ends the run first, so that the robot brakes and zero is commanded last.
  ros::init(argc, argv, "servo", ros::init_options::NoSigintHandler);
  static std::atomic<bool> isOver{false};
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { isOver = true; });
  ros::NodeHandle topics, parameters("~");
  constexpr double kSilence_s = 2;  // without images for so long the robot's task has ended
  if (!parameters.hasParam("silence")) parameters.setParam("silence", kSilence_s);
  ros::AsyncSpinner spinner(1);  // one: messages keep their order
  spinner.start();
  int exitCode = 0;
  try {
    ServoNode servo(topics, parameters);
    std::thread stopper([&] {
      while (ros::ok() && !isOver) ros::WallDuration(0.02).sleep();
      servo.node().stop("the node is shut down");
    });
    try {
      servo.run(isOver);
      ros::WallDuration(1).sleep();  // for those who hear the outcome
    } catch (const std::exception& error) {
      ROS_FATAL("%s", error.what());
      exitCode = 2;
    }
    isOver = true;
    stopper.join();
    spinner.stop();
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    exitCode = 2;
  }
  ros::shutdown();
  return exitCode;
}
