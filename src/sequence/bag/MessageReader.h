#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "depthservo/api.h"
#include "sequence/bag/ByteSource.h"

namespace depthservo::detail {

enum class MessageEncoding {
  ros1,  ///< little-endian, packed
  cdr,   ///< of DDS: its first four bytes tell byte order and version, numbers are aligned
};

/// Reads the fields of a message in their order. All throw BagFault where the message ends too
/// early.
class DEPTHSERVO_INNER MessageReader {
 public:
  MessageReader(std::string_view bytes, MessageEncoding encoding);

  template <class Number>
  Number number() {
    align(sizeof(Number));
    char raw[sizeof(Number)];
    const std::string_view from = take(sizeof(Number));
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      raw[isSwapped_ ? sizeof(Number) - 1 - i : i] = from[i];
    }
    Number value;
    std::memcpy(&value, raw, sizeof(Number));
    return value;
  }

  std::string_view text();
  std::string_view bytes();  ///< of a list of bytes
  std::vector<double> doubles();
  template <std::size_t n>
  void doubles(double (&out)[n]) {
    for (double& value : out) value = number<double>();
  }
  void skipDoubles(std::size_t count);

  /// How many items a list has, each of at least so many bytes.
  std::size_t length(std::size_t itemBytes);

  bool isRos1() const { return isRos1_; }
  std::size_t position() const { return position_; }  ///< from the first byte of the message

  /// Throws BagFault unless nothing is left but padding: the fields are those of another type.
  void requireEnd() const;

 private:
  void align(std::size_t size);
  std::string_view take(std::size_t count);

  std::string_view all_;
  std::size_t position_ = 0, origin_ = 0, mostAligned_ = 8;
  bool isRos1_, isSwapped_ = false;
};

}  // namespace depthservo::detail
