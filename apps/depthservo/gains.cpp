#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "depthservo/depth/DepthGains.h"
#include "depthservo/pose/FrameRateConditions.h"
#include "depthservo/text/InputError.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct GainArguments {
  std::string law;
  std::optional<double> settling, excitation, k, k_3, k_3_px, focal_px;
  double Z = 1, noise_px = 0.5;
  double fps = 0, kappa = 0, delta = 0.95;
  std::optional<double> kc, ke, gamma, U0, poseNoise;
  bool sharp = false, json = false;
};

nlohmann::ordered_json observer(const GainArguments& a, const SampledGains& gains) {
  const ObserverConditions c = observerConditions(gains, a.sharp ? Norms::sharp : Norms::paper);
  return {{"eq7", c.eq7},
          {"eq16", c.eq16},
          {"eq17a", c.eq17a},
          {"eq17b", c.eq17b},
          {"required_fps", c.required_fps},
          {"satisfied", c.satisfiedAt(a.fps)},
          {"true_limit_fps", c.true_limit_fps}};
}

nlohmann::ordered_json regulation(const GainArguments& a, const SampledGains& gains) {
  const RegulationConditions c = regulationConditions(gains, a.sharp ? Norms::sharp : Norms::paper);
  nlohmann::ordered_json json{{"eq23", nullptr},
                              {"eq27", c.eq27},
                              {"eq28a", c.eq28a},
                              {"eq28b", c.eq28b},
                              {"required_fps", c.required_fps},
                              {"satisfied", c.satisfiedAt(a.fps)},
                              {"true_limit_fps", c.true_limit_fps}};
  if (c.eq23) json["eq23"] = *c.eq23;
  return json;
}

/// Focal length that noise and gains in pixels are told for without --focal [px].
constexpr double kUsualFocal_px = 600;

DepthGains depthGainsOf(const GainArguments& a) {
  const double excitation = a.excitation.value_or(kGainExcitation);
  if (a.k_3_px && !a.focal_px) throw InputError({"--k3-px", 0, ""}, "needs --focal PX");
  if (a.k_3 && a.k_3_px) throw InputError({"--k3-px", 0, ""}, "is --k3 in pixels: give one");
  const bool isGiven = a.k || a.k_3 || a.k_3_px;
  if (isGiven && !(a.k && (a.k_3 || a.k_3_px))) {
    throw InputError({"--k", 0, ""}, "and --k3 or --k3-px go together");
  }
  if (isGiven == a.settling.has_value()) {
    throw InputError({"--settling", 0, ""},
                     "either it, to design gains, or --k with --k3 or --k3-px, to judge them");
  }
  if (!isGiven) return DepthGains::design(*a.settling, excitation, a.fps);
  const double k_3 = a.k_3 ? *a.k_3 : *a.k_3_px * *a.focal_px * *a.focal_px;
  return DepthGains::given(*a.k, k_3, excitation, a.fps);
}

nlohmann::ordered_json stability(const DepthGains& gains, const DepthGains::Stability& s) {
  const bool isStable = s.low < gains.excitation && gains.excitation < s.high;
  return {{"stable", isStable},
          {"least_excitation", s.low},
          {"greatest_excitation", s.high},
          {"margin", s.margin(gains.excitation)}};
}

