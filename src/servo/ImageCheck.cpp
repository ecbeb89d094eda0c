#include "servo/ImageCheck.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

constexpr int kLeastContrast = 16;                   // gray levels,
constexpr std::size_t kOutliers = 16;                // but for so many pixels at either end
constexpr double kWay_m = 0.005, kTurn_rad = 0.005;  // by which every scene looks different

/// Between the darkest and the lightest pixels, but for a few.
int contrast(const DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  std::size_t count[256] = {};
  for (unsigned i = 0; i < image.getSize(); ++i) ++count[image.bitmap[i]];
  int low = 0, high = 255;
  for (std::size_t n = 0; low < 255 && (n += count[low]) <= kOutliers;) ++low;
  for (std::size_t n = 0; high > 0 && (n += count[high]) <= kOutliers;) --high;
  return high - low;
}

}  // namespace

ImageCheck::Verdict ImageCheck::look(const DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  if (contrast(image) < kLeastContrast) return Verdict::empty;
  const unsigned char *const begin = image.bitmap, *const end = begin + image.getSize();
  if (last_.size() == image.getSize() && std::equal(begin, end, last_.begin())) {
    return way_m_ > kWay_m || turn_rad_ > kTurn_rad ? Verdict::frozen : Verdict::usable;
  }
  last_.assign(begin, end);
  way_m_ = turn_rad_ = 0;
  return Verdict::usable;
}

void ImageCheck::move(const Motion& motion) {
  way_m_ += motion.t.norm();
  turn_rad_ += Eigen::AngleAxisd(motion.R).angle();
}

}  // namespace depthservo
