#pragma once

#include <visp3/core/vpImage.h>

#include <cstddef>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// A few images of a run, evenly spread over what has come so far, however long it is: to look at
/// what happened. At most `kMost` of them, none wider or higher than `kLargest_px`.
class DEPTHSERVO_API Film {
 public:
  static constexpr std::size_t kMost = 120;
  static constexpr unsigned kLargest_px = 640;

  struct Picture {
    double time_s = 0;
    int width = 0, height = 0;
    std::vector<unsigned char> gray;  ///< row-major
  };

  /// The next image of the run; it is kept when its turn has come.
  void add(double time_s, const DEPTHSERVO_VISP vpImage<unsigned char>& image);

  const std::vector<Picture>& pictures() const { return pictures_; }

 private:
  std::vector<Picture> pictures_;
  std::size_t every_ = 1, count_ = 0;
};

}  // namespace depthservo