void printDepthGains(const DepthGains& gains, const GainArguments& a, double focal_px) {
  fmt::print("k_1 = k_2          {:.4g} 1/s\n", gains.k);
  fmt::print(
      "k_3                {:.4g} 1/m^2 for normalised coordinates = focal_px^2 k_3 (pixels)\n",
      gains.k_3);
  fmt::print("                   {:.4g} for pixels at a focal length of {:g} px\n",
             gains.k_3_px(focal_px), focal_px);
  fmt::print("settled to 2 %     after {:.3g} s at {:g} m/s across the line of sight\n",
             gains.settling_s(), gains.excitation);
  fmt::print("damping            {:.3g} (natural frequency {:.3g} rad/s)\n", gains.damping(),
             gains.wn());
  fmt::print("noise of Z         {:.3g} m (1 sigma) at Z = {:g} m with {:g} px\n",
             gains.sigma_Z(a.Z, a.noise_px, focal_px), a.Z, a.noise_px);
  const auto print = [&](const char* name, const DepthGains::Stability& s) {
    const double margin = s.margin(gains.excitation);
    if (std::isinf(margin)) {
      fmt::print("{:<18} stable at any excitation (this program)\n", name);
    } else if (s.low >= s.high) {
      fmt::print("{:<18} unstable at any excitation\n", name);
    } else {
      fmt::print("{:<18} {} at {:g} Hz: up to {:.3g} m/s, {:.3g} times the excitation\n", name,
                 margin > 1 ? "stable" : "UNSTABLE", gains.fps, s.high, margin);
    }
  };
  print("Euler's method", gains.euler());
  print("flow, k dt", gains.flowEuler());
  print("flow, poles", DepthGains::poleMatched());
}

void designDepthGains(const GainArguments& a) {
  const double focal_px = a.focal_px.value_or(kUsualFocal_px);
  DepthGains gains;
  try {
    gains = depthGainsOf(a);
  } catch (const std::invalid_argument& error) {
    throw InputError({"gains", 0, ""}, error.what());
  }
  if (!a.json) return printDepthGains(gains, a, focal_px);
  const nlohmann::ordered_json json{
      {"k1", gains.k},
      {"k3_normalised", gains.k_3},
      {"k3_pixel", gains.k_3_px(focal_px)},
      {"focal", focal_px},
      {"excitation", gains.excitation},
      {"fps", gains.fps},
      {"wn", gains.wn()},
      {"damping", gains.damping()},
      {"settling_s", gains.settling_s()},
      {"sigma_Z",
       {{"value", gains.sigma_Z(a.Z, a.noise_px, focal_px)},
        {"Z", a.Z},
        {"pixel_noise", a.noise_px}}},
      {"stability",
       {{"euler", stability(gains, gains.euler())},
        {"flow_euler", stability(gains, gains.flowEuler())},
        {"flow_poles", stability(gains, DepthGains::poleMatched())}}}};
  fmt::print("{}\n", json.dump(2));
}

void designGains(const GainArguments& a) {
  if (a.law == "depth") return designDepthGains(a);
  const bool isObserver = a.law == "observer";
  if (!isObserver && a.law != "regulation") {
    refuseWord("--law", a.law, {"depth", "observer", "regulation"});
  }
  const bool isGiven = a.ke.has_value();
  if (isGiven && (!a.gamma || (!isObserver && !a.kc))) {
    throw InputError({"--ke", 0, ""}, isObserver
                                          ? "needs --gamma too; leave both out to design them"
                                          : "needs --kc and --gamma too; leave all out to design "
                                            "them");
  }
  if (!isGiven && !(a.kappa > 0)) {
    throw InputError({"--kappa", 0, ""},
                     "missing: how fast the target may move [m/s, rad/s], above 0");
  }
  SampledGains gains;
  nlohmann::ordered_json json;
  try {
    if (isGiven) {
      gains = {a.kc.value_or(0), *a.ke, a.delta, *a.gamma, a.kappa, a.U0.value_or(0)};
    } else {
      gains = (isObserver ? designObserver : designRegulation)(a.fps, a.kappa, a.delta, a.U0).gains;
    }
    json = isObserver ? observer(a, gains) : regulation(a, gains);
  } catch (const std::invalid_argument& error) {
    throw InputError({"gains", 0, ""}, error.what());
  }
  if (!isGiven) {
    json["designed"] = {{"ke", gains.ke}, {"gamma", gains.gamma}, {"delta", gains.delta}};
    if (!isObserver) json["designed"]["kc"] = gains.kc;
    if (a.poseNoise) {
      if (!(a.kappa > 0)) throw InputError({"--pose-noise", 0, ""}, "needs --kappa above 0 too");
      json["likely"] = {{"ke", likelyObserverGain(a.fps, a.kappa, *a.poseNoise)}};
    }
    const double bound = json[isObserver ? "eq16" : "eq27"];
    fmt::print(
        stderr,
        "designed for {:g} fps: ke {:.4g}{}, gamma {:.4g}. Guaranteed in the end: error below "
        "{:.4g}{}. In practice the loop works down to about {:.3g} fps.\n",
        a.fps, gains.ke, isObserver ? "" : fmt::format(", kc {:.4g}", gains.kc), gains.gamma, bound,
        bound < 1 ? "" : " (which says nothing of the rotation)",
        json["true_limit_fps"].get<double>());
    if (a.poseNoise) {
      fmt::print(stderr,
                 "likely best, without a guarantee: ke {:.4g} (least lag kappa/ke and noise "
                 "together, ke <= fps/2)\n",
                 json["likely"]["ke"].get<double>());
    }
  }
  if (a.json) {
    fmt::print("{}\n", json.dump(2));
  } else {
    for (const auto& [key, value] : json.items()) fmt::print("{:<15} {}\n", key, value.dump());
  }
}

}  // namespace

