#pragma once

#include <depthservo/rig/observe.h>
#include <image_transport/image_transport.h>
#include <ros/ros.h>

#include <string>

namespace depthservo_ros {

/// What was observed in each image, as messages: `depths`, `depths/cloud` and `overlay`, the last
/// two only while somebody listens.
class Publisher : public depthservo::RunWatcher {
 public:
  Publisher(ros::NodeHandle& topics, const ros::NodeHandle& parameters);

  bool onFrame(const depthservo::RunFrame& frame) override;

 private:
  std::string cameraFrame_ = "camera_optical_frame";
  ros::Publisher depths_, cloud_;
  image_transport::ImageTransport transport_;
  image_transport::Publisher overlay_;
};

}  // namespace depthservo_ros
