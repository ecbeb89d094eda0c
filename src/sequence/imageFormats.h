#pragma once

#include <stdexcept>
#include <string_view>

#include "depthservo/api.h"

namespace depthservo::detail {

struct ImageSize {
  int width = 0, height = 0;  ///< [px]
};

/// What the header of an image file says.
struct ImageHeader {
  ImageSize size;
  int bytes = 1;          ///< of a level: 1 or 2
  unsigned white = 0;     ///< level of white; 0: 16 bits, and the format does not say
  bool isGray = true;     ///< one channel
  int orientation = 1;    ///< of EXIF: 1 is upright
  std::size_t start = 0;  ///< of the pixels in a PGM or PPM
  std::size_t leastBytes = 0;  ///< of a file with so many pixels, as far as the format tells
};

/// The bytes are not what they should be; says why.
struct ImageFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file format: `bytes` is the whole file, levels go row by row to `levels`, of `header.bytes`
/// each (two in the machine's order), colours as gray. Both throw ImageFault.
struct ImageFormat {
  ImageHeader (*header)(std::string_view bytes) = nullptr;
  void (*decode)(std::string_view bytes, const ImageHeader& header, void* levels) = nullptr;
};

ImageFormat pnmFormat();  ///< binary PGM (P5) and PPM (P6)
ImageFormat pngFormat();
ImageFormat jpegFormat();

/// Orientation in the TIFF structure of EXIF; 1 when it says nothing.
DEPTHSERVO_INNER int exifOrientation(std::string_view tiff);

}  // namespace depthservo::detail
