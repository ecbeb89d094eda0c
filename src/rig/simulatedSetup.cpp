#include "rig/simulatedSetup.h"

namespace depthservo {

EstimatorSetup simulatedSetup(const SimulatedRigOptions& rig, const EstimatorOptions& depth) {
  EstimatorSetup setup{depth, rig.odometry.declaredNoise(), rig.odometry.scale_sigma,
                       rig.target.dots()};
  setup.frameRate = rig.camera.slowest();
  setup.sigma = rig.sensing.assumedNoise_px() / rig.camera.pinhole().focal_px();
  setup.focalSigma = rig.camera.focal_sigma;
  setup.couplingStep_s = 1 / rig.odometry.rate;
  return setup;
}

}  // namespace depthservo
