#include "depthservo/depth/DepthForecast.h"

#include <cmath>
#include <limits>

namespace depthservo {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

DepthForecast DepthForecast::of(const DepthEstimate& estimate, double sigma, const Motion& motion,
                                const OdometryNoise& odometry) {
  if (!motion.isFinite() || !(motion.dt > 0)) return {};
  const OdometryNoise::Step noise = odometry.over(motion);
  return {noise.rho * estimate.excitation * motion.dt, sigma, noise.variance_t,
          noise.variance_theta};
}

double DepthForecast::variance(double chi, double frames) const {
  const double parallax2 = parallax * parallax;
  if (!(parallax2 > 0)) return kInfinity;
  const double image = 12 * sigma * sigma / (frames * frames * frames);
  const double odometry = (variance_t * chi * chi + variance_theta) / frames;
  return (image + odometry) / parallax2;
}

double DepthForecast::sigma_chiAfter(double chi, double sigma_chi, double frames) const {
  const double ratio = sigma_chi * sigma_chi / variance(chi, frames);
  return sigma_chi / std::sqrt(1 + ratio);
}

double DepthForecast::framesTo(double relative, double chi, double sigma_chi) const {
  const double wanted = relative * chi;
  if (!(chi > 0)) return kInfinity;
  if (sigma_chi <= wanted) return 0;
  if (!(parallax > 0)) return kInfinity;
  // 1/wanted^2 = 1/sigma_chi^2 + 1/variance(k), hence a/k^3 + b/k = target: increasing in 1/k, by
  // Newton from the side on which it converges monotonically.
  const double target = 1 / (1 / (wanted * wanted) - 1 / (sigma_chi * sigma_chi));
  const double b = (variance_t * chi * chi + variance_theta) / (parallax * parallax);
  const double a = variance(chi, 1) - b;
  double perFrame = a > 0 ? std::cbrt(target / a) : target / b;
  if (b > 0) perFrame = std::fmin(perFrame, target / b);
  if (!std::isfinite(perFrame)) return 1;
  for (int i = 0; i < 20; ++i) {
    const double slope = 3 * a * perFrame * perFrame + b;
    perFrame -= (perFrame * (a * perFrame * perFrame + b) - target) / slope;
  }
  return std::ceil(1 / perFrame * (1 - 1e-12));
}

}  // namespace depthservo
