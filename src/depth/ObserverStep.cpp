#include "depthservo/depth/ObserverStep.h"

#include <cmath>

#include "depth/poleMatched.h"

namespace depthservo::detail {

void PoleMatchedGains::match(double k, double squaredFrequency, double duration_s) {
  if (duration_s == Dt && squaredFrequency == wn2) return;
  Dt = duration_s;
  wn2 = squaredFrequency;
  point = -std::expm1(-k * Dt);
  chi = poleMatchedGain(k, wn2, Dt);
}

void ExcitationWindow::add(double W2, double decayRate, double dt, double window_s) {
  if (dt != dt_) {
    dt_ = dt;
    share_ = -std::expm1(-dt / window_s);
  }
  J_ += share_ * (W2 * window_s - J_);
  decay_ += share_ * (decayRate * window_s - decay_);
  filled_ += share_ * (1 - filled_);
}

}  // namespace depthservo::detail
