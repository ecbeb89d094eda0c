#include "sequence/ImageFile.h"

#include <fmt/format.h>

#include <algorithm>

#include "depthservo/text/InputError.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kLargestFile = std::size_t{256} << 20;    // bytes
constexpr int kLargestSide = 16384;                             // px
constexpr std::size_t kMostPixels = std::size_t{64} * 1000000;  // what is unpacked stays in memory

ImageFormat formatOf(std::string_view bytes) {
  const auto startsWith = [&](std::string_view start) {
    return bytes.substr(0, start.size()) == start;
  };
  if (startsWith("P5") || startsWith("P6")) return pnmFormat();
  if (startsWith("\x89PNG\r\n\x1a\n")) return pngFormat();
  if (startsWith("\xFF\xD8\xFF")) return jpegFormat();
  return {};
}

}  // namespace

ImageFile::ImageFile(const std::string& path) : ImageFile(path, readFile(path, kLargestFile)) {}

ImageFile::ImageFile(std::string name, std::string bytes, const ImageFormat& format)
    : path_(std::move(name)),
      bytes_(std::move(bytes)),
      format_(format.header ? format : formatOf(bytes_)) {
  if (!format_.header) refuse("is not an image, expected binary PGM or PPM, PNG or JPEG");
  try {
    header_ = format_.header(bytes_);
  } catch (const ImageFault& fault) {
    refuse(fmt::format("is damaged, cut off or of an unusual kind ({}); copy or convert it again",
                       fault.what()));
  }
  const auto [width, height] = header_.size;
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide ||
      std::size_t(width) * std::size_t(height) > kMostPixels) {
    refuse(fmt::format("has {}x{} pixels, expected sides of 1 to {} and at most {} million pixels",
                       width, height, kLargestSide, kMostPixels / 1000000));
  }
  if (header_.orientation != 1) {
    refuse(
        fmt::format("is to be shown turned or mirrored (EXIF orientation {}), and nothing says "
                    "whether the camera was calibrated with turned images; turn the pixels "
                    "(exiftran -ai FILE) or remove the mark (exiftool -Orientation= FILE)",
                    header_.orientation));
  }
}

void ImageFile::refuse(const std::string& reason) const {
  throw InputError({path_, 0, ""}, reason);
}

void ImageFile::refuseDamaged(const std::string& why) const {
  refuse(fmt::format("is damaged or cut off ({}); copy the image again", why));
}

/// Before memory is taken for them.
void ImageFile::requirePixels() const {
  if (bytes_.size() < header_.leastBytes) refuseDamaged("pixels are missing");
}

template <class Level>
void ImageFile::decode(Level* levels) const {
  try {
    format_.decode(bytes_, header_, levels);
  } catch (const ImageFault& fault) {
    refuseDamaged(fault.what());
  }
}

GrayImage ImageFile::gray(int bits) const {
  requirePixels();
  GrayImage image;
  image.resize(static_cast<unsigned>(header_.size.height),
               static_cast<unsigned>(header_.size.width));
  const unsigned white = isWhiteUnknown() ? (1u << bits) - 1 : header_.white;
  const auto scaled = [white](unsigned level) {
    return static_cast<unsigned char>((level * 255 + white / 2) / white);
  };
  unsigned char* const end = image.bitmap + image.getSize();
  if (header_.bytes == 1) {
    decode(image.bitmap);
    if (white != 255) std::transform(image.bitmap, end, image.bitmap, scaled);
    return image;
  }
  const std::vector<std::uint16_t> levels = levels16();
  const unsigned most = *std::max_element(levels.begin(), levels.end());
  if (most > white) {
    refuse(
        fmt::format("has levels up to {}, but others use {} of 16 bits (up to {}); say in "
                    "sequence.yaml how many are used: image_bits: 16",
                    most, bits, white));
  }
  std::transform(levels.begin(), levels.end(), image.bitmap, scaled);
  return image;
}

std::vector<std::uint16_t> ImageFile::levels16() const {
  if (header_.bytes != 2) refuse("has 8 bits per level, expected 16");
  requirePixels();
  std::vector<std::uint16_t> levels(std::size_t(header_.size.width) *
                                    std::size_t(header_.size.height));
  decode(levels.data());
  return levels;
}

}  // namespace depthservo::detail
