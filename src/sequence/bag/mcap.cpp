#include <fmt/format.h>

#include <algorithm>

#include "depthservo/text/InputError.h"
#include "sequence/bag/ChunkedBag.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n"sv;
constexpr std::uint64_t kHead = 9;  // opcode, length

// https://mcap.dev/spec
enum class Op : unsigned char {
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  messageIndex = 7,
  chunkIndex = 8,
};

/// Fields of a record, packed and little-endian like those of ROS 1.
MessageReader fieldsOf(std::string_view content) { return {content, MessageEncoding::ros1}; }

class McapBag : public ChunkedBag {
 public:
  explicit McapBag(const std::string& path);

 protected:
  Record recordAt(ByteSource& bytes, std::uint64_t offset) override;

 private:
  struct Head {
    Op op;
    std::uint64_t size;
  };
  static Head headAt(ByteSource& bytes, std::uint64_t offset);
  void scan(std::uint64_t& offset);
  void scanFromIndex(std::uint64_t from);
  void addChunk(std::uint64_t offset, std::uint64_t size);
  void addPlain(std::uint64_t offset, std::uint64_t size);
  void takeSchema(std::string_view content);
  void takeChannel(std::string_view content);
  void takeChunkIndex(std::string_view content);

  std::map<std::uint16_t, std::pair<std::string, std::string>> schemas_;  // name, encoding
  std::map<std::uint64_t, std::set<std::uint32_t>> channelsOf_;           // by place of the chunk
  bool isWhole_ = false;
};

McapBag::McapBag(const std::string& path) : ChunkedBag(path) {
  const std::uint64_t magic = kMcapMagic.size();
  if (file_.size() < magic || file_.at(0, magic) != kMcapMagic) {
    throw InputError({path, 0, ""}, "is not an MCAP file (its first bytes are others)");
  }
  std::uint64_t offset = magic;
  try {
    scan(offset);
    if (!isWhole_) {
      cut_ = fmt::format(
          "the file ends at byte {} without its end (cut off?); what is whole before "
          "it is read",
          file_.size());
    }
  } catch (const BagFault& fault) {
    cut_ = fmt::format("the file is cut off or damaged: {}; what is whole before it is read",
                       fault.what());
    scanFromIndex(offset);
  }
  for (Part& part : parts_) {
    const auto channels = channelsOf_.find(part.start);
    if (channels != channelsOf_.end()) part.connections = channels->second;
  }
}

McapBag::Head McapBag::headAt(ByteSource& bytes, std::uint64_t offset) {
  MessageReader head = fieldsOf(bytes.at(offset, kHead));
  const auto op = static_cast<Op>(head.number<std::uint8_t>());
  const auto size = head.number<std::uint64_t>();
  if (size > bytes.size() - offset - kHead) {
    throw BagFault(fmt::format("a record at byte {} of {} bytes is not all there", offset, size));
  }
  return {op, size};
}

/// Goes from record to record to the end; the contents of chunks are left alone.
void McapBag::scan(std::uint64_t& offset) {
  while (offset < file_.size()) {
    const Head head = headAt(file_, offset);
    const std::uint64_t content = offset + kHead, next = content + head.size;
    switch (head.op) {
      case Op::footer:
        isWhole_ = true;
        return;
      case Op::chunk:
        addChunk(content, head.size);
        break;
      case Op::chunkIndex:
        takeChunkIndex(file_.at(content, head.size));
        break;
      case Op::schema:
      case Op::channel:
        recordAt(file_, offset);
        break;
      case Op::message:
        addPlain(offset, next - offset);
        break;
      default:
        break;
    }
    offset = next;
  }
}

/// Where the way from record to record is broken: the chunks behind, as the summary lists them.
void McapBag::scanFromIndex(std::uint64_t from) {
  constexpr std::uint64_t kFooter = kHead + 20 + 8;  // footer record, magic
  try {
    if (file_.size() < kFooter) return;
    const std::uint64_t footer = file_.size() - kFooter;
    if (headAt(file_, footer).op != Op::footer) return;
    auto summary = fieldsOf(file_.at(footer + kHead, 8)).number<std::uint64_t>();
    if (summary < from || summary >= footer) return;
    channelsOf_.clear();
    scan(summary);
    std::size_t more = 0;
    for (const auto& [offset, channels] : channelsOf_) {
      if (offset < from) continue;
      const Head head = headAt(file_, offset);
      if (head.op != Op::chunk) continue;
      addChunk(offset + kHead, head.size);
      ++more;
    }
    if (more > 0) cut_ += fmt::format(", and {} chunks behind it by the index", more);
  } catch (const BagFault&) {
    return;  // no index either
  }
}

