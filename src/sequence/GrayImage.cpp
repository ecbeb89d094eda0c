#include "sequence/GrayImage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "depthservo/text/InputError.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kLargestFile = std::size_t{256} << 20;  // bytes
constexpr int kLargestSide = 16384;                           // px

unsigned byteAt(std::string_view bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}
unsigned bigEndian16(std::string_view bytes, std::size_t i) {
  return byteAt(bytes, i) << 8 | byteAt(bytes, i + 1);
}
unsigned bigEndian32(std::string_view bytes, std::size_t i) {
  return bigEndian16(bytes, i) << 16 | bigEndian16(bytes, i + 2);
}
bool startsWith(std::string_view bytes, std::string_view start) {
  return bytes.substr(0, start.size()) == start;
}

int side(unsigned value) {
  return value >= 1 && value <= kLargestSide ? static_cast<int>(value) : 0;
}

/// Size of a binary PGM or PPM; nothing when the header is wrong or pixels are missing.
std::optional<ImageSize> pnmSize(std::string_view bytes) {
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
    if (i == first) return std::nullopt;
  }
  const ImageSize size{side(values[0]), side(values[1])};
  if (!size.width || !size.height || values[2] < 1 || values[2] > 65535) return std::nullopt;
  const std::size_t channels = bytes[1] == '6' ? 3 : 1, depth = values[2] > 255 ? 2 : 1;
  const std::size_t pixels = std::size_t(size.width) * std::size_t(size.height);
  if (bytes.size() < i + 1 + pixels * channels * depth) return std::nullopt;
  return size;
}

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  static const auto table = [] {
    std::vector<std::uint32_t> entries(256);
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
      entries[n] = c;
    }
    return entries;
  }();
  for (const char c : bytes) {
    crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xFF] ^ (crc >> 8);
  }
  return ~crc;
}

/// Size of a PNG whose chunks are all there and undamaged.
std::optional<ImageSize> pngSize(std::string_view bytes) {
  constexpr std::size_t kOverhead = 12;  // length, type and checksum of a chunk
  std::size_t i = 8;
  ImageSize size{0, 0};
  while (i + kOverhead <= bytes.size()) {
    const std::size_t length = bigEndian32(bytes, i);
    if (length > bytes.size() - i - kOverhead) return std::nullopt;
    const std::string_view typeAndData = bytes.substr(i + 4, 4 + length);
    if (crc32(typeAndData) != bigEndian32(bytes, i + 8 + length)) return std::nullopt;
    if (startsWith(typeAndData, "IHDR") && length == 13) {
      size = {side(bigEndian32(typeAndData, 4)), side(bigEndian32(typeAndData, 8))};
    }
    if (startsWith(typeAndData, "IEND")) {
      return size.width && size.height ? std::optional<ImageSize>(size) : std::nullopt;
    }
    i += kOverhead + length;
  }
  return std::nullopt;
}

/// Size of a JPEG that reaches its end marker.
std::optional<ImageSize> jpegSize(std::string_view bytes) {
  if (bytes.rfind("\xFF\xD9") == std::string_view::npos) return std::nullopt;
  std::size_t i = 2;
  while (i + 9 < bytes.size() && byteAt(bytes, i) == 0xFF) {
    const unsigned marker = byteAt(bytes, i + 1);
    const bool startOfFrame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (startOfFrame) {
      const ImageSize size{side(bigEndian16(bytes, i + 7)), side(bigEndian16(bytes, i + 5))};
      return size.width && size.height ? std::optional<ImageSize>(size) : std::nullopt;
    }
    i += 2 + bigEndian16(bytes, i + 2);
  }
  return std::nullopt;
}

}  // namespace

ImageFile::ImageFile(const std::string& path) : path_(path), bytes_(readFile(path, kLargestFile)) {
  std::optional<ImageSize> size;
  if (startsWith(bytes_, "P5") || startsWith(bytes_, "P6")) {
    size = pnmSize(bytes_);
  } else if (startsWith(bytes_, "\x89PNG\r\n\x1a\n")) {
    size = pngSize(bytes_);
  } else if (startsWith(bytes_, "\xFF\xD8\xFF")) {
    size = jpegSize(bytes_);
  } else {
    throw InputError({path_, 0, ""}, "is not an image, expected binary PGM or PPM, PNG or JPEG");
  }
  if (!size) throw InputError({path_, 0, ""}, "is damaged or cut off; copy the image again");
  size_ = *size;
}

DEPTHSERVO_VISP vpImage<unsigned char> ImageFile::gray() const {
  DEPTHSERVO_VISP vpImage<unsigned char> image(static_cast<unsigned>(size_.height),
                                               static_cast<unsigned>(size_.width));
  const cv::Mat bytes(1, static_cast<int>(bytes_.size()), CV_8U, const_cast<char*>(bytes_.data()));
  cv::Mat pixels;
  try {
    pixels = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
  }
  if (pixels.rows != size_.height || pixels.cols != size_.width || pixels.type() != CV_8U) {
    throw InputError({path_, 0, ""}, "is damaged; copy the image again");
  }
  pixels.copyTo(cv::Mat(size_.height, size_.width, CV_8U, image.bitmap));
  return image;
}

bool ImageFile::isDepth() const {
  // After the signature comes IHDR: length, type, width, height, bit depth, colour type.
  constexpr std::size_t kBitDepth = 24, kColourType = 25;
  constexpr unsigned kGray = 0;
  return startsWith(bytes_, "\x89PNG") && byteAt(bytes_, kBitDepth) == 16 &&
         byteAt(bytes_, kColourType) == kGray;
}

std::vector<std::uint16_t> ImageFile::levels16() const {
  if (!isDepth()) {
    throw InputError({path_, 0, ""}, "is not a depth image, expected a 16-bit gray PNG");
  }
  const cv::Mat bytes(1, static_cast<int>(bytes_.size()), CV_8U, const_cast<char*>(bytes_.data()));
  cv::Mat levels;
  try {
    levels = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
  }
  if (levels.rows != size_.height || levels.cols != size_.width || levels.type() != CV_16U) {
    throw InputError({path_, 0, ""}, "is damaged; copy the image again");
  }
  return {levels.ptr<std::uint16_t>(), levels.ptr<std::uint16_t>() + levels.total()};
}

}  // namespace depthservo::detail
