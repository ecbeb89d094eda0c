#include "Publisher.h"

#include <depthservo_ros/PointDepths.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/image_encodings.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <opencv2/imgproc.hpp>

namespace depthservo_ros {
namespace {

using depthservo::DepthEstimate;
using depthservo::DepthStatus;
using depthservo::FeatureRecord;

PointDepth messageOf(const FeatureRecord& feature) {
  const DepthEstimate& e = feature.estimate;
  PointDepth point;
  point.id = feature.id;
  point.u = feature.u;
  point.v = feature.v;
  point.measured = feature.measured;
  point.z = e.Z();
  point.x = e.x * point.z;
  point.y = e.y * point.z;
  point.sigma_z = e.sigma_Z();
  point.z_low = e.interval().low;
  point.z_high = e.interval().high;
  point.sigma_xy = e.sigma_xy;
  point.excitation = e.excitation;
  point.status = static_cast<std::uint8_t>(e.status);
  return point;
}

sensor_msgs::PointCloud2 cloudOf(const PointDepths& depths) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = depths.header;
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier fields(cloud);
  using Field = sensor_msgs::PointField;
  fields.setPointCloud2Fields(6, "x", 1, Field::FLOAT32, "y", 1, Field::FLOAT32, "z", 1,
                              Field::FLOAT32, "sigma_z", 1, Field::FLOAT32, "id", 1, Field::INT32,
                              "status", 1, Field::UINT8);
  fields.resize(depths.points.size());
  if (depths.points.empty()) return cloud;
  sensor_msgs::PointCloud2Iterator<float> x(cloud, "x"), sigma(cloud, "sigma_z");
  sensor_msgs::PointCloud2Iterator<std::int32_t> id(cloud, "id");
  sensor_msgs::PointCloud2Iterator<std::uint8_t> status(cloud, "status");
  for (const PointDepth& point : depths.points) {
    x[0] = static_cast<float>(point.x);
    x[1] = static_cast<float>(point.y);
    x[2] = static_cast<float>(point.z);
    *sigma = static_cast<float>(point.sigma_z);
    *id = point.id;
    *status = point.status;
    ++x, ++sigma, ++id, ++status;
  }
  return cloud;
}

/// Green: valid; orange: rejected or lost; gray: coasting; blue: being learnt.
cv::Scalar colorOf(DepthStatus status) {
  switch (status) {
    case DepthStatus::valid:
      return {0, 158, 115};
    case DepthStatus::rejected:
    case DepthStatus::lost:
      return {213, 94, 0};
    case DepthStatus::coasting:
      return {150, 150, 150};
    default:
      return {86, 180, 233};
  }
}

sensor_msgs::Image overlayOf(const depthservo::RunFrame& frame, const std_msgs::Header& header) {
  const auto& gray = frame.exposure.image;
  sensor_msgs::Image message;
  message.header = header;
  message.width = gray.getWidth();
  message.height = gray.getHeight();
  message.encoding = sensor_msgs::image_encodings::RGB8;
  message.step = 3 * message.width;
  message.data.resize(static_cast<std::size_t>(message.step) * message.height);
  const auto rows = static_cast<int>(message.height), columns = static_cast<int>(message.width);
  cv::Mat picture(rows, columns, CV_8UC3, message.data.data());
  cv::cvtColor(cv::Mat(rows, columns, CV_8UC1, gray.bitmap), picture, cv::COLOR_GRAY2RGB);
  constexpr double kFarthest_px = 1e4, kSize = 0.4;
  const auto shows = [](double u, double v) {
    return std::abs(u) < kFarthest_px && std::abs(v) < kFarthest_px;
  };
  for (const Eigen::Vector2d& goal : frame.log.goals) {
    if (shows(goal.x(), goal.y())) {
      cv::circle(picture, cv::Point2d(goal.x(), goal.y()), 8, {230, 159, 0}, 1, cv::LINE_AA);
    }
  }
  for (const FeatureRecord& feature : frame.record.features) {
    if (!shows(feature.u, feature.v)) continue;
    const cv::Scalar color = colorOf(feature.estimate.status);
    const cv::Point2d place(feature.u, feature.v);
    cv::circle(picture, place, 5, color, feature.measured ? 2 : 1, cv::LINE_AA);
    cv::putText(picture, cv::format("%d: %.2f m", feature.id, feature.estimate.Z()),
                place + cv::Point2d(8, 4), cv::FONT_HERSHEY_SIMPLEX, kSize, color, 1, cv::LINE_AA);
  }
  return message;
}

}  // namespace

Publisher::Publisher(ros::NodeHandle& topics, const ros::NodeHandle& parameters)
    : depths_(topics.advertise<PointDepths>("depths", 1000)),
      cloud_(topics.advertise<sensor_msgs::PointCloud2>("depths/cloud", 10)),
      transport_(topics),
      overlay_(transport_.advertise("overlay", 1)) {
  parameters.getParam("camera_frame", cameraFrame_);
}

bool Publisher::onFrame(const depthservo::RunFrame& frame) {
  PointDepths depths;
  depths.header.stamp.fromSec(frame.record.time_s);
  depths.header.frame_id = cameraFrame_;
  for (const FeatureRecord& feature : frame.record.features) {
    if (feature.estimate.status != DepthStatus::unset) depths.points.push_back(messageOf(feature));
  }
  depths_.publish(depths);
  if (cloud_.getNumSubscribers() > 0) cloud_.publish(cloudOf(depths));
  if (overlay_.getNumSubscribers() > 0 && frame.exposure.hasImage()) {
    overlay_.publish(overlayOf(frame, depths.header));
  }
  return ros::ok();
}

}  // namespace depthservo_ros
