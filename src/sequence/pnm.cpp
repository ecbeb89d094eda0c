#include <algorithm>
#include <cctype>

#include "sequence/imageFormats.h"

namespace depthservo::detail {
namespace {

unsigned byteAt(std::string_view bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

ImageHeader header(std::string_view bytes) {
  std::size_t i = 2;
  unsigned values[3];
  for (unsigned& value : values) {
    while (i < bytes.size() && (std::isspace(byteAt(bytes, i)) || bytes[i] == '#')) {
      if (bytes[i] == '#') i = std::min(bytes.find('\n', i), bytes.size());
      if (i < bytes.size()) ++i;
    }
    value = 0;
    const std::size_t first = i;
    for (; i < bytes.size() && std::isdigit(byteAt(bytes, i)) && i < first + 6; ++i) {
      value = 10 * value + (byteAt(bytes, i) - '0');
    }
    if (i == first) throw ImageFault("expected width, height and greatest level in the header");
  }
  if (values[2] < 1 || values[2] > 65535)
    throw ImageFault("expected a greatest level of 1 to 65535");
  ImageHeader header;
  header.size = {static_cast<int>(values[0]), static_cast<int>(values[1])};
  header.bytes = values[2] > 255 ? 2 : 1;
  header.white = values[2];
  header.isGray = bytes[1] == '5';
  header.start = i + 1;
  header.leastBytes = header.start + std::size_t{values[0]} * values[1] *
                                         std::size_t(header.bytes) * (header.isGray ? 1 : 3);
  return header;
}

template <class Level>
void decodeLevels(std::string_view bytes, const ImageHeader& header, Level* levels) {
  const std::size_t pixels = std::size_t(header.size.width) * std::size_t(header.size.height);
  const std::size_t channels = header.isGray ? 1 : 3;
  if (bytes.size() < header.start ||
      bytes.size() - header.start < pixels * channels * sizeof(Level)) {
    throw ImageFault("pixels are missing");
  }
  std::size_t i = header.start;
  const auto next = [&] {
    const unsigned level =
        sizeof(Level) == 1 ? byteAt(bytes, i) : byteAt(bytes, i) << 8 | byteAt(bytes, i + 1);
    i += sizeof(Level);
    if (level > header.white) throw ImageFault("a level is above the greatest of the header");
    return level;
  };
  // OpenCV's weights: 0.299, 0.587 and 0.114 in units of 2^-14.
  constexpr unsigned kRed = 4899, kGreen = 9617, kBlue = 1868, kHalf = 1 << 13;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const unsigned first = next();
    unsigned level = first;
    if (!header.isGray) {
      const unsigned green = next(), blue = next();
      level = (kRed * first + kGreen * green + kBlue * blue + kHalf) >> 14;
    }
    levels[pixel] = static_cast<Level>(level);
  }
}

void decode(std::string_view bytes, const ImageHeader& header, void* levels) {
  if (header.bytes == 1) {
    decodeLevels(bytes, header, static_cast<std::uint8_t*>(levels));
  } else {
    decodeLevels(bytes, header, static_cast<std::uint16_t*>(levels));
  }
}

}  // namespace

ImageFormat pnmFormat() { return {header, decode}; }

}  // namespace depthservo::detail
