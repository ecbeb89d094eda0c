#include "depthservo/depth/DepthGains.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "depthservo/depth/ObserverStep.h"
#include "motion/DecimalPoint.h"

namespace depthservo {
namespace {

/// ln(50): decay to 2 %.
constexpr double kTwoPercent = 3.912;

void requirePositive(double value, const char* name) {
  if (value > 0 && std::isfinite(value)) return;
  throw std::invalid_argument(std::string(name) + " must be positive");
}

std::string number(double value) {
  const DecimalPoint point;
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

std::string DepthGains::objection(double k_3, double excitation, double fps) {
  const double wn = std::sqrt(k_3) * excitation;
  if (!(wn > fps)) return "";
  return "k_3 = " + number(k_3) + " makes wn = " + number(wn) + " rad/s at an excitation of " +
         number(excitation) + " m/s, " + number(wn / fps) +
         " times the frame rate: too fast for it, or in the wrong unit; k_3 is for normalised "
         "coordinates, k_3 (normalised) = focal_px^2 k_3 (pixels)";
}

DepthGains DepthGains::design(double settling_s, double excitation, double fps) {
  requirePositive(settling_s, "the settling time");
  requirePositive(excitation, "the excitation");
  requirePositive(fps, "the frame rate");
  const ObserverGains gains = ObserverGains::fromSettlingTime(settling_s, excitation);
  if (gains.wn > fps) {
    throw std::invalid_argument(
        "a settling time of " + number(settling_s) + " s is too short for " + number(fps) +
        " images per second; the shortest is " + number(settling_s * gains.wn / fps) + " s");
  }
  return {gains.k, gains.k_3, excitation, fps};
}

DepthGains DepthGains::given(double k, double k_3, double excitation, double fps) {
  requirePositive(k, "k");
  requirePositive(k_3, "k_3");
  requirePositive(excitation, "the excitation");
  requirePositive(fps, "the frame rate");
  const std::string why = objection(k_3, excitation, fps);
  if (!why.empty()) throw std::invalid_argument(why);
  return {k, k_3, excitation, fps};
}

double DepthGains::wn() const { return std::sqrt(k_3) * excitation; }

double DepthGains::damping() const { return k / (2 * wn()); }

double DepthGains::settling_s() const {
  // The response to an error of the depth alone, e(t) = (s1 exp(s2 t) - s2 exp(s1 t))/(s1 - s2),
  // by its slowest part.
  const double zeta = damping();
  if (std::abs(zeta - 1) < 1e-6) return detail::kSettling / wn();
  if (zeta < 1) return (kTwoPercent - 0.5 * std::log(1 - zeta * zeta)) / (zeta * wn());
  const double root = std::sqrt(zeta * zeta - 1);
  const double slow = wn() / (zeta + root), fast = wn() * (zeta + root);
  return (kTwoPercent + std::log(fast / (fast - slow))) / slow;
}

double DepthGains::sigma_Z(double Z, double noise_px, double focal_px) const {
  const double sigma = noise_px / focal_px;
  return Z * Z * sigma * k_3 * excitation / std::sqrt(2 * k * fps);
}

double DepthGains::Stability::margin(double excitation) const {
  if (!(low < high) || excitation <= low) return 0;
  return high / excitation;
}

DepthGains::Stability DepthGains::euler() const {
  const double n = k / fps, scale = fps / std::sqrt(k_3);
  return {n > 2 ? scale * std::sqrt(2 * n - 4) : 0, scale * std::sqrt(n)};
}

DepthGains::Stability DepthGains::flowEuler() const {
  const double m = 4 - 2 * k / fps;
  return {0, m > 0 ? fps / std::sqrt(k_3) * std::sqrt(m) : 0};
}

}  // namespace depthservo
