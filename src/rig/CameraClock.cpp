#include "rig/CameraClock.h"

#include "depthservo/sequence/SequenceWriter.h"

namespace depthservo {

CameraClock::CameraClock(const CameraOptions& camera, unsigned seed)
    : camera_(camera), random_(seed) {}

void CameraClock::advance() {
  std::uniform_real_distribution<double> fraction;
  ++images_;
  if (camera_.rate.size() == 1 && camera_.jitter == 0) {
    time_s_ = fileTime(static_cast<double>(images_) / camera_.rate[0]);
  } else {
    double interval_s = 1 / camera_.rate[(images_ - 1) % camera_.rate.size()];
    if (camera_.jitter > 0) interval_s *= 1 + camera_.jitter * (2 * fraction(random_) - 1);
    time_s_ = fileTime(time_s_ + interval_s);
  }
  isDropped_ = camera_.dropped > 0 && fraction(random_) < camera_.dropped;
}

}  // namespace depthservo
