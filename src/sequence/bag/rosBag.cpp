#include <fmt/format.h>

#include <algorithm>

#include "depthservo/text/InputError.h"
#include "sequence/bag/ChunkedBag.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::string_view kRosBagMagic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kLongestFields = std::uint64_t{1} << 20;  // bytes

// http://wiki.ros.org/Bags/Format/2.0
enum class RosOp : unsigned char {
  message = 2,
  file = 3,
  chunk = 5,
  chunkInfo = 6,
  connection = 7
};

/// "name=value" by name.
std::map<std::string, std::string> fieldsIn(std::string_view bytes) {
  std::map<std::string, std::string> fields;
  MessageReader reader(bytes, MessageEncoding::ros1);
  while (reader.position() < bytes.size()) {
    const std::string_view field = reader.text();
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) throw BagFault("it has a field without a value");
    fields[std::string(field.substr(0, equals))] = field.substr(equals + 1);
  }
  return fields;
}

template <class Number>
Number numberIn(const std::map<std::string, std::string>& fields, const char* name) {
  const auto field = fields.find(name);
  if (field == fields.end() || field->second.size() != sizeof(Number)) {
    throw BagFault(fmt::format("it has a record without {}", name));
  }
  return MessageReader(field->second, MessageEncoding::ros1).number<Number>();
}

/// Check sums that ROS 1 gives to the definitions of the messages that are read.
const char* md5Of(const std::string& type) {
  static const std::map<std::string, const char*> all = {
      {"sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743"},
      {"sensor_msgs/CompressedImage", "8f7a12909da2c9d3332d540a0977563f"},
      {"sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214"},
      {"sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2"},
      {"sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd"},
      {"nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7"},
      {"geometry_msgs/Twist", "9f195f881246fdfa2798d1d3eebca84a"},
      {"geometry_msgs/TwistStamped", "98d34b0043a2093cf9d9345ab6eef12e"},
      {"geometry_msgs/TwistWithCovarianceStamped", "8927a1a12fb2607ceea095b2dc440a96"},
      {"geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5"},
      {"geometry_msgs/PoseWithCovarianceStamped", "953b798c0f514ff060a53a3498ce6246"},
      {"tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec"},
      {"tf/tfMessage", "94810edda583a504dfda3829e70d7eec"},
  };
  const auto known = all.find(type);
  return known == all.end() ? nullptr : known->second;
}

class RosBag : public ChunkedBag {
 public:
  explicit RosBag(const std::string& path);

 protected:
  Record recordAt(ByteSource& bytes, std::uint64_t offset) override;

 private:
  struct Head {
    RosOp op;
    std::map<std::string, std::string> fields;
    std::uint64_t data, size;  // of the data
  };
  static Head headAt(ByteSource& bytes, std::uint64_t offset);
  void scan();
  void takeConnection(const Head& head, std::string_view data);
  void takeChunkInfo(const Head& head, std::string_view data);

  std::map<std::uint64_t, std::set<std::uint32_t>> connectionsOf_;  // by place of the chunk
};

RosBag::RosBag(const std::string& path) : ChunkedBag(path) {
  const std::uint64_t magic = kRosBagMagic.size();
  if (file_.size() < magic || file_.at(0, magic) != kRosBagMagic) {
    const bool isOld = file_.size() >= magic && file_.at(0, 8) == "#ROSBAG ";
    throw InputError({path, 0, ""}, isOld ? "is a bag of an older format than 2.0; convert it: "
                                            "rosbag migrate OLD NEW"
                                          : "is not a ROS 1 bag (its first bytes are others)");
  }
  try {
    scan();
  } catch (const BagFault& fault) {
    cut_ = fmt::format("the file is cut off or damaged: {}; what is whole before it is read",
                       fault.what());
  }
  for (Part& part : parts_) {
    const auto connections = connectionsOf_.find(part.start);
    if (connections != connectionsOf_.end()) part.connections = connections->second;
  }
}

