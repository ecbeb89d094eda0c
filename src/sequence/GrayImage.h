#pragma once

#include <visp3/core/vpImage.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/visp/visp.h"

namespace depthservo::detail {

struct ImageSize {
  int width, height;  ///< [px]
};

/// A PGM, PPM, PNG or JPEG file, held in memory.
class ImageFile {
 public:
  /// Throws InputError: not readable, none of these formats, or cut off.
  explicit ImageFile(const std::string& path);

  ImageSize size() const { return size_; }

  /// Throws InputError when the content is damaged.
  DEPTHSERVO_VISP vpImage<unsigned char> gray() const;

  /// The levels of a 16-bit gray PNG, row by row. Throws InputError: another kind of image, or
  /// damaged.
  std::vector<std::uint16_t> levels16() const;

  /// Whether it is a PNG with one channel of 16 bits, as depth images are.
  bool isDepth() const;

 private:
  std::string path_, bytes_;
  ImageSize size_{0, 0};
};

}  // namespace depthservo::detail
