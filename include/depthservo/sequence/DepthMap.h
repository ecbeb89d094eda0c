#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"

namespace depthservo {

/// A depth image: 16-bit PNG, gray level / scale = Z [m] (not the distance along the ray), 0 is
/// unknown.
class DEPTHSERVO_API DepthMap {
 public:
  /// \param scale gray levels per metre
  /// \throw InputError not readable, or not a 16-bit gray PNG
  DepthMap(const std::string& path, double scale);

  int width() const { return width_; }    ///< [px]
  int height() const { return height_; }  ///< [px]

  /// Depth at the pixel (u, v) [m], 1/Z interpolated between its four neighbours, which is exact on
  /// a plane. Unknown where one of the 4 x 4 pixels around is unknown or outside the image, or
  /// where they disagree by more than a smooth surface would: at the edge of an object nobody
  /// knows which of the two depths a point has.
  std::optional<double> at(double u, double v) const;

 private:
  int width_ = 0, height_ = 0;
  double scale_;
  std::vector<std::uint16_t> levels_;  // row-major
};

}  // namespace depthservo
