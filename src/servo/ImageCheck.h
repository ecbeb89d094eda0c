#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Geometry>
#include <limits>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/Motion.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// Whether a camera still shows the world: a black image, one of a single shade, and the image
/// before once more while the camera has moved show nothing new.
class DEPTHSERVO_INNER ImageCheck {
 public:
  enum class Verdict { usable, empty, frozen };
  Verdict look(const DEPTHSERVO_VISP vpImage<unsigned char>& image);

  /// How the camera has moved, by odometry.
  void move(const Motion& motion);

  double odometry_s = std::numeric_limits<double>::quiet_NaN();  ///< up to which it was told

 private:
  std::vector<unsigned char> last_;
  double way_m_ = 0, turn_rad_ = 0;  // since the last image that differed
};

}  // namespace depthservo
