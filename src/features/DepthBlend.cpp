#include "depthservo/features/DepthBlend.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// Sigma of the desired inverse depth, as a fraction of it, in the blend.
constexpr double kDesiredRelativeSigma = 0.7;

/// ViSP refuses Z below this [m].
constexpr double kSmallestZ = 1e-6;

/// A depth that is set anew is new where it differs from the last by this factor.
constexpr double kOtherDepth = 1.5;

}  // namespace

bool isUsableDepth(double Z) { return std::isfinite(Z) && Z >= kSmallestZ; }

bool isOtherDepth(double ratio) { return !(ratio < kOtherDepth && ratio * kOtherDepth > 1); }

bool takeGuess(double Z, double& guess) {
  if (!isUsableDepth(Z)) return false;
  const double ratio = Z / guess;
  guess = Z;
  return isOtherDepth(ratio);
}

void DepthBlend::setDesired(double Z) {
  if (!isUsableDepth(Z)) return;
  Z_desired_ = Z;
  isGiven_ = true;
}

void DepthBlend::meetDesired(double Z) {
  if (!isGiven_ && isUsableDepth(Z)) Z_desired_ = Z;
}

void DepthBlend::setGroup(double Z_desired, double caution, double Z_ofOthers) {
  Z_desiredOfGroup_ = Z_desired;
  cautionOfGroup_ = caution;
  Z_ofOthers_ = Z_ofOthers;
}

void DepthBlend::forget() {
  Z_desired_ = Z_desiredOfGroup_ = Z_ofOthers_ = 0;
  cautionOfGroup_ = 1;
  isGiven_ = false;
}

double DepthBlend::of(const DepthEstimate& e) const {
  const double Z_desired = Z_desired_ > 0 ? Z_desired_ : Z_desiredOfGroup_;
  double depth = Z_ofOthers_ > 0 ? Z_ofOthers_ : e.Z();
  if (choice_ == ServoDepth::blended && !(Z_ofOthers_ > 0 && Z_desired == 0)) {
    depth = std::min(e.cautiousZ(), e.Z() / cautionOfGroup_);
    if (Z_desired > 0) {
      const double chi_desired = range_.clampChi(1 / Z_desired);
      const double sigma_desired = kDesiredRelativeSigma * chi_desired;
      const double variance = e.sigma_chi * e.sigma_chi;
      const double variance_desired = sigma_desired * sigma_desired;
      const double blend =
          (variance + variance_desired) / (e.chi * variance_desired + chi_desired * variance);
      depth = e.isDoubtful() ? std::min(blend, std::max(1 / chi_desired, e.cautiousZ())) : blend;
    }
  }
  return std::clamp(depth, range_.Z_min, range_.Z_max);
}

}  // namespace depthservo
