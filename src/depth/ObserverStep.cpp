#include "depthservo/depth/ObserverStep.h"

#include <cmath>

namespace depthservo::detail {

void PoleMatchedGains::match(double k, double squaredFrequency, double duration_s) {
  if (duration_s == Dt && squaredFrequency == wn2) return;
  Dt = duration_s;
  wn2 = squaredFrequency;
  point = -std::expm1(-k * Dt);
  const double half = 0.5 * k;
  const double D = half * half - wn2;
  if (D >= 0) {  // written so that nothing cancels when wn2 is small
    const double fast = half + std::sqrt(D);
    const double slow = wn2 / fast;
    chi = std::expm1(-fast * Dt) * std::expm1(-slow * Dt);
  } else {
    const double oneMinus = -std::expm1(-half * Dt);
    const double s = std::sin(0.5 * std::sqrt(-D) * Dt);
    chi = oneMinus * oneMinus + 4 * (1 - oneMinus) * s * s;
  }
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
