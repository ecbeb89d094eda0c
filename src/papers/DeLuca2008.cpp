#include "papers/DeLuca2008.h"

#include "papers/runPapers.h"

namespace depthservo {

Experiments runDeLuca2008(const ReproduceOptions& options) {
  Experiments r;
  deluca2008::addDepthExperiments(r, options);
  deluca2008::addArmExperiments(r, options);
  deluca2008::addFocalExperiments(r, options);
  deluca2008::addServoExperiments(r, options);
  return r;
}

}  // namespace depthservo
