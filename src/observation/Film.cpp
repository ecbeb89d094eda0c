#include "depthservo/observation/Film.h"

#include <algorithm>

#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

/// The means of blocks of pixels.
Film::Picture shrunk(const vpImage<unsigned char>& image) {
  const unsigned size = std::max(image.getWidth(), image.getHeight());
  const unsigned block = std::max(1U, (size + Film::kLargest_px - 1) / Film::kLargest_px);
  const unsigned width = image.getWidth() / block, height = image.getHeight() / block;
  Film::Picture picture{0, static_cast<int>(width), static_cast<int>(height), {}};
  if (block == 1) {
    picture.gray.assign(image.bitmap, image.bitmap + image.getSize());
    return picture;
  }
  picture.gray.reserve(std::size_t{width} * height);
  for (unsigned v = 0; v < height; ++v) {
    for (unsigned u = 0; u < width; ++u) {
      unsigned sum = 0;
      for (unsigned k = 0; k < block * block; ++k) {
        sum += image[v * block + k / block][u * block + k % block];
      }
      picture.gray.push_back(static_cast<unsigned char>(sum / (block * block)));
    }
  }
  return picture;
}

}  // namespace

void Film::add(double time_s, const vpImage<unsigned char>& image) {
  if (count_++ % every_ != 0) return;
  if (pictures_.size() == kMost) {  // every second one goes
    for (std::size_t i = 1; 2 * i < kMost; ++i) pictures_[i] = std::move(pictures_[2 * i]);
    pictures_.resize((kMost + 1) / 2);
    every_ *= 2;
    if ((count_ - 1) % every_ != 0) return;
  }
  pictures_.push_back(shrunk(image));
  pictures_.back().time_s = time_s;
}

}  // namespace depthservo
