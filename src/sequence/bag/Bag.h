#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sequence/bag/MessageReader.h"

namespace depthservo::detail {

/// A topic as a bag lists it.
struct BagTopic {
  std::string name;                                 ///< "/camera/image_raw"
  std::string type;                                 ///< "sensor_msgs/Image", whatever ROS it is of
  MessageEncoding encoding = MessageEncoding::cdr;  ///< of its messages
  std::string fault;                                ///< why they cannot be decoded; empty: they can
};

/// Where a message is.
struct MessagePlace {
  std::uint32_t file = 0, part = 0;  ///< of several files; of a file
  std::uint64_t offset = 0;
  std::uint64_t size = 0;  ///< bytes
};

/// A message while a bag is gone through.
struct BagMessage {
  std::size_t topic = 0;  ///< place in the list of topics
  std::int64_t received_ns = 0;
  std::string_view bytes;  ///< as many as are wanted
  MessagePlace place;
};

/// Who goes through a bag.
class BagVisitor {
 public:
  virtual ~BagVisitor() = default;

  /// How many bytes of every message of a topic are to be shown; 0: the topic may be passed over.
  virtual std::size_t wanted(const BagTopic& topic) const = 0;
  virtual void visit(const BagMessage& message) = 0;
};

/// Messages in a file, whatever its format. What is damaged is left out and told.
class Bag {
 public:
  virtual ~Bag() = default;

  /// What is known of them; complete after a visit.
  const std::vector<BagTopic>& topics() const { return topics_; }

  /// What was left out, one sentence each.
  virtual std::vector<std::string> warnings() const { return warnings_; }

  /// Shows the messages in the order of the file. Memory: one chunk.
  virtual void visit(BagVisitor& visitor) = 0;

  /// The message at a place. Throws BagFault.
  virtual std::string read(const MessagePlace& place) = 0;

 protected:
  std::vector<BagTopic> topics_;
  std::vector<std::string> warnings_;
};

/// Whether it is a bag by its name or its first bytes: .bag, .mcap, .db3, or the folder of a ROS 2
/// recording.
bool isBagPath(const std::string& path);

/// Opens a ROS 1 bag (2.0), an MCAP file, a SQLite file of ROS 2, or the folder of a ROS 2
/// recording. Throws InputError.
std::unique_ptr<Bag> openBag(const std::string& path);

/// A name as it may be shown: at most 200 bytes, no control characters.
std::string printable(std::string_view name);

/// "sensor_msgs/Image" of "sensor_msgs/msg/Image".
std::string plainType(const std::string& type);

}  // namespace depthservo::detail
