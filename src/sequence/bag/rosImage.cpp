#include "sequence/bag/rosImage.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "sequence/bag/messages.h"

namespace depthservo::detail {
namespace {

/// How the pixels of an encoding lie in memory.
struct PixelLayout {
  const char* name;
  int channels, bytes;   ///< of a pixel; of a channel
  int red, green, blue;  ///< places of the channels; all 0: gray
};

constexpr PixelLayout kLayouts[] = {
    {"mono8", 1, 1, 0, 0, 0},       {"8UC1", 1, 1, 0, 0, 0},   {"rgb8", 3, 1, 0, 1, 2},
    {"bgr8", 3, 1, 2, 1, 0},        {"8UC3", 3, 1, 2, 1, 0},   {"rgba8", 4, 1, 0, 1, 2},
    {"bgra8", 4, 1, 2, 1, 0},       {"8UC4", 4, 1, 2, 1, 0},   {"mono16", 1, 2, 0, 0, 0},
    {"rgb16", 3, 2, 0, 1, 2},       {"bgr16", 3, 2, 2, 1, 0},  {"rgba16", 4, 2, 0, 1, 2},
    {"bgra16", 4, 2, 2, 1, 0},      {"yuv422", 2, 1, 1, 1, 1}, {"uyvy", 2, 1, 1, 1, 1},
    {"yuv422_yuy2", 2, 1, 0, 0, 0}, {"yuyv", 2, 1, 0, 0, 0},
};

/// OpenCV names the patterns by the second row.
struct BayerPattern {
  const char* name;
  int code;
};
constexpr BayerPattern kPatterns[] = {{"bayer_rggb8", cv::COLOR_BayerBG2GRAY},
                                      {"bayer_bggr8", cv::COLOR_BayerRG2GRAY},
                                      {"bayer_gbrg8", cv::COLOR_BayerGR2GRAY},
                                      {"bayer_grbg8", cv::COLOR_BayerGB2GRAY}};

template <class Named, std::size_t n>
const Named* named(const Named (&all)[n], const std::string& name) {
  const auto found = std::find_if(all, all + n, [&](const Named& one) { return name == one.name; });
  return found == all + n ? nullptr : found;
}

ImageMessage messageIn(std::string_view bytes, MessageEncoding encoding) {
  try {
    return readImage(MessageReader(bytes, encoding));
  } catch (const BagFault& fault) {
    throw ImageFault(fault.what());
  }
}

ImageHeader rosHeader(std::string_view bytes, MessageEncoding encoding) {
  const ImageMessage image = messageIn(bytes, encoding);
  const PixelLayout* layout = named(kLayouts, image.encoding);
  if (!layout && !named(kPatterns, image.encoding)) {
    throw ImageFault(
        fmt::format("the encoding '{}' is not read; mono8, rgb8, bgr8, bayer_*8, "
                    "mono16 and some more are",
                    image.encoding.substr(0, 40)));
  }
  constexpr std::uint32_t kMost = 1 << 20;  // px
  if (image.width > kMost || image.height > kMost) throw ImageFault("it tells no size of an image");
  const int pixelBytes = layout ? layout->channels * layout->bytes : 1;
  if (std::uint64_t{image.step} < std::uint64_t{image.width} * unsigned(pixelBytes)) {
    throw ImageFault(
        fmt::format("its rows have {} bytes, fewer than {} pixels need", image.step, image.width));
  }
  if (std::uint64_t{image.step} * image.height > image.size ||
      image.size > bytes.size() - image.pixels) {
    throw ImageFault("pixels are missing");
  }
  ImageHeader header;
  header.size = {static_cast<int>(image.width), static_cast<int>(image.height)};
  header.bytes = layout ? layout->bytes : 1;
  header.white = header.bytes == 1 ? 255 : 0;
  header.isGray = !layout || layout->channels == 1;
  return header;
}

template <class Level>
void takeLevels(std::string_view bytes, const ImageMessage& image, const PixelLayout& layout,
                Level* levels) {
  // OpenCV's weights: 0.299, 0.587 and 0.114 in units of 2^-14.
  constexpr unsigned kRed = 4899, kGreen = 9617, kBlue = 1868, kHalf = 1 << 13;
  const bool isGray = layout.red == layout.blue;
  for (std::size_t v = 0; v < image.height; ++v) {
    const std::size_t row = image.pixels + v * image.step;
    for (std::size_t u = 0; u < image.width; ++u) {
      const auto channel = [&](int c) -> unsigned {
        const std::size_t i =
            row + (u * std::size_t(layout.channels) + std::size_t(c)) * sizeof(Level);
        const auto first = static_cast<unsigned char>(bytes[i]);
        if constexpr (sizeof(Level) == 1) return first;
        const auto second = static_cast<unsigned char>(bytes[i + 1]);
        return image.isBigEndian ? unsigned(first << 8 | second) : unsigned(second << 8 | first);
      };
      const unsigned level = isGray ? channel(layout.red)
                                    : (kRed * channel(layout.red) + kGreen * channel(layout.green) +
                                       kBlue * channel(layout.blue) + kHalf) >>
                                          14;
      *levels++ = static_cast<Level>(level);
    }
  }
}

void rosDecode(std::string_view bytes, MessageEncoding encoding, void* levels) {
  const ImageMessage image = messageIn(bytes, encoding);
  if (const BayerPattern* pattern = named(kPatterns, image.encoding)) {
    if (image.width < 3 || image.height < 3) throw ImageFault("it is too small for its pattern");
    const cv::Mat raw(static_cast<int>(image.height), static_cast<int>(image.width), CV_8U,
                      const_cast<char*>(bytes.data() + image.pixels), image.step);
    cv::Mat gray(raw.rows, raw.cols, CV_8U, levels);
    cv::cvtColor(raw, gray, pattern->code);
    return;
  }
  const PixelLayout& layout = *named(kLayouts, image.encoding);
  if (layout.bytes == 1) {
    takeLevels(bytes, image, layout, static_cast<std::uint8_t*>(levels));
  } else {
    takeLevels(bytes, image, layout, static_cast<std::uint16_t*>(levels));
  }
}

template <MessageEncoding encoding>
constexpr ImageFormat kRosFormat = {
    [](std::string_view bytes) { return rosHeader(bytes, encoding); },
    [](std::string_view bytes, const ImageHeader&, void* levels) {
      rosDecode(bytes, encoding, levels);
    }};

}  // namespace

ImageFormat rosImageFormat(MessageEncoding encoding) {
  return encoding == MessageEncoding::ros1 ? kRosFormat<MessageEncoding::ros1>
                                           : kRosFormat<MessageEncoding::cdr>;
}

bool isDepthEncoding(const std::string& encoding) {
  return encoding == "16UC1" || encoding == "32FC1" ||
         encoding.find("compressedDepth") != encoding.npos;
}

}  // namespace depthservo::detail