void addGains(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "gains",
      "Gains for a frame rate, or what given gains ask for: of the depth observer (De Luca et al. "
      "2008), of pose observer and regulation (Ibuki et al. 2023)");
  auto a = std::make_shared<GainArguments>();
  command->add_option("--law", a->law, "depth | observer | regulation")
      ->required()
      ->type_name("LAW");
  command->add_option("--fps", a->fps, "Frame rate of the camera [Hz]")->required()->type_name("F");
  const auto positive = [&](const char* flag, auto& value, const char* help, const char* type) {
    return command->add_option(flag, value, help)
        ->type_name(type)
        ->check(aboveZero())
        ->group("--law depth");
  };
  positive("--settling", a->settling, "Time in which an error of the depth falls to 2 % [s]", "S");
  positive("--excitation", a->excitation, "Speed across the line of sight, rms [m/s]; default 0.1",
           "W");
  positive("--k", a->k, "Given k_1 = k_2 [1/s], instead of --settling", "K");
  positive("--k3", a->k_3, "Given k_3 for normalised coordinates [1/m^2]", "K3");
  positive("--k3-px", a->k_3_px, "Given k_3 for pixels; k_3 (normalised) = focal_px^2 k_3 (pixels)",
           "K3");
  positive("--focal", a->focal_px, "Focal length [px]; default 600", "PX");
  positive("--depth", a->Z, "Depth for the expected noise [m]", "Z")->capture_default_str();
  positive("--pixel-noise", a->noise_px, "Noise of the image, 1 sigma per axis [px]", "PX")
      ->capture_default_str();
  command->add_option("--ke", a->ke, "Observer gain [1/s]; left out: designed")->type_name("KE");
  command->add_option("--kc", a->kc, "Camera gain [1/s], regulation only")->type_name("KC");
  command->add_option("--delta", a->delta, "Share of the gain that sampling leaves, 0..1")
      ->type_name("D")
      ->capture_default_str();
  command->add_option("--gamma", a->gamma, "How far the error may move between frames")
      ->type_name("G");
  command->add_option("--kappa", a->kappa, "Bound on the target's twist [m/s, rad/s]")
      ->type_name("K")
      ->capture_default_str();
  command->add_option("--U0", a->U0, "Energy at the start: U_e(0) or U(0)")->type_name("U");
  command
      ->add_option("--pose-noise", a->poseNoise,
                   "Noise of the pose from one image [m]; adds the gain that is likely best")
      ->type_name("S")
      ->check(zeroOrMore());
  command->add_flag("--sharp", a->sharp, "Sharper norms in the same proofs");
  command->add_flag("--json", a->json, "Print one JSON object on stdout");
  command->callback([a] { designGains(*a); });
}

}  // namespace depthservo
