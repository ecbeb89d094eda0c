// Bags: MCAP, ROS 1, SQLite of ROS 2; and single messages, whose type is told by their first byte.
#include <cmath>

#include "Target.h"
#include "depthservo/sequence/RecordingInfo.h"
#include "sequence/bag/ByteSource.h"
#include "sequence/bag/messages.h"
#include "sequence/bag/rosImage.h"

namespace depthservo::fuzz {
namespace {

void readBag(const std::string& file) {
  describeRecording(file, {});
  const Sequence sequence(file);
  for (const OdometryRow& row : sequence.odometry()) {
    require(std::isfinite(row.time_s) && row.twist.isFinite(), "finite odometry");
  }
  for (std::size_t k = 0; k < sequence.frames().size() && k < 3; ++k) sequence.readImage(k);
}

const Target kMcap("mcap", [](const std::string& bytes) { readBag(written("a.mcap", bytes)); });
const Target kRosBag("rosbag", [](const std::string& bytes) { readBag(written("a.bag", bytes)); });
const Target kDb3("db3", [](const std::string& bytes) { readBag(written("a.db3", bytes)); });

void readMessage(const detail::MessageReader& reader, unsigned kind, std::string_view bytes,
                 detail::MessageEncoding encoding) {
  static const char* const kTwistTypes[] = {"nav_msgs/Odometry", "geometry_msgs/Twist",
                                        "geometry_msgs/TwistStamped",
                                        "geometry_msgs/TwistWithCovarianceStamped"};
  static const char* const kPoseTypes[] = {"geometry_msgs/PoseStamped",
                                       "geometry_msgs/PoseWithCovarianceStamped", "nav_msgs/Odometry"};
  detail::MessageHeader header;
  if (kind < 4) {
    require(detail::readTwist(reader, kTwistTypes[kind]).twist.isFinite(), "a finite twist");
  } else if (kind < 7) {
    require(detail::readPose(reader, kPoseTypes[kind - 4]).pose.matrix().allFinite(), "a finite pose");
  } else if (kind == 7) {
    detail::readTransforms(reader);
  } else if (kind == 8) {
    detail::readCameraInfo(reader);
  } else if (kind == 9) {
    detail::readImu(reader);
  } else if (kind == 10) {
    detail::readJointNames(reader, header);
  } else if (kind == 11) {
    detail::readCompressedImage(reader);
  } else {
    const detail::ImageFormat format = detail::rosImageFormat(encoding);
    const detail::ImageHeader image = format.header(bytes);
    std::string levels(std::size_t(image.size.width) * std::size_t(image.size.height) *
                           std::size_t(image.bytes),
                       '\0');
    format.decode(bytes, image, levels.data());
  }
}

const Target kMessage("message", [](const std::string& bytes) {
  if (bytes.empty()) return;
  const auto first = static_cast<unsigned char>(bytes[0]);
  const auto encoding = first % 2 ? detail::MessageEncoding::cdr : detail::MessageEncoding::ros1;
  const std::string_view rest = std::string_view(bytes).substr(1);
  try {
    readMessage(detail::MessageReader(rest, encoding), first / 2 % 13, rest, encoding);
  } catch (const detail::BagFault&) {
  } catch (const detail::ImageFault&) {
  }
});

}  // namespace
}  // namespace depthservo::fuzz
