#pragma once

#include <random>

#include "depthservo/rig/SimulatedRigOptions.h"

namespace depthservo {

/// When the camera takes its images: at its rate or rates, jittered, some of them dropped.
class CameraClock {
 public:
  CameraClock(const CameraOptions& camera, unsigned seed);

  /// Time of the coming image [s], on the nanosecond grid.
  double time() const { return time_s_; }

  /// Whether the coming image gets lost on its way to the controller.
  bool isDropped() const { return isDropped_; }

  /// Goes on to the next image.
  void advance();

 private:
  CameraOptions camera_;
  std::mt19937_64 random_;
  double time_s_ = 0;
  std::size_t images_ = 0;
  bool isDropped_ = false;
};

}  // namespace depthservo
