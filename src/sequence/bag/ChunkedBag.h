#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>

#include "sequence/bag/Bag.h"
#include "sequence/bag/ByteSource.h"

namespace depthservo::detail {

/// A file of records, some of them packed into chunks: MCAP, or a ROS 1 bag.
class ChunkedBag : public Bag {
 public:
  std::vector<std::string> warnings() const override;
  void visit(BagVisitor& visitor) override;
  std::string read(const MessagePlace& place) override;

 protected:
  explicit ChunkedBag(const std::string& path) : file_(path) {}

  /// Records one after the other.
  struct Part {
    std::uint64_t start = 0;             ///< of the chunk's record in the file
    std::uint64_t offset = 0, size = 0;  ///< of what it holds, in the file [bytes]
    std::string packing{};               ///< "": none
    std::uint64_t unpacked = 0;          ///< [bytes]
    std::uint32_t crc = 0;               ///< of what is unpacked; 0: not told
    std::optional<std::set<std::uint32_t>> connections{};  ///< whose messages it has
  };

  /// What is to be known of a record.
  struct Record {
    std::uint64_t next = 0;  ///< place of the record after it
    bool isMessage = false;
    std::uint32_t connection = 0;
    std::int64_t received_ns = 0;
    std::uint64_t offset = 0, size = 0;  ///< of the message's bytes
  };

  /// The record at `offset`; who speaks on which topic is noted. Throws BagFault.
  virtual Record recordAt(ByteSource& bytes, std::uint64_t offset) = 0;

  /// Notes who speaks on which topic.
  void connect(std::uint32_t connection, BagTopic topic);

  FileBytes file_;
  std::vector<Part> parts_;
  std::string cut_;  ///< where the file is cut off or damaged; empty: nowhere

 private:
  ByteSource& open(std::size_t part);
  bool isWanted(const Part& part, const BagVisitor& visitor) const;
  void visitPart(std::size_t part, BagVisitor& visitor);
  void leaveOut(std::size_t part, const std::string& reason);

  std::map<std::uint32_t, std::size_t> topicOf_;
  std::unique_ptr<ByteSource> opened_;  // part openedPart_
  std::size_t openedPart_ = 0;
  std::set<std::size_t> leftOut_;
  std::string firstFault_;
};

std::unique_ptr<Bag> openMcap(const std::string& path);    ///< Throws InputError.
std::unique_ptr<Bag> openRosBag(const std::string& path);  ///< Throws InputError.
std::unique_ptr<Bag> openDb3(const std::string& path);     ///< Throws InputError.

}  // namespace depthservo::detail
