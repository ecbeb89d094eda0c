#include "depthservo/pose/FrameRateConditions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "motion/DecimalPoint.h"

namespace depthservo {
namespace {

const double kC = 3 - std::sqrt(5.0);  // the paper's 3 - sqrt(5), twice the smallest eigenvalue/ke

void require(bool holds, const char* what, double value) {
  if (!holds) {
    const DecimalPoint point;
    throw std::invalid_argument(std::string(what) + ", got " + std::to_string(value));
  }
}

void checkTask(double delta, double kappa, double U0) {
  require(delta > 0 && delta < 1, "delta must lie between 0 and 1", delta);
  require(kappa >= 0 && std::isfinite(kappa), "kappa must be finite and not negative", kappa);
  require(U0 >= 0 && std::isfinite(U0), "U0 must be finite and not negative", U0);
}

void check(const SampledGains& g) {
  require(g.ke > 0 && std::isfinite(g.ke), "ke must be finite and positive", g.ke);
  require(g.gamma > 0 && std::isfinite(g.gamma), "gamma must be finite and positive", g.gamma);
  checkTask(g.delta, g.kappa, g.U0);
}

/// Frame rate that keeps the change d since the last frame within gamma, where d' = rate d + push.
double rateThatKeeps(double gamma, double rate, double push) {
  return rate / std::log1p(rate * gamma / push);
}

/// Time of chi' = a chi^2 + b chi + c from 0 to X; a, b, c, X > 0.
double timeToReach(double X, double a, double b, double c) {
  const double discriminant = b * b - 4 * a * c;
  if (discriminant < 0) {
    const double root = std::sqrt(-discriminant);
    return 2 / root * std::atan(root * X / (b * X + 2 * c));
  }
  const double root = std::sqrt(discriminant);
  const double lead = 2 * X / (2 * c + X * (b - root));
  return root > 0 ? std::log1p(root * lead) / root : lead;
}

/// Largest singular value of the 2x2 matrix (p q; r s).
double largestSingularValue(double p, double q, double r, double s) {
  return 0.5 * (std::hypot(p + s, q - r) + std::hypot(p - s, q + r));
}

double observerBound(const SampledGains& g) {
  return std::sqrt(2.0) * (g.ke * g.gamma + g.kappa) / (g.ke * g.delta);
}

double regulationBound(const SampledGains& g) {
  return (4 * g.ke * g.gamma + 2 * std::sqrt(2.0) * g.kappa) / (kC * g.ke * g.delta);
}

/// (23). The change chi of the error since the last frame, relative to the error, must stay below
/// c delta/(2 sqrt 2).
double regulationRate(double kc, double ke, double delta, Norms norms) {
  const double limit = kC * delta / (2 * std::sqrt(2.0));
  if (norms == Norms::paper) {
    const double S = kc + 4 * ke + std::hypot(kc, 2 * ke);
    return 1 / timeToReach(limit, 2 * std::sqrt(2.0) * ke, S, std::sqrt(10.0) * ke);
  }
  const double lambda =
      std::max(largestSingularValue(std::hypot(kc + ke, kc), ke, ke, std::sqrt(5.0) * ke),
               largestSingularValue(kc + ke, ke, ke, ke));
  return 1 / timeToReach(limit, std::sqrt(2.0) * ke, lambda + ke, std::sqrt(6.0) * ke);
}

/// Whether the coupled loop, linear about rest and with e_e held over T, is stable: spectral radius
/// of the map of (e_c, e_e) from frame to frame below 1 (Jury's conditions).
bool isStable(double kc, double ke, double T) {
  const double s = kc + ke;
  const double reach = -std::expm1(-s * T) / s;  // integral of exp(-s t) over T
  const double m11 = std::exp(-s * T), m12 = ke * reach;
  const double m21 = ke * reach, m22 = 1 - ke * T + ke * ke / s * (T - reach);
  const double trace = m11 + m22, determinant = m11 * m22 - m12 * m21;
  return std::abs(determinant) < 1 && std::abs(trace) < 1 + determinant;
}

/// The last x of [low, high] where `holds`, which must be true at low and then false for good.
template <typename Predicate>
double lastWhere(double low, double high, Predicate holds) {
  if (holds(high)) return high;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return low;
    (holds(middle) ? low : high) = middle;
  }
}

/// Where a function with one minimum in (low, high) has it (golden section).
template <typename Function>
double minimise(double low, double high, Function f) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double f_a = f(a), f_b = f(b);
  for (int i = 0; i < 100; ++i) {
    if (f_a < f_b) {
      high = b, b = a, f_b = f_a;
      f_a = f(a = high - golden * (high - low));
    } else {
      low = a, a = b, f_a = f_b;
      f_b = f(b = low + golden * (high - low));
    }
  }
  return 0.5 * (low + high);
}

