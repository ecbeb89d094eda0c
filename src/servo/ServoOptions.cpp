#include "depthservo/servo/ServoOptions.h"

namespace depthservo {

void check(const ControlOptions& control, const Refuse& refuse) {
  if (control.coupled && control.law != Law::regulation) {
    refuse("coupled", "needs control.law: regulation");
  }
  if (control.features == FeatureKind::moments && control.law != Law::vpServo) {
    refuse("features", "moments need control.law: vpServo");
  }
  if (control.law == Law::profile && control.profile.empty()) {
    refuse("profile", "the law profile needs velocities: profile: [{until: 10, v: [...]}]");
  }
  if (control.law != Law::profile && !control.profile.empty()) {
    refuse("profile", "needs control.law: profile");
  }
}

}  // namespace depthservo
