#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "depthservo/text/NewFolder.h"

namespace depthservo {

/// Writes messages as an MCAP file (https://mcap.dev/spec, version 0): chunks compressed with zstd,
/// each with its message index, a summary with all that a reader needs to seek, all CRCs.
///
/// The same calls give the same bytes.
class McapWriter {
 public:
  using Strings = std::map<std::string, std::string>;

  explicit McapWriter(const std::string& file);

  /// A kind of message. \param text of the schema, a JSON schema \return its id
  std::uint16_t addSchema(const std::string& name, std::string_view text);

  /// A series of JSON messages of one kind. \return its id
  std::uint16_t addChannel(const std::string& topic, std::uint16_t schema);

  /// \param time_ns since the epoch, of any order; \param json the message
  /// \throw Interrupted
  void addMessage(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);

  /// Words about the whole file.
  void addMetadata(const std::string& name, const Strings& values);

  /// Writes the summary and makes the file appear. \throw InputError, Interrupted
  void finish();

 private:
  struct Channel {
    std::string record;
    std::uint32_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  // time, place in the chunk
  };
  struct Times {
    std::uint64_t first = UINT64_MAX, last = 0;
    void add(std::uint64_t t);
    std::uint64_t start() const { return first == UINT64_MAX ? 0 : first; }
  };

  void write(std::string_view bytes);
  void endChunk();
  std::string statistics() const;

  NewFile file_;
  std::uint32_t crc_ = 0;  // of all before DataEnd
  std::string chunk_;      // records, not compressed
  Times chunkTimes_, times_;
  std::vector<std::string> schemas_, chunkIndices_, metadataIndices_;  // records
  std::vector<Channel> channels_;
  std::uint64_t messages_ = 0;
};

}  // namespace depthservo
