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
  try {
    depthservo_ros::Publisher publisher(topics, parameters);
    depthservo_ros::NodeShell shell(topics, parameters);
    std::thread stopper([&] {
      ros::waitForShutdown();
      shell.node().stop("the node is shut down");
    });
    const depthservo::RunLog log = shell.node().observe(&publisher);
    ROS_INFO("%s", log.reason.c_str());
    ros::requestShutdown();
    stopper.join();
    spinner.stop();
  } catch (const depthservo::InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
}
