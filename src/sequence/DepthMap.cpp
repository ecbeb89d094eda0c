#include "depthservo/sequence/DepthMap.h"

#include <algorithm>

#include "depthservo/text/InputError.h"
#include "sequence/ImageFile.h"

namespace depthservo {

DepthMap::DepthMap(const std::string& path, double scale) : scale_(scale) {
  const detail::ImageFile file(path);
  if (!file.isDepth()) {
    throw InputError({path, 0, ""}, "is not a depth image, expected a 16-bit gray PNG");
  }
  width_ = file.size().width;
  height_ = file.size().height;
  levels_ = file.levels16();
}

std::optional<double> DepthMap::at(double u, double v) const {
  /// Greatest spread of the depths in a window of 4 x 4 pixels, relative to the nearest: a plane
  /// seen at 80 degrees off its normal by a camera with f = 500 px stays below.
  constexpr double kMostSpread = 0.04;
  if (!(u >= 1 && v >= 1 && u < width_ - 2 && v < height_ - 2)) return std::nullopt;
  const int left = static_cast<int>(u), top = static_cast<int>(v);
  const auto level = [&](int i, int j) {
    return levels_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(i)];
  };
  int least = 65535, most = 0;
  for (int j = top - 1; j <= top + 2; ++j) {
    for (int i = left - 1; i <= left + 2; ++i) {
      least = std::min<int>(least, level(i, j));
      most = std::max<int>(most, level(i, j));
    }
  }
  constexpr int kRounding = 2, kUnknown = 65535;  // gray levels; 7-Scenes has it for unknown
  if (least == 0 || most == kUnknown || most - least > kRounding + kMostSpread * least)
    return std::nullopt;
  const double a = u - left, b = v - top;
  const double chi = (1 - a) * (1 - b) / level(left, top) + a * (1 - b) / level(left + 1, top) +
                     (1 - a) * b / level(left, top + 1) + a * b / level(left + 1, top + 1);
  return 1 / (chi * scale_);
}

}  // namespace depthservo
