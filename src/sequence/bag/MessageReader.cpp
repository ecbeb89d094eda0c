#include "sequence/bag/MessageReader.h"

#include <fmt/format.h>

#include <algorithm>

namespace depthservo::detail {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are read as little-endian");

MessageReader::MessageReader(std::string_view bytes, MessageEncoding encoding)
    : all_(bytes), isRos1_(encoding == MessageEncoding::ros1) {
  if (isRos1_) return;
  // DDS X-Types 1.3, 7.6.3.1: representation identifier, then options.
  const std::string_view head = take(4);
  origin_ = 4;
  const unsigned kind = static_cast<unsigned char>(head[1]);
  constexpr unsigned kCdr = 0, kCdrLittle = 1, kCdr2 = 6, kCdr2Little = 7;
  if (head[0] != 0 ||
      (kind != kCdr && kind != kCdrLittle && kind != kCdr2 && kind != kCdr2Little)) {
    throw BagFault(fmt::format("it is not plain CDR (representation {:02x}{:02x})",
                               static_cast<unsigned char>(head[0]), kind));
  }
  isSwapped_ = kind == kCdr || kind == kCdr2;
  if (kind >= kCdr2) mostAligned_ = 4;
}

void MessageReader::align(std::size_t size) {
  if (isRos1_) return;
  const std::size_t to = std::min(size, mostAligned_);
  position_ += (to - (position_ - origin_) % to) % to;
}

std::string_view MessageReader::take(std::size_t count) {
  if (position_ > all_.size() || count > all_.size() - position_) {
    throw BagFault("it ends too early");
  }
  position_ += count;
  return all_.substr(position_ - count, count);
}

std::size_t MessageReader::length(std::size_t itemBytes) {
  const auto count = number<std::uint32_t>();
  if (count > (all_.size() - position_) / itemBytes) throw BagFault("it ends too early");
  return count;
}

std::string_view MessageReader::text() {
  std::string_view text = take(number<std::uint32_t>());
  if (isRos1_) return text;
  if (text.empty()) return text;  // some writers leave the NUL out
  if (text.back() != '\0') throw BagFault("it has a text without an end");
  text.remove_suffix(1);
  return text;
}

std::string_view MessageReader::bytes() { return take(number<std::uint32_t>()); }

std::vector<double> MessageReader::doubles() {
  std::vector<double> values(length(sizeof(double)));
  for (double& value : values) value = number<double>();
  return values;
}

void MessageReader::skipDoubles(std::size_t count) {
  if (count == 0) return;
  align(sizeof(double));
  take(count * sizeof(double));
}

void MessageReader::requireEnd() const {
  constexpr std::size_t kMostPadding = 7;
  const std::size_t rest = all_.size() - position_;
  if (rest == 0 || (!isRos1_ && rest <= kMostPadding)) return;
  throw BagFault(fmt::format("{} bytes are left over", rest));
}

}  // namespace depthservo::detail
