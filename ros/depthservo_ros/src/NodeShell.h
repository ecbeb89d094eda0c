#pragma once

#include <depthservo/servo/RobotNode.h>
#include <diagnostic_updater/diagnostic_updater.h>
#include <image_transport/image_transport.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_srvs/Trigger.h>

namespace depthservo_ros {

/// Topics in, diagnostics and the service `~teach`: what both nodes share. All that is not ROS is
/// in depthservo::RobotNode.
class NodeShell {
 public:
  NodeShell(ros::NodeHandle& topics, ros::NodeHandle& parameters);

  depthservo::RobotNode& node() { return node_; }

 private:
  void onImage(const sensor_msgs::ImageConstPtr& message);
  void onCamera(const sensor_msgs::CameraInfoConstPtr& message);
  void onOdometry(const nav_msgs::OdometryConstPtr& message);
  bool teach(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  ros::NodeHandle parameters_;
  depthservo::RobotNode node_;
  image_transport::ImageTransport transport_;
  image_transport::Subscriber image_;
  ros::Subscriber camera_, odometry_;
  ros::ServiceServer teach_;
  diagnostic_updater::Updater diagnostics_;
  ros::Timer diagnosing_;
};

}  // namespace depthservo_ros
