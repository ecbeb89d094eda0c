#pragma once

#include <visp3/core/vpColVector.h>
#include <visp3/core/vpMatrix.h>
#include <visp3/core/vpVelocityTwistMatrix.h>

#include "depthservo/api.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// Twist of the camera in the camera frame (6: vx vy vz wx wy wz [m/s, rad/s]) of a robot that
/// moves with qdot: cVe eJe qdot, the same two matrices the task got through set_cVe and set_eJe.
/// For FeaturePoint::observe; qdot is the velocity really applied, after saturation. \param cVe
/// 6x6, end effector to camera \param eJe 6xn, robot Jacobian in the end-effector frame \param qdot
/// n \throw vpException when the sizes do not match
DEPTHSERVO_API DEPTHSERVO_VISP vpColVector
cameraTwist(const DEPTHSERVO_VISP vpVelocityTwistMatrix& cVe, const DEPTHSERVO_VISP vpMatrix& eJe,
            const DEPTHSERVO_VISP vpColVector& qdot);

}  // namespace depthservo
