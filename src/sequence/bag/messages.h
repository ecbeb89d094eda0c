#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Twist.h"
#include "sequence/bag/MessageReader.h"

namespace depthservo::detail {

/// std_msgs/Header.
struct MessageHeader {
  std::int64_t stamp_ns = 0;  ///< 0: never set
  std::string frame;          ///< without a slash in front
};

/// sensor_msgs/CameraInfo, without binning and region of interest.
struct CameraInfoMessage {
  MessageHeader header;
  std::uint32_t width = 0, height = 0;  ///< [px]
  std::string model;
  std::vector<double> D;
  double K[9], R[9], P[12];
};

/// A velocity: nav_msgs/Odometry, geometry_msgs/Twist, TwistStamped, TwistWithCovarianceStamped.
struct TwistMessage {
  std::optional<MessageHeader> header;  ///< none: a Twist
  std::string frame;                    ///< in which it is told, and whose velocity it is
  Twist twist;
};

/// A pose: geometry_msgs/PoseStamped, PoseWithCovarianceStamped, nav_msgs/Odometry.
struct PoseMessage {
  MessageHeader header;
  std::string body;  ///< whose pose it is; empty: not told
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
};

/// geometry_msgs/TransformStamped.
struct TransformMessage {
  MessageHeader header;  ///< its frame is the parent
  std::string child;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< of the child in the parent
};

/// What is read of sensor_msgs/Image beside its pixels.
struct ImageMessage {
  MessageHeader header;
  std::uint32_t width = 0, height = 0;  ///< [px]
  std::string encoding;
  bool isBigEndian = false;
  std::uint32_t step = 0;  ///< bytes of a row
  std::size_t pixels = 0;  ///< where they start in the message
  std::uint32_t size = 0;  ///< bytes of them
};

/// sensor_msgs/CompressedImage; `data` is where the file starts in the message.
struct CompressedImageMessage {
  MessageHeader header;
  std::string format;
  std::size_t data = 0;
  std::uint32_t size = 0;  ///< bytes
};

bool isTwistType(const std::string& type);
bool isPoseType(const std::string& type);
bool isTransformType(const std::string& type);
bool hasHeader(const std::string& type);  ///< of the types here: it begins with one

// All throw BagFault: the bytes are no such message, or hold values that none can have.
MessageHeader readHeader(MessageReader& reader);
DEPTHSERVO_INNER TwistMessage readTwist(MessageReader reader, const std::string& type);
DEPTHSERVO_INNER PoseMessage readPose(MessageReader reader, const std::string& type);
DEPTHSERVO_INNER std::vector<TransformMessage> readTransforms(MessageReader reader);
DEPTHSERVO_INNER CameraInfoMessage readCameraInfo(MessageReader reader);
DEPTHSERVO_INNER MessageHeader readImu(MessageReader reader);
DEPTHSERVO_INNER std::vector<std::string> readJointNames(MessageReader reader,
                                                         MessageHeader& header);

// The first bytes are enough; pixels are left alone.
ImageMessage readImage(MessageReader reader);
DEPTHSERVO_INNER CompressedImageMessage readCompressedImage(MessageReader reader);

}  // namespace depthservo::detail
