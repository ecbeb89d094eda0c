#include "depthservo/features/cameraTwist.h"

#include "depthservo/visp/using.h"

namespace depthservo {

vpColVector cameraTwist(const vpVelocityTwistMatrix& cVe, const vpMatrix& eJe,
                        const vpColVector& qdot) {
  return cVe * (eJe * qdot);
}

}  // namespace depthservo
