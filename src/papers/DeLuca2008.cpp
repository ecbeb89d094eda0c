#include "papers/DeLuca2008.h"

namespace depthservo {

Reproduction reproduceDeLuca2008(const ReproduceOptions& options) {
  Rows rows("deluca2008/");
  std::vector<Figure> figures;
  deluca2008::addDepthExperiments(rows, figures, options);
  deluca2008::addArmExperiments(rows, figures, options);
  deluca2008::addFocalExperiments(rows, figures, options);
  deluca2008::addServoExperiments(rows, figures, options);
  return {rows.take(), std::move(figures)};
}

}  // namespace depthservo
