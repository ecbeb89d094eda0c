#pragma once

#include <cstddef>
#include <string>

#include "sequence/ImageFile.h"

namespace depthservo::detail {

/// Images that are no files of their own.
class ImageStore {
 public:
  virtual ~ImageStore() = default;

  /// The image of a frame, read now. \param name for messages \throw InputError
  virtual ImageFile image(std::size_t frame, const std::string& name) const = 0;
};

}  // namespace depthservo::detail
