#include "depthservo/servo/RunLog.h"

namespace depthservo {

const char* toString(Outcome outcome) {
  switch (outcome) {
    case Outcome::converged:
      return "converged";
    case Outcome::stalled:
      return "stalled";
    case Outcome::leftImage:
      return "left-image";
    case Outcome::lost:
      return "lost";
    case Outcome::diverged:
      return "diverged";
    case Outcome::collision:
      return "collision";
    case Outcome::timeout:
      return "timeout";
  }
  return "";
}

}  // namespace depthservo
