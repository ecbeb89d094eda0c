#pragma once

#include <optional>

#include "depthservo/api.h"

namespace depthservo {

/// Gains of the sampled visual motion observer and of the regulation built on it, with what the
/// frame-rate conditions suppose of the task.
struct SampledGains {
  double kc = 0;        ///< camera gain [1/s]; used by the regulation only
  double ke = 0;        ///< observer gain [1/s], > 0
  double delta = 0.95;  ///< share of the gain that must survive the sampling, in (0, 1)
  double gamma = 1;     ///< how far the error may move between two frames [-], > 0
  double kappa = 0;     ///< bound on the target's twist |V_wo| [m/s and rad/s], >= 0
  double U0 = 0;        ///< energy at the start, >= 0: U_e(0) for the observer, U(0) else
};

/// A designed gain meets its frame rate with equality, to rounding: relative slack of
/// `satisfiedAt`.
constexpr double kFrameRateRounding = 1e-9;

/// Which norms the proofs use: the paper's, or sharper ones for |I + e| and the rotation's share,
/// which ask for lower frame rates and prove the same.
enum class Norms { paper, sharp };

/// Frame rates [Hz] above which the sampled observer provably works, and what it then guarantees:
/// Ibuki, Nakano, Shigaki, Hatanaka, "Sampled visual feedback pose estimation and regulation based
/// on camera frame rates", Advanced Robotics 37, 2023, with the equation numbers of the paper.
/// Sufficient, not necessary: `true_limit_fps` is where the linear sampled loop really diverges.
struct ObserverConditions {
  double eq7 = 0;             ///< still target: the error decays at ke(1 - delta)/2 [1/s]
  double eq16 = 0;            ///< bound on |e_e| in the end, given (17)
  double eq17a = 0;           ///< moving target, while the error is large
  double eq17b = 0;           ///< moving target, once it is small
  double required_fps = 0;    ///< the largest of (7), (17a) and (17b)
  double true_limit_fps = 0;  ///< ke/2

  bool satisfiedAt(double fps) const { return fps >= (1 - kFrameRateRounding) * required_fps; }
};

/// Throws std::invalid_argument for a parameter out of its range.
DEPTHSERVO_API ObserverConditions observerConditions(const SampledGains& gains,
                                                     Norms norms = Norms::paper);

/// The same for the coupled regulation law (22).
struct RegulationConditions {
  std::optional<double> eq23;  ///< still target: decay at (3 - sqrt 5) ke (1 - delta)/4 [1/s]; none
                               ///< when kc < ke, where nothing is proved
  double eq27 = 0;             ///< bound on |e| in the end, given (28)
  double eq28a = 0;            ///< moving target, while the error is large
  double eq28b = 0;            ///< moving target, once it is small
  double required_fps = 0;     ///< the largest of (23), (28a) and (28b)
  double true_limit_fps = 0;   ///< of the linear loop with a still target

  bool satisfiedAt(double fps) const {
    return eq23 && fps >= (1 - kFrameRateRounding) * required_fps;
  }
};

/// Throws std::invalid_argument for a parameter out of its range.
DEPTHSERVO_API RegulationConditions regulationConditions(const SampledGains& gains,
                                                         Norms norms = Norms::paper);

/// Gains for a camera, with the smallest bound that the conditions can guarantee.
struct GainDesign {
  SampledGains gains;
  /// Guaranteed in the end: (16) on |e_e|, or (27) on |e|; 0 for a still target. A rotation error
  /// never exceeds 1 in this measure, so a larger bound says nothing about it.
  double bound = 0;
};

/// ke and gamma that minimise (16) at this frame rate [Hz]. Without U0 the observer is supposed to
/// start near the truth; with it, (17a) is met from there. For kappa = 0 the largest ke that meets
/// (7). \param delta 0.95 loses 5 % of the bound against 1 and keeps a rate
/// Throws std::invalid_argument for a parameter out of its range.
DEPTHSERVO_API GainDesign designObserver(double fps, double kappa, double delta = 0.95,
                                         std::optional<double> U0 = {});

/// ke and gamma that minimise (27), then the largest kc that (23) allows. For kappa = 0 the largest
/// kc = ke that meets (23). Throws std::invalid_argument for a parameter out of its range.
DEPTHSERVO_API GainDesign designRegulation(double fps, double kappa, double delta = 0.95,
                                           std::optional<double> U0 = {});

/// Observer gain [1/s] for use rather than proof: minimises the sum of the squared lag kappa/ke and
/// the squared noise sigma_pose^2 keT/(2 - keT), with keT <= 0.5.
/// \param kappa expected |V_wo|, > 0  \param sigma_pose noise of the pose from one image, >= 0
DEPTHSERVO_API double likelyObserverGain(double fps, double kappa, double sigma_pose);

/// What a frame rate means for gains in use.
enum class FrameRateVerdict {
  guaranteed,  ///< convergence is proved, and a bound for a target that moves as expected
  likely,      ///< not proved; the linear sampled loop with a still target is stable
  tooSlow,     ///< below that limit: corrections overshoot and grow, unless they are guarded
};
DEPTHSERVO_API const char* toString(FrameRateVerdict verdict);

/// The conditions at a frame rate met by a running observer.
struct FrameRateCheck {
  double fps = 0;             ///< the frame rate judged [Hz]
  double required_fps = 0;    ///< the lowest that is guaranteed: (7), and (17b) for some gamma when
                              ///< kappa > 0; coupled law: (23) and (28b). Infinite for kc < ke
  double true_limit_fps = 0;  ///< the lowest that is likely
  double bound = 0;  ///< on the error in the end, given the guarantee; infinite without it.
                     ///< The smallest that (16) or (27) gives for some gamma, from rest
  FrameRateVerdict verdict = FrameRateVerdict::guaranteed;
};

/// \param fps lowest frame rate met, > 0, may be infinite  \param kappa expected |V_wo|, >= 0
/// \param kc camera gain of the coupled law (22); none: the observer by itself
/// Throws std::invalid_argument for a parameter out of its range.
DEPTHSERVO_API FrameRateCheck checkFrameRate(double fps, double ke, double kappa,
                                             double delta = 0.95, std::optional<double> kc = {});

}  // namespace depthservo
