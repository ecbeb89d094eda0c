#include "depthservo/motion/ToldMotion.h"

namespace depthservo {

Motion ToldMotion::take(const Motion& told) {
  if (told.isUsable()) {
    if (!told.unknown.exists()) known_ = told;
    unknownFor_s_ = told.unknown.exists() ? unknownFor_s_ + told.dt : 0;
    return told;
  }
  ++refused_;
  Motion clock;  // only its time is used
  clock.dt = told.dt;
  const double lasted_s = clock.isUsable() ? told.dt : known_.dt;
  const double before_s = unknownFor_s_;
  unknownFor_s_ += lasted_s;
  return Motion::notKnown(bounds_.over(known_.twist(), before_s, unknownFor_s_));
}

}  // namespace depthservo
