#include "depthservo/observation/ObservationOptions.h"

namespace depthservo {

DepthPrior ObservationOptions::prior() const {
  DepthPrior prior{depth.initial};
  if (priorSigma_Z) prior.sigma_chi = *priorSigma_Z / (prior.Z * prior.Z);
  return prior;
}

}  // namespace depthservo