void McapBag::addChunk(std::uint64_t offset, std::uint64_t size) {
  constexpr std::uint64_t kLongestHead = 64;
  MessageReader head = fieldsOf(file_.at(offset, std::min(size, kLongestHead)));
  head.number<std::uint64_t>();
  head.number<std::uint64_t>();
  Part part;
  part.start = offset - kHead;
  part.unpacked = head.number<std::uint64_t>();
  part.crc = head.number<std::uint32_t>();
  part.packing = head.text();
  part.size = head.number<std::uint64_t>();
  part.offset = offset + head.position();
  if (part.size > size - head.position()) {
    throw BagFault(fmt::format("a chunk at byte {} tells more bytes than it has", offset - kHead));
  }
  parts_.push_back(std::move(part));
}

void McapBag::addPlain(std::uint64_t offset, std::uint64_t size) {
  if (!parts_.empty() && parts_.back().start == parts_.back().offset &&
      parts_.back().offset + parts_.back().size == offset) {
    parts_.back().size += size;
  } else {
    parts_.push_back({offset, offset, size});
  }
}

void McapBag::takeSchema(std::string_view content) {
  MessageReader fields = fieldsOf(content);
  const auto id = fields.number<std::uint16_t>();
  std::string name(fields.text());
  schemas_[id] = {std::move(name), std::string(fields.text())};
}

void McapBag::takeChannel(std::string_view content) {
  MessageReader fields = fieldsOf(content);
  const auto id = fields.number<std::uint16_t>();
  const auto schema = schemas_.find(fields.number<std::uint16_t>());
  BagTopic topic;
  topic.name = fields.text();
  const std::string encoding(fields.text());
  if (schema != schemas_.end()) topic.type = plainType(schema->second.first);
  if (encoding == "ros1") {
    topic.encoding = MessageEncoding::ros1;
  } else if (encoding != "cdr") {
    topic.fault = fmt::format("is encoded as {}, expected cdr or ros1", detail::quoted(encoding));
  }
  connect(id, std::move(topic));
}

void McapBag::takeChunkIndex(std::string_view content) {
  MessageReader fields = fieldsOf(content);
  fields.number<std::uint64_t>();
  fields.number<std::uint64_t>();
  const auto chunk = fields.number<std::uint64_t>();
  fields.number<std::uint64_t>();
  constexpr std::size_t kEntry = 10;  // bytes: a channel, a place
  const std::size_t entries = fields.number<std::uint32_t>() / kEntry;
  std::set<std::uint32_t>& channels = channelsOf_[chunk];
  for (std::size_t i = 0; i < entries; ++i) {
    channels.insert(fields.number<std::uint16_t>());
    fields.number<std::uint64_t>();
  }
}

McapBag::Record McapBag::recordAt(ByteSource& bytes, std::uint64_t offset) {
  const Head head = headAt(bytes, offset);
  const std::uint64_t content = offset + kHead;
  Record record;
  record.next = content + head.size;
  if (head.op == Op::message) {
    constexpr std::uint64_t kFields = 22;
    if (head.size < kFields) throw BagFault("a message is too short");
    MessageReader fields = fieldsOf(bytes.at(content, kFields));
    record.isMessage = true;
    record.connection = fields.number<std::uint16_t>();
    fields.number<std::uint32_t>();
    record.received_ns = fields.number<std::int64_t>();
    record.offset = content + kFields;
    record.size = head.size - kFields;
  } else if (head.op == Op::schema) {
    takeSchema(bytes.at(content, head.size));
  } else if (head.op == Op::channel) {
    takeChannel(bytes.at(content, head.size));
  }
  return record;
}

}  // namespace

std::unique_ptr<Bag> openMcap(const std::string& path) { return std::make_unique<McapBag>(path); }

}  // namespace depthservo::detail
