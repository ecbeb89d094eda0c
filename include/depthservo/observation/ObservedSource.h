#pragma once

#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// Where images and odometry come from, as far as the observer must know it.
struct DEPTHSERVO_API ObservedSource {
  std::string place;     ///< folder, file or camera, for messages
  std::string settings;  ///< file that names the target and how to observe it; empty: none
  PinholeCamera camera;
  SequenceTarget target;
  bool hasImages = true;
  bool hasTruth = false;   ///< true depths come by point
  std::vector<int> ids{};  ///< of points measured elsewhere, ascending
  double frameRate = 0;    ///< images per second, 0: not known [Hz]
  double fastestRate = 0;  ///< by the shortest time between two images, 0: not known [Hz]
  RowMeaning rows = RowMeaning::hold;
  double rowPeriod_s = 0;           ///< nominal period of the odometry; 0: not known
  std::size_t odometryRows = 1024;  ///< kept

  static ObservedSource of(const Sequence& sequence);
};

}  // namespace depthservo
