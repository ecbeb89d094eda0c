#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "depthservo/depth/FrameRateConditions.h"
#include "depthservo/sequence/InputError.h"

namespace depthservo {
namespace {

struct GainArguments {
  std::string law;
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

void designGains(const GainArguments& a) {
  const bool isObserver = a.law == "observer";
  if (!isObserver && a.law != "regulation") {
    throw InputError({"--law", 0, ""},
                     fmt::format("'{}' is not in this version; use observer or regulation", a.law));
  }
  const bool isGiven = a.ke.has_value();
  if (isGiven && (!a.gamma || (!isObserver && !a.kc))) {
    throw InputError({"--ke", 0, ""}, isObserver
                                          ? "needs --gamma too; leave both out to design them"
                                          : "needs --kc and --gamma too; leave all out to design "
                                            "them");
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
      "gains", "What frame rate gains ask for, or gains for a frame rate (Ibuki et al. 2023)");
  auto a = std::make_shared<GainArguments>();
  command->add_option("--law", a->law, "observer | regulation")->required()->type_name("LAW");
  command->add_option("--fps", a->fps, "Frame rate of the camera [Hz]")->required()->type_name("F");
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
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--sharp", a->sharp, "Sharper norms in the same proofs");
  command->add_flag("--json", a->json, "Print one JSON object on stdout");
  command->callback([a] { designGains(*a); });
}

}  // namespace depthservo
