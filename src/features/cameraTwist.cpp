#include "depthservo/features/cameraTwist.h"

#ifdef ENABLE_VISP_NAMESPACE
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {

vpColVector cameraTwist(const vpVelocityTwistMatrix& cVe, const vpMatrix& eJe,
                        const vpColVector& qdot) {
  return cVe * (eJe * qdot);
}

}  // namespace depthservo
