#include "sequence/bag/messages.h"

#include <fmt/format.h>

#include <cmath>

#include "sequence/bag/Bag.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kCovariance = 36;

std::string frameName(std::string_view name) {
  if (!name.empty() && name.front() == '/') name.remove_prefix(1);  // as tf names them
  return printable(name);
}

Twist readTwistFields(MessageReader& reader) {
  double values[6];
  reader.doubles(values);
  constexpr double kMost = 1e3;  // m/s or rad/s
  for (const double value : values) {
    if (!(std::abs(value) <= kMost)) {
      throw BagFault(fmt::format("it has the velocity {}, expected up to {}", value, kMost));
    }
  }
  return {{values[0], values[1], values[2]}, {values[3], values[4], values[5]}};
}

Eigen::Isometry3d readPoseFields(MessageReader& reader) {
  double p[3], q[4];
  reader.doubles(p);
  reader.doubles(q);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  constexpr double kNormError = 0.02, kFarthest = 1e7;  // m
  const Eigen::Vector3d position(p[0], p[1], p[2]);
  if (!(position.array().abs() <= kFarthest).all()) throw BagFault("it has no finite position");
  if (!(std::abs(rotation.norm() - 1) <= kNormError)) {
    throw BagFault(fmt::format("it has a quaternion of norm {}, expected 1", rotation.norm()));
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = position;
  pose.linear() = rotation.normalized().toRotationMatrix();
  return pose;
}

}  // namespace

bool isTwistType(const std::string& type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/TwistStamped" ||
         type == "geometry_msgs/TwistWithCovarianceStamped" || type == "geometry_msgs/Twist";
}

bool isPoseType(const std::string& type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped";
}

bool isTransformType(const std::string& type) {
  return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
}

bool hasHeader(const std::string& type) {
  return type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage" ||
         type == "sensor_msgs/CameraInfo" || type == "sensor_msgs/Imu" ||
         type == "sensor_msgs/JointState" || isPoseType(type) ||
         (isTwistType(type) && type != "geometry_msgs/Twist");
}

MessageHeader readHeader(MessageReader& reader) {
  if (reader.isRos1()) reader.number<std::uint32_t>();  // seq
  const auto seconds = reader.isRos1() ? std::int64_t{reader.number<std::uint32_t>()}
                                       : std::int64_t{reader.number<std::int32_t>()};
  const auto rest = reader.number<std::uint32_t>();
  constexpr std::int64_t kSecond = 1'000'000'000;
  if (rest >= kSecond) throw BagFault(fmt::format("its stamp has {} nanoseconds", rest));
  return {seconds * kSecond + rest, frameName(reader.text())};
}

TwistMessage readTwist(MessageReader reader, const std::string& type) {
  TwistMessage message;
  if (type != "geometry_msgs/Twist") {
    message.header = readHeader(reader);
    message.frame = message.header->frame;
  }
  if (type == "nav_msgs/Odometry") {
    message.frame = frameName(reader.text());
    reader.skipDoubles(7 + kCovariance);
  }
  message.twist = readTwistFields(reader);
  if (type == "nav_msgs/Odometry" || type == "geometry_msgs/TwistWithCovarianceStamped") {
    reader.skipDoubles(kCovariance);
  }
  reader.requireEnd();
  return message;
}

PoseMessage readPose(MessageReader reader, const std::string& type) {
  PoseMessage message;
  message.header = readHeader(reader);
  if (type == "nav_msgs/Odometry") message.body = frameName(reader.text());
  message.pose = readPoseFields(reader);
  if (type == "nav_msgs/Odometry") reader.skipDoubles(kCovariance + 6 + kCovariance);
  if (type == "geometry_msgs/PoseWithCovarianceStamped") reader.skipDoubles(kCovariance);
  reader.requireEnd();
  return message;
}

std::vector<TransformMessage> readTransforms(MessageReader reader) {
  constexpr std::size_t kLeast = 16 + 7 * sizeof(double);
  std::vector<TransformMessage> all(reader.length(kLeast));
  for (TransformMessage& message : all) {
    message.header = readHeader(reader);
    message.child = frameName(reader.text());
    message.pose = readPoseFields(reader);
  }
  reader.requireEnd();
  return all;
}

CameraInfoMessage readCameraInfo(MessageReader reader) {
  CameraInfoMessage message;
  message.header = readHeader(reader);
  message.height = reader.number<std::uint32_t>();
  message.width = reader.number<std::uint32_t>();
  message.model = reader.text();
  message.D = reader.doubles();
  reader.doubles(message.K);
  reader.doubles(message.R);
  reader.doubles(message.P);
  for (int i = 0; i < 6; ++i) reader.number<std::uint32_t>();  // binning, region of interest
  reader.number<std::uint8_t>();
  reader.requireEnd();
  return message;
}

MessageHeader readImu(MessageReader reader) {
  MessageHeader header = readHeader(reader);
  reader.skipDoubles(4 + 9 + 3 + 9 + 3 + 9);
  reader.requireEnd();
  return header;
}

std::vector<std::string> readJointNames(MessageReader reader, MessageHeader& header) {
  header = readHeader(reader);
  std::vector<std::string> names(reader.length(4));
  for (std::string& name : names) name = reader.text();
  for (int i = 0; i < 3; ++i) reader.doubles();  // position, velocity, effort
  reader.requireEnd();
  return names;
}

ImageMessage readImage(MessageReader reader) {
  ImageMessage message;
  message.header = readHeader(reader);
  message.height = reader.number<std::uint32_t>();
  message.width = reader.number<std::uint32_t>();
  message.encoding = reader.text();
  message.isBigEndian = reader.number<std::uint8_t>() != 0;
  message.step = reader.number<std::uint32_t>();
  message.size = reader.number<std::uint32_t>();
  message.pixels = reader.position();
  return message;
}

CompressedImageMessage readCompressedImage(MessageReader reader) {
  CompressedImageMessage message;
  message.header = readHeader(reader);
  message.format = reader.text();
  message.size = reader.number<std::uint32_t>();
  message.data = reader.position();
  return message;
}

}  // namespace depthservo::detail
