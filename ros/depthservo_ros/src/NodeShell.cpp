#include "NodeShell.h"

#include <depthservo/text/InputError.h>
#include <sensor_msgs/image_encodings.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "parameters.h"

namespace depthservo_ros {
namespace {

namespace encodings = sensor_msgs::image_encodings;
using depthservo::InputError;

depthservo::RobotNodeOptions optionsOf(const ros::NodeHandle& parameters) {
  depthservo::RobotNodeOptions options = nodeOptions(parameters);
  options.baseFromCamera = baseFromCamera(parameters);
  return options;
}

/// Gray, 8 bit. \throw InputError an encoding that is not known here
DEPTHSERVO_VISP vpImage<unsigned char> grayOf(const sensor_msgs::Image& message) {
  const auto height = static_cast<int>(message.height), width = static_cast<int>(message.width);
  int type = CV_8UC1, toGray = -1;
  if (message.encoding == encodings::RGB8)
    type = CV_8UC3, toGray = cv::COLOR_RGB2GRAY;
  else if (message.encoding == encodings::BGR8)
    type = CV_8UC3, toGray = cv::COLOR_BGR2GRAY;
  else if (message.encoding == encodings::RGBA8)
    type = CV_8UC4, toGray = cv::COLOR_RGBA2GRAY;
  else if (message.encoding == encodings::BGRA8)
    type = CV_8UC4, toGray = cv::COLOR_BGRA2GRAY;
  else if (message.encoding != encodings::MONO8 && message.encoding != encodings::TYPE_8UC1) {
    throw InputError({"image", 0, "encoding"},
                     "expected mono8, rgb8, bgr8, rgba8 or bgra8, got " + message.encoding);
  }
  if (message.step * message.height > message.data.size() ||
      message.step < CV_MAT_CN(type) * message.width) {
    throw InputError({"image", 0, "data"}, "is shorter than its height says");
  }
  const cv::Mat pixels(height, width, type, const_cast<std::uint8_t*>(message.data.data()),
                       message.step);
  DEPTHSERVO_VISP vpImage<unsigned char> gray(message.height, message.width);
  cv::Mat target(height, width, CV_8UC1, gray.bitmap);
  if (toGray >= 0)
    cv::cvtColor(pixels, target, toGray);
  else
    pixels.copyTo(target);
  return gray;
}

}  // namespace

NodeShell::NodeShell(ros::NodeHandle& topics, ros::NodeHandle& parameters)
    : parameters_(parameters), node_(optionsOf(parameters)), transport_(topics) {
  constexpr std::uint32_t kImages = 100, kRows = 10000;  // playback must not lose any
  camera_ = topics.subscribe("camera_info", 1, &NodeShell::onCamera, this);
  odometry_ = topics.subscribe("odometry", kRows, &NodeShell::onOdometry, this,
                               ros::TransportHints().tcpNoDelay());
  const image_transport::TransportHints hints("raw", ros::TransportHints().tcpNoDelay(),
                                              parameters);
  image_ = transport_.subscribe("image", kImages, &NodeShell::onImage, this, hints);
  teach_ = parameters_.advertiseService("teach", &NodeShell::teach, this);
  diagnostics_.setHardwareID("none");
  diagnostics_.add(
      "depths", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  diagnosing_ = topics.createTimer(ros::Duration(1),
                                   [this](const ros::TimerEvent&) { diagnostics_.update(); });
}

void NodeShell::onImage(const sensor_msgs::ImageConstPtr& message) {
  try {
    node_.push({message->header.stamp.toSec(), grayOf(*message)});
  } catch (const InputError& error) {
    ROS_ERROR_THROTTLE(5, "%s", error.what());
  }
}

void NodeShell::onCamera(const sensor_msgs::CameraInfoConstPtr& message) {
  const auto& K = message->K;
  const auto& D = message->D;
  const bool isPinhole =
      message->distortion_model.empty() || message->distortion_model == "plumb_bob" || D.empty();
  if (!isPinhole || (!D.empty() && D.size() < 4) || !(K[0] > 0) || !(K[4] > 0)) {
    ROS_ERROR_THROTTLE(5,
                       "camera_info: expected a calibrated camera of distortion_model plumb_bob");
    return;
  }
  depthservo::PinholeCamera camera{
      static_cast<int>(message->width), static_cast<int>(message->height), K[0], K[4], K[2], K[5]};
  if (!D.empty()) camera.distortion = {D[0], D[1], D[2], D[3], D.size() > 4 ? D[4] : 0};
  node_.setCamera(camera);
}

void NodeShell::onOdometry(const nav_msgs::OdometryConstPtr& message) {
  const auto& v = message->twist.twist.linear;
  const auto& w = message->twist.twist.angular;
  node_.pushBaseTwist(message->header.stamp.toSec(), {{v.x, v.y, v.z}, {w.x, w.y, w.z}});
}

bool NodeShell::teach(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  std::string folder;
  if (!parameters_.getParam("goal", folder)) {
    response.message = "the parameter goal names no folder to write to";
    return true;
  }
  try {
    const auto goal = node_.teach(teachOptions(parameters_), folder);
    response.success = true;
    response.message = std::to_string(goal.points.size()) + " points, written to " + folder;
  } catch (const std::exception& error) {
    response.message = error.what();
  }
  return true;
}

/// ERROR without images or odometry, or with all points lost; WARN with few that are known.
void NodeShell::diagnose(diagnostic_updater::DiagnosticStatusWrapper& message) const {
  using depthservo::DepthStatus;
  using Level = diagnostic_msgs::DiagnosticStatus;
  constexpr double kOld_s = 1;
  const depthservo::NodeStatus status = node_.status();
  int points = 0, lost = 0, known = 0;
  for (const auto& [worth, count] : status.points) {
    points += count;
    lost += worth == DepthStatus::lost ? count : 0;
    known += worth == DepthStatus::valid || worth == DepthStatus::converging ? count : 0;
    message.add(std::string("points ") + depthservo::toString(worth), count);
  }
  const double now_s = ros::Time::now().toSec();
  message.add("images", status.images);
  message.add("images left out", status.leftOut);
  message.add("age of the image [s]", now_s - status.image_s);
  message.add("odometry rows", status.rows);
  message.add("odometry refused", status.refused);
  message.add("age of the odometry [s]", now_s - status.odometry_s);
  message.add("held", depthservo::toString(status.held));
  message.add("news", status.news);
  if (status.images == 0)
    message.summary(Level::ERROR, "no image yet");
  else if (!(now_s - status.image_s < kOld_s))
    message.summary(Level::ERROR, "no new image");
  else if (!(now_s - status.odometry_s < kOld_s))
    message.summary(Level::ERROR, "no new odometry");
  else if (points == 0 || lost == points)
    message.summary(Level::ERROR, "no point");
  else if (isFault(status.held))
    message.summary(Level::WARN, wordsOf(status.held));
  else if (2 * known < points)
    message.summary(Level::WARN, "few points are being observed");
  else
    message.summary(Level::OK, "points are being observed");
}

}  // namespace depthservo_ros
