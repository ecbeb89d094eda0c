// The depths of points that a moving camera sees; doc/ros.md.

#include <depthservo/text/InputError.h>

#include <thread>

#include "NodeShell.h"
#include "Publisher.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "observe");
  ros::NodeHandle topics, parameters("~");
  ros::AsyncSpinner spinner(1);  // one: messages keep their order
  spinner.start();
  int exitCode = 0;
  try {
    depthservo_ros::Publisher publisher(topics, parameters);
    depthservo_ros::NodeShell shell(topics, parameters);
    std::thread stopper([&] {
      ros::waitForShutdown();
      shell.node().stop("the node is shut down");
    });
    try {
      ROS_INFO("%s", shell.node().observe(&publisher).reason.c_str());
    } catch (const depthservo::InputError& error) {
      if (ros::ok()) exitCode = 2;  // else it was stopped before the first image
      ROS_FATAL("%s", error.what());
    }
    ros::shutdown();
    stopper.join();
    spinner.stop();
  } catch (const depthservo::InputError& error) {
    ROS_FATAL("%s", error.what());
    exitCode = 2;
  }
  return exitCode;
}
