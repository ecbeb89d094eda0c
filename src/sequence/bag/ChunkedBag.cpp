#include "sequence/bag/ChunkedBag.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "sequence/bag/unpack.h"

namespace depthservo::detail {

std::vector<std::string> ChunkedBag::warnings() const {
  std::vector<std::string> all = warnings_;
  if (!cut_.empty()) all.push_back(cut_);
  if (!leftOut_.empty()) {
    all.push_back(fmt::format("{} of {} chunks are damaged and left out, the first {}",
                              leftOut_.size(), parts_.size(), firstFault_));
  }
  return all;
}

void ChunkedBag::leaveOut(std::size_t part, const std::string& reason) {
  if (leftOut_.empty()) {
    firstFault_ = fmt::format("at byte {}: {}", parts_[part].offset, reason);
  }
  leftOut_.insert(part);
}

void ChunkedBag::connect(std::uint32_t connection, BagTopic topic) {
  if (topicOf_.count(connection) > 0) return;
  topic.name = printable(topic.name);
  topic.type = printable(topic.type);
  const auto same = std::find_if(topics_.begin(), topics_.end(), [&](const BagTopic& other) {
    return other.name == topic.name && other.type == topic.type &&
           other.encoding == topic.encoding && other.fault == topic.fault;
  });
  topicOf_[connection] = static_cast<std::size_t>(same - topics_.begin());
  if (same == topics_.end()) topics_.push_back(std::move(topic));
}

ByteSource& ChunkedBag::open(std::size_t part) {
  if (opened_ && openedPart_ == part) return *opened_;
  opened_.reset();
  const Part& p = parts_[part];
  if (p.packing.empty()) {
    opened_ = std::make_unique<PartOfBytes>(file_, p.offset, p.size);
  } else {
    auto bytes = unpack(file_.at(p.offset, p.size), p.packing, p.unpacked);
    const auto crc = crc32_z(0, reinterpret_cast<const unsigned char*>(bytes->data()),
                             static_cast<std::size_t>(bytes->size()));
    if (p.crc != 0 && crc != p.crc) throw BagFault("its check sum is wrong");
    opened_ = std::move(bytes);
  }
  openedPart_ = part;
  return *opened_;
}

bool ChunkedBag::isWanted(const Part& part, const BagVisitor& visitor) const {
  if (!part.connections) return true;
  return std::any_of(part.connections->begin(), part.connections->end(), [&](std::uint32_t c) {
    const auto topic = topicOf_.find(c);
    return topic == topicOf_.end() || visitor.wanted(topics_[topic->second]) > 0;
  });
}

void ChunkedBag::visit(BagVisitor& visitor) {
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    if (!isWanted(parts_[part], visitor)) continue;
    try {
      visitPart(part, visitor);
    } catch (const BagFault& fault) {
      leaveOut(part, fault.what());
    }
  }
}

void ChunkedBag::visitPart(std::size_t part, BagVisitor& visitor) {
  ByteSource& bytes = open(part);
  std::uint64_t offset = 0;
  while (offset < bytes.size()) {
    const Record record = recordAt(bytes, offset);
    offset = record.next;
    if (!record.isMessage) continue;
    const auto topic = topicOf_.find(record.connection);
    if (topic == topicOf_.end()) throw BagFault("it has a message of no topic");
    const std::uint64_t wanted = visitor.wanted(topics_[topic->second]);
    if (wanted == 0) continue;
    visitor.visit({topic->second,
                   record.received_ns,
                   bytes.at(record.offset, std::min(wanted, record.size)),
                   {0, static_cast<std::uint32_t>(part), record.offset, record.size}});
  }
}

std::string ChunkedBag::read(const MessagePlace& place) {
  return std::string(open(place.part).at(place.offset, place.size));
}

}  // namespace depthservo::detail
