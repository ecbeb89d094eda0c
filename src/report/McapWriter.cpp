#include "report/McapWriter.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <stdexcept>

namespace depthservo {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunk_bytes = 1 << 20;  // a chunk is closed once it has as many
constexpr int kLevel = 3;                      // of zstd: its default

enum Opcode : char {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kStatistics = 11,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};

/// Bytes of a record: integers little-endian, strings and lists after their length.
class Bytes {
 public:
  Bytes& u8(std::uint8_t value) { return number(value, 1); }
  Bytes& u16(std::uint16_t value) { return number(value, 2); }
  Bytes& u32(std::uint32_t value) { return number(value, 4); }
  Bytes& u64(std::uint64_t value) { return number(value, 8); }
  Bytes& raw(std::string_view bytes) {
    text_ += bytes;
    return *this;
  }
  Bytes& string(std::string_view text) {
    return u32(static_cast<std::uint32_t>(text.size())).raw(text);
  }
  Bytes& strings(const McapWriter::Strings& values) {
    Bytes list;
    for (const auto& [key, value] : values) list.string(key).string(value);
    return string(list.text_);
  }
  const std::string& text() const { return text_; }

 private:
  Bytes& number(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) text_ += static_cast<char>(value >> (8 * i));
    return *this;
  }
  std::string text_;
};

std::string record(Opcode opcode, const Bytes& content) {
  Bytes whole;
  whole.raw({reinterpret_cast<const char*>(&opcode), 1}).u64(content.text().size());
  return whole.raw(content.text()).text();
}

std::uint32_t crcOf(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string compressed(const std::string& bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(size)) throw std::runtime_error(ZSTD_getErrorName(size));
  result.resize(size);
  return result;
}

}  // namespace

void McapWriter::Times::add(std::uint64_t t) {
  first = std::min(first, t);
  last = std::max(last, t);
}

McapWriter::McapWriter(const std::string& file) : file_(file) {
  write(kMagic);
  write(record(kHeader, Bytes().string("").string("depthservo " DEPTHSERVO_VERSION)));
}

void McapWriter::write(std::string_view bytes) {
  file_.write(bytes);
  crc_ = crcOf(bytes, crc_);
}

std::uint16_t McapWriter::addSchema(const std::string& name, std::string_view text) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0: none
  schemas_.push_back(
      record(kSchema, Bytes().u16(id).string(name).string("jsonschema").string(text)));
  chunk_ += schemas_.back();
  return id;
}

std::uint16_t McapWriter::addChannel(const std::string& topic, std::uint16_t schema) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  channels_.push_back(
      {record(kChannel, Bytes().u16(id).u16(schema).string(topic).string("json").strings({})),
       0,
       {}});
  chunk_ += channels_.back().record;
  return id;
}

void McapWriter::addMessage(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  Channel& c = channels_.at(channel);
  c.index.emplace_back(time_ns, chunk_.size());
  chunk_ +=
      record(kMessage, Bytes().u16(channel).u32(c.messages++).u64(time_ns).u64(time_ns).raw(json));
  ++messages_;
  chunkTimes_.add(time_ns);
  times_.add(time_ns);
  if (chunk_.size() >= kChunk_bytes) endChunk();
}

void McapWriter::addMetadata(const std::string& name, const Strings& values) {
  endChunk();
  const std::string text = record(kMetadata, Bytes().string(name).strings(values));
  metadataIndices_.push_back(
      record(kMetadataIndex, Bytes().u64(file_.size()).u64(text.size()).string(name)));
  write(text);
}

void McapWriter::endChunk() {
  if (chunk_.empty()) return;
  const std::string packed = compressed(chunk_);
  const std::string text = record(kChunk, Bytes()
                                              .u64(chunkTimes_.start())
                                              .u64(chunkTimes_.last)
                                              .u64(chunk_.size())
                                              .u32(crcOf(chunk_))
                                              .string("zstd")
                                              .u64(packed.size())
                                              .raw(packed));
  const std::uint64_t start = file_.size();
  write(text);
  const std::uint64_t indices = file_.size();
  Bytes places;
  for (std::size_t id = 0; id < channels_.size(); ++id) {
    auto& index = channels_[id].index;
    if (index.empty()) continue;
    std::stable_sort(index.begin(), index.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    Bytes entries;
    for (const auto& [time_ns, place] : index) entries.u64(time_ns).u64(place);
    index.clear();
    places.u16(static_cast<std::uint16_t>(id)).u64(file_.size());
    write(
        record(kMessageIndex, Bytes().u16(static_cast<std::uint16_t>(id)).string(entries.text())));
  }
  chunkIndices_.push_back(record(kChunkIndex, Bytes()
                                                  .u64(chunkTimes_.start())
                                                  .u64(chunkTimes_.last)
                                                  .u64(start)
                                                  .u64(text.size())
                                                  .string(places.text())
                                                  .u64(file_.size() - indices)
                                                  .string("zstd")
                                                  .u64(packed.size())
                                                  .u64(chunk_.size())));
  chunk_.clear();
  chunkTimes_ = {};
}

std::string McapWriter::statistics() const {
  Bytes counts;
  for (std::size_t id = 0; id < channels_.size(); ++id) {
    if (channels_[id].messages == 0) continue;
    counts.u16(static_cast<std::uint16_t>(id)).u64(channels_[id].messages);
  }
  return record(kStatistics, Bytes()
                                 .u64(messages_)
                                 .u16(static_cast<std::uint16_t>(schemas_.size()))
                                 .u32(static_cast<std::uint32_t>(channels_.size()))
                                 .u32(0)  // attachments
                                 .u32(static_cast<std::uint32_t>(metadataIndices_.size()))
                                 .u32(static_cast<std::uint32_t>(chunkIndices_.size()))
                                 .u64(times_.start())
                                 .u64(times_.last)
                                 .string(counts.text()));
}

void McapWriter::finish() {
  endChunk();
  const std::uint32_t crc = crc_;
  write(record(kDataEnd, Bytes().u32(crc)));

  std::vector<std::string> channels;
  for (const Channel& channel : channels_) channels.push_back(channel.record);
  const std::pair<Opcode, std::vector<std::string>> groups[] = {{kSchema, schemas_},
                                                                {kChannel, channels},
                                                                {kStatistics, {statistics()}},
                                                                {kChunkIndex, chunkIndices_},
                                                                {kMetadataIndex, metadataIndices_}};
  const std::uint64_t start = file_.size();
  std::string summary, offsets;
  for (const auto& [opcode, records] : groups) {
    if (records.empty()) continue;
    const std::uint64_t begin = start + summary.size();
    for (const std::string& text : records) summary += text;
    offsets += record(kSummaryOffset, Bytes()
                                          .u8(static_cast<std::uint8_t>(opcode))
                                          .u64(begin)
                                          .u64(start + summary.size() - begin));
  }
  const Bytes places = Bytes().u64(start).u64(start + summary.size());
  constexpr std::size_t kCrc_bytes = 4;  // at the end of the footer
  std::string end = record(kFooter, Bytes(places).u32(0));
  const std::string covered = summary + offsets + end.substr(0, end.size() - kCrc_bytes);
  write(covered);
  write(Bytes().u32(crcOf(covered)).raw(kMagic).text());
  file_.keep();
}

}  // namespace depthservo
