#include "servo/reproduce/DeLuca2008.h"

namespace depthservo {

Reproduction reproduceDeLuca2008(const ReproduceOptions& options) {
  Rows rows("deluca2008/");
  std::vector<Figure> figures;
  deluca2008::addDepthExperiments(rows, figures, options);
  deluca2008::addArmExperiments(rows, figures, options);
  deluca2008::addFocalExperiments(rows, figures, options);
  deluca2008::addServoExperiments(rows, figures, options);
  return {rows.take(),
          std::move(figures),
          {{"5.1", "Section 5.1: depth in the numerical example, by how the observer is sampled"},
           {"5.1-arm", "Section 5.1: depth under an arm, with image noise"},
           {"5.2", "Section 5.2: focal length in the numerical example"},
           {"7.1", "Section 7.1: focal length on the unicycle"},
           {"7.2", "Section 7.2: servo on four points from wrong guesses"},
           {"7.3", "Section 7.3: servo on moments from wrong guesses"}}};
}

}  // namespace depthservo