void checkDesign(double fps, double kappa, double delta, const std::optional<double>& U0) {
  require(fps > 0 && std::isfinite(fps), "the frame rate must be finite and positive", fps);
  checkTask(delta, kappa, U0.value_or(0));
}

/// Least gamma with which (17b) holds for x = ke/fps, where there is one.
double leastObserverGamma(double x, const SampledGains& g) {
  const double root2 = std::sqrt(2.0), E = std::expm1(x);
  return E * g.kappa * (2 * g.delta + 2 * root2) / (g.ke * (g.delta - 2 * root2 * E));
}

/// The same for (28b).
double leastRegulationGamma(double x, const SampledGains& g) {
  const double q = 2 * std::sqrt(5.0) / (kC * g.delta), E = std::expm1(2 * x);
  return E * g.kappa * (1 + q) / (g.ke * (1 - std::sqrt(2.0) * q * E));
}

double observerRate(double ke, double delta) { return 2 * ke * (1 + delta) / delta; }

}  // namespace

ObserverConditions observerConditions(const SampledGains& g, Norms norms) {
  check(g);
  const double root2 = std::sqrt(2.0);
  const double small = (g.ke * g.gamma + g.kappa) / g.delta;  // ke times the error where b begins
  ObserverConditions c;
  if (norms == Norms::paper) {
    c.eq7 = observerRate(g.ke, g.delta);
    c.eq17a = rateThatKeeps(g.gamma, g.ke, 2 * g.kappa + 2 * g.ke * std::sqrt(2 * g.U0));
    c.eq17b = rateThatKeeps(g.gamma, g.ke, 2 * g.kappa + 2 * root2 * small);
  } else {
    c.eq7 = g.ke * (root2 - 1) / std::log1p((root2 - 1) * g.delta / (root2 + g.delta));
    c.eq17a = rateThatKeeps(g.gamma, g.ke, g.kappa + 2 * g.ke * std::sqrt(g.U0));
    c.eq17b = rateThatKeeps(g.gamma, g.ke, g.kappa + 2 * small);
  }
  c.eq16 = observerBound(g);
  c.required_fps = std::max({c.eq7, c.eq17a, c.eq17b});
  c.true_limit_fps = g.ke / 2;
  return c;
}

RegulationConditions regulationConditions(const SampledGains& g, Norms norms) {
  check(g);
  require(g.kc > 0 && std::isfinite(g.kc), "kc must be finite and positive", g.kc);
  const double mu = 2 * (std::sqrt(2.0) * g.ke * g.gamma + g.kappa) / (kC * g.ke * g.delta);
  RegulationConditions c;
  if (norms == Norms::paper) {
    const double rate = 2 * g.ke;
    c.eq28a = rateThatKeeps(g.gamma, rate, 2 * (g.kappa + g.ke * std::sqrt(5 * g.U0)));
    c.eq28b = rateThatKeeps(g.gamma, rate, 2 * (g.kappa + g.ke * std::sqrt(5.0) * mu));
  } else {
    c.eq28a = rateThatKeeps(g.gamma, g.ke, g.kappa + g.ke * std::sqrt(12 * g.U0));
    c.eq28b = rateThatKeeps(g.gamma, g.ke, g.kappa + g.ke * std::sqrt(12.0) * mu);
  }
  if (g.kc >= g.ke) c.eq23 = regulationRate(g.kc, g.ke, g.delta, norms);
  c.eq27 = regulationBound(g);
  c.required_fps = std::max({c.eq23.value_or(0), c.eq28a, c.eq28b});
  // For long T a frame multiplies e_e by about 1 - T kc ke/(kc + ke): unstable at twice this limit.
  const double longest = 2 * (g.kc + g.ke) / (g.kc * g.ke);
  const auto stable = [&](double T) { return isStable(g.kc, g.ke, T); };
  c.true_limit_fps = 1 / lastWhere(0, 2 * longest, stable);
  return c;
}