RosBag::Head RosBag::headAt(ByteSource& bytes, std::uint64_t offset) {
  const auto lengthAt = [&](std::uint64_t at) {
    return MessageReader(bytes.at(at, 4), MessageEncoding::ros1).number<std::uint32_t>();
  };
  const std::uint64_t length = lengthAt(offset);
  if (length > kLongestFields || length + 8 > bytes.size() - offset) {
    throw BagFault(fmt::format("a record at byte {} is not all there", offset));
  }
  Head head;
  head.fields = fieldsIn(bytes.at(offset + 4, length));
  head.op = static_cast<RosOp>(numberIn<std::uint8_t>(head.fields, "op"));
  head.size = lengthAt(offset + 4 + length);
  head.data = offset + 8 + length;
  if (head.size > bytes.size() - head.data) {
    throw BagFault(
        fmt::format("a record at byte {} of {} bytes is not all there", offset, head.size));
  }
  return head;
}

/// Goes from record to record; the contents of chunks are left alone.
void RosBag::scan() {
  std::uint64_t offset = kRosBagMagic.size();
  std::optional<std::uint64_t> index;
  while (offset < file_.size()) {
    const Head head = headAt(file_, offset);
    if (head.op == RosOp::file) index = numberIn<std::uint64_t>(head.fields, "index_pos");
    if (head.op == RosOp::connection) takeConnection(head, file_.at(head.data, head.size));
    if (head.op == RosOp::chunkInfo) takeChunkInfo(head, file_.at(head.data, head.size));
    if (head.op == RosOp::chunk) {
      const auto packing = head.fields.find("compression");
      Part part{offset, head.data, head.size};
      part.packing = packing == head.fields.end() ? "?" : packing->second;
      if (part.packing == "none") part.packing.clear();
      part.unpacked = numberIn<std::uint32_t>(head.fields, "size");
      parts_.push_back(std::move(part));
    }
    offset = head.data + head.size;
  }
  if (!index || *index == 0 || *index > file_.size()) {
    cut_ = "the bag was never closed and has no index (cut off?); what is whole of it is read";
  }
}

void RosBag::takeConnection(const Head& head, std::string_view data) {
  const auto fields = fieldsIn(data);
  const auto valueOf = [&](const char* name) {
    const auto field = fields.find(name);
    return field == fields.end() ? std::string() : field->second;
  };
  BagTopic topic;
  const auto name = head.fields.find("topic");
  topic.name = name == head.fields.end() ? valueOf("topic") : name->second;
  topic.type = valueOf("type");
  topic.encoding = MessageEncoding::ros1;
  const char* md5 = md5Of(topic.type);
  if (md5 && valueOf("md5sum") != md5) {
    topic.fault = fmt::format("has another definition of {} than ROS (md5 {})", topic.type,
                              detail::quoted(valueOf("md5sum")));
  }
  connect(numberIn<std::uint32_t>(head.fields, "conn"), std::move(topic));
}

void RosBag::takeChunkInfo(const Head& head, std::string_view data) {
  auto& connections = connectionsOf_[numberIn<std::uint64_t>(head.fields, "chunk_pos")];
  MessageReader reader(data, MessageEncoding::ros1);
  const std::size_t count =
      std::min<std::size_t>(numberIn<std::uint32_t>(head.fields, "count"), data.size() / 8);
  for (std::size_t i = 0; i < count; ++i) {
    connections.insert(reader.number<std::uint32_t>());
    reader.number<std::uint32_t>();
  }
}

RosBag::Record RosBag::recordAt(ByteSource& bytes, std::uint64_t offset) {
  const Head head = headAt(bytes, offset);
  Record record;
  record.next = head.data + head.size;
  if (head.op == RosOp::message) {
    record.isMessage = true;
    record.connection = numberIn<std::uint32_t>(head.fields, "conn");
    const auto time = numberIn<std::uint64_t>(head.fields, "time");
    record.received_ns = static_cast<std::int64_t>(time & 0xffffffff) * 1'000'000'000 +
                         static_cast<std::int64_t>(time >> 32);
    record.offset = head.data;
    record.size = head.size;
  } else if (head.op == RosOp::connection) {
    takeConnection(head, bytes.at(head.data, head.size));
  }
  return record;
}

}  // namespace

std::unique_ptr<Bag> openRosBag(const std::string& path) { return std::make_unique<RosBag>(path); }

}  // namespace depthservo::detail
