#include "observation/FrameRateMonitor.h"

#include <fmt/format.h>

#include <cmath>

#include "depthservo/tracking/KnownTargetEstimator.h"

namespace depthservo {
namespace {

constexpr double kDelta = 0.95;

std::string sentence(const FrameRateReport& report, bool isGuarded) {
  const FrameRateCheck& c = report.check;
  const char* law = report.kc ? "coupled law" : "observer";
  const std::string rate =
      fmt::format("frame rate down to {:.3g} Hz with ke = {:.3g}/s", c.fps, report.ke);
  const std::string proved =
      std::isfinite(c.required_fps)
          ? fmt::format("the {:.3g} Hz from which the {} provably converges", c.required_fps, law)
          : std::string("any rate: nothing is proved for kc < ke");
  switch (c.verdict) {
    case FrameRateVerdict::guaranteed:
      return fmt::format("{}: above {}", rate, proved);
    case FrameRateVerdict::likely:
      return fmt::format("{}: below {}, above the {:.3g} Hz at which corrections overshoot", rate,
                         proved, c.true_limit_fps);
    case FrameRateVerdict::tooSlow:
      return fmt::format(
          "{}: below the {:.3g} Hz at which corrections overshoot{}", rate, c.true_limit_fps,
          isGuarded ? "; each is ended once complete" : " (depth.pose.guard: false)");
  }
  return rate;
}

}  // namespace

FrameRateMonitor::FrameRateMonitor(const EstimatorSetup& setup)
    : ke_(setup.depth.estimator == EstimatorKind::pose ? observerGain(setup) : 0),
      kappa_(setup.depth.pose.kappa),
      kc_(setup.depth.pose.kc),
      isGuarded_(setup.depth.pose.guard) {}

std::optional<std::string> FrameRateMonitor::update(const PointSetEstimator& estimator) {
  const auto* target = dynamic_cast<const KnownTargetEstimator*>(&estimator);
  if (!target) return {};
  const double fps = target->observer().minimumFrameRate();
  if (std::isinf(fps) || (report_ && fps == report_->check.fps)) return {};
  const auto before = report_ ? report_->check.verdict : FrameRateVerdict::guaranteed;
  report_ = FrameRateReport{ke_, kappa_, kc_, checkFrameRate(fps, ke_, kappa_, kDelta, kc_), ""};
  report_->sentence = sentence(*report_, isGuarded_);
  if (report_->check.verdict == before) return {};
  return report_->sentence;
}

}  // namespace depthservo
