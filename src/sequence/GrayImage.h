#pragma once

#include <visp3/core/vpImage.h>

#include <optional>
#include <string>

#include "depthservo/visp.h"

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

 private:
  std::string path_, bytes_;
  ImageSize size_{0, 0};
};

}  // namespace depthservo::detail
