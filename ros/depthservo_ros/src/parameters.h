#pragma once

#include <depthservo/servo/RobotNode.h>
#include <ros/ros.h>

#include <string>

namespace depthservo_ros {

/// The node's private parameters, named as the fields of the library's options; what is not given
/// keeps its default. \throw depthservo::InputError a value that cannot be used
depthservo::RobotNodeOptions nodeOptions(const ros::NodeHandle& parameters);
depthservo::ServoTask servoTask(const ros::NodeHandle& parameters);
depthservo::TeachOptions teachOptions(const ros::NodeHandle& parameters);

/// Pose of the camera in the base: `camera_in_base` [x, y, z, roll, pitch, yaw], or else as tf has
/// it between the frames `base_frame` and `camera_frame`. \throw depthservo::InputError neither
Eigen::Isometry3d baseFromCamera(const ros::NodeHandle& parameters);

}  // namespace depthservo_ros
