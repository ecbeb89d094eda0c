#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/visp/GrayImage.h"
#include "sequence/imageFormats.h"

namespace depthservo::detail {

/// A PGM, PPM, PNG or JPEG file, held in memory.
class DEPTHSERVO_INNER ImageFile {
 public:
  /// Reads the file and looks at its header. Throws InputError: not readable, none of these
  /// formats, a damaged header, too large, or to be shown turned (a camera's calibration does not
  /// say whether it is of the turned image).
  explicit ImageFile(const std::string& path);

  /// The same of bytes that are there already. \param name for messages \param format without a
  /// header: by the first bytes
  ImageFile(std::string name, std::string bytes, const ImageFormat& format = {});

  ImageSize size() const { return header_.size; }

  /// Gray levels of 0 (black) to 255 (white), rounded; colours as 0.299 R + 0.587 G + 0.114 B.
  /// \param bits where the white is unknown: how many of 16 bits are used; 2^bits - 1 is white
  /// \throw InputError the content is damaged, or a level is above white
  GrayImage gray(int bits = 16) const;

  /// The gray levels of an image of 16 bits, row by row, as they are. Throws InputError: another
  /// kind of image, or damaged.
  std::vector<std::uint16_t> levels16() const;

  /// Whether it is a PNG with one channel of 16 bits, as depth images are.
  bool isDepth() const { return isWhiteUnknown() && header_.isGray; }

  /// Whether it has 16 bits, of which the format does not say how many are used (PNG).
  bool isWhiteUnknown() const { return header_.white == 0; }

 private:
  [[noreturn]] void refuse(const std::string& reason) const;
  [[noreturn]] void refuseDamaged(const std::string& why) const;
  void requirePixels() const;
  template <class Level>
  void decode(Level* levels) const;

  std::string path_, bytes_;
  ImageFormat format_;
  ImageHeader header_;
};

/// A PNG file of gray levels, row by row. \param level of compression (zlib); -1: quick, as suits
/// images with smooth parts
DEPTHSERVO_INNER std::string pngOf(const unsigned char* gray, ImageSize size, int level);

/// A JPEG file of gray levels, row by row. \param quality 1..100
DEPTHSERVO_INNER std::string jpegOf(const unsigned char* gray, ImageSize size, int quality);

}  // namespace depthservo::detail