GainDesign designObserver(double fps, double kappa, double delta, std::optional<double> U0) {
  checkDesign(fps, kappa, delta, U0);
  SampledGains g{0, 0, delta, 0, kappa, U0.value_or(0)};
  if (kappa == 0) {
    g.ke = fps * delta / (2 * (1 + delta));
    return {g, 0};
  }
  const double root2 = std::sqrt(2.0);
  const auto at = [&](double x) {
    g.ke = x * fps;
    g.gamma = leastObserverGamma(x, g);
    const double E = std::expm1(x);
    if (U0) g.gamma = std::max(g.gamma, E * (2 * kappa / g.ke + 2 * std::sqrt(2 * g.U0)));
    return observerBound(g);
  };
  const double feasible = std::log1p(delta / (2 * root2));
  const double bound = at(minimise(0, feasible, at));
  return {g, bound};
}

GainDesign designRegulation(double fps, double kappa, double delta, std::optional<double> U0) {
  checkDesign(fps, kappa, delta, U0);
  SampledGains g{0, 0, delta, 0, kappa, U0.value_or(0)};
  if (kappa == 0) {
    g.kc = g.ke = fps / regulationRate(1, 1, delta, Norms::paper);
    return {g, 0};
  }
  const double q = 2 * std::sqrt(5.0) / (kC * delta);
  const auto at = [&](double x) {
    g.ke = x * fps;
    g.gamma = leastRegulationGamma(x, g);
    const double E = std::expm1(2 * x);
    if (U0) g.gamma = std::max(g.gamma, E * (kappa / g.ke + std::sqrt(5 * g.U0)));
    return regulationBound(g);
  };
  const double feasible = 0.5 * std::log1p(1 / (std::sqrt(2.0) * q));
  const double bound = at(minimise(0, feasible, at));
  g.kc = lastWhere(g.ke, 1e3 * fps,
                   [&](double kc) { return regulationRate(kc, g.ke, delta, Norms::paper) <= fps; });
  return {g, bound};
}

double likelyObserverGain(double fps, double kappa, double sigma_pose) {
  require(fps > 0 && std::isfinite(fps), "the frame rate must be finite and positive", fps);
  require(kappa > 0 && std::isfinite(kappa), "kappa must be finite and positive", kappa);
  require(sigma_pose >= 0 && std::isfinite(sigma_pose), "sigma must be finite and not negative",
          sigma_pose);
  const auto squaredError = [&](double x) {
    const double lag = kappa / (x * fps);
    return lag * lag + sigma_pose * sigma_pose * x / (2 - x);
  };
  return fps * minimise(0, 0.5, squaredError);
}

const char* toString(FrameRateVerdict verdict) {
  switch (verdict) {
    case FrameRateVerdict::guaranteed:
      return "guaranteed";
    case FrameRateVerdict::likely:
      return "likely";
    case FrameRateVerdict::tooSlow:
      return "too slow";
  }
  return "";
}

FrameRateCheck checkFrameRate(double fps, double ke, double kappa, double delta,
                              std::optional<double> kc) {
  require(fps > 0, "the frame rate must be positive", fps);
  // Conditions that do not contain gamma need some value for it.
  SampledGains g{kc.value_or(0), ke, delta, 1, kappa, 0};
  check(g);
  FrameRateCheck judged;
  judged.fps = fps;
  const double infinity = std::numeric_limits<double>::infinity();
  const double step = ke / fps;
  if (kc) {
    const RegulationConditions c = regulationConditions(g);
    const double feasible = 2 * ke / std::log1p(kC * delta / (2 * std::sqrt(10.0)));
    judged.required_fps = c.eq23 ? std::max(*c.eq23, kappa > 0 ? feasible : 0) : infinity;
    judged.true_limit_fps = c.true_limit_fps;
    g.gamma = leastRegulationGamma(step, g);
  } else {
    const double feasible = ke / std::log1p(delta / (2 * std::sqrt(2.0)));
    judged.required_fps = std::max(observerRate(ke, delta), kappa > 0 ? feasible : 0);
    judged.true_limit_fps = ke / 2;
    g.gamma = leastObserverGamma(step, g);
  }
  const bool isGuaranteed = fps >= (1 - kFrameRateRounding) * judged.required_fps;
  judged.verdict = isGuaranteed                  ? FrameRateVerdict::guaranteed
                   : fps > judged.true_limit_fps ? FrameRateVerdict::likely
                                                 : FrameRateVerdict::tooSlow;
  judged.bound = !isGuaranteed ? infinity : kc ? regulationBound(g) : observerBound(g);
  return judged;
}

}  // namespace depthservo
