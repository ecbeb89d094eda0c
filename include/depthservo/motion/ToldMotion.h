#pragma once

#include "depthservo/api.h"
#include "depthservo/motion/Motion.h"

namespace depthservo {

/// The camera's motion as it is told from image to image: what cannot be used becomes a motion that
/// is not known, lasting as long as the image says it did, or as long as the one before.
///
/// Real-time: nothing allocates or throws.
class DEPTHSERVO_API ToldMotion {
 public:
  /// The motion since the last image; of no duration while nothing is known of the time either.
  /// \rtsafe
  Motion take(const Motion& told);

  /// Told motions that could not be used (`Motion::isUsable`).
  unsigned refused() const { return refused_; }

  /// For how long the motion has been unknown, up to the last image [s]; 0 while it is known.
  double unknownFor_s() const { return unknownFor_s_; }

  void setBounds(const UnknownMotion& bounds) { bounds_ = bounds; }

 private:
  UnknownMotion bounds_;
  Motion known_;  // the last known one
  double unknownFor_s_ = 0;
  unsigned refused_ = 0;
};

}  // namespace depthservo
