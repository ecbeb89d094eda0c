#pragma once

#include <visp3/core/vpImage.h>

#include "depthservo/visp/visp.h"

namespace depthservo {

/// A gray image of ViSP that can be kept in lists: moved without a copy, and copied while it is
/// empty. Of ViSP's own (3.5) the pixels that are moved into an image which was moved from are
/// never freed, since `swap` forgets who owns them, and the copy of an empty one reads at null.
///
/// It owns its pixels (those of another image of ViSP are copied) and has no display.
class GrayImage : public DEPTHSERVO_VISP vpImage<unsigned char> {
  using Image = DEPTHSERVO_VISP vpImage<unsigned char>;

 public:
  GrayImage() = default;
  GrayImage(const Image& other) {
    if (other.getSize() > 0) Image::operator=(other);
  }
  GrayImage(const GrayImage& other) : GrayImage(static_cast<const Image&>(other)) {}
  GrayImage(GrayImage&& other) noexcept { swap(*this, other); }
  ~GrayImage() = default;

  GrayImage& operator=(GrayImage other) noexcept {
    swap(*this, other);
    return *this;
  }
};

}  // namespace depthservo
