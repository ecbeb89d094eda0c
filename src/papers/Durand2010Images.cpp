#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "depthservo/scenario/run.h"
#include "motion/median.h"
#include "papers/Durand2010.h"

namespace depthservo::durand2010 {
namespace {

constexpr double kNeverStop_px = 1e5;
constexpr double kDone_px = 8;

class Witness : public RunWatcher {
 public:
  bool onFrame(const RunFrame& frame) override {
    wMc.push_back(*frame.exposure.wMc);
    return true;
  }
  std::vector<Eigen::Isometry3d> wMc;
};

std::size_t frameAt(double time_s) { return std::lround(time_s / kPeriod_s); }

std::vector<ImageRun> runs(Scenario scenario, unsigned seed, unsigned seeds) {
  std::vector<ImageRun> all;
  for (unsigned i = 0; i < seeds; ++i) {
    scenario.seed = seed + i;
    all.push_back(runThroughImages(scenario));
  }
  return all;
}

Scenario hidden(double from_s, double to_s, EstimatorKind estimator) {
  Scenario scenario = imageScenario();
  scenario.sensing.hidden = {{from_s, to_s, {}}};
  scenario.depth.estimator = estimator;
  return scenario;
}

/// rms over runs and points, of those that got as far as the frame.
template <class Value>
double rmsAt(const std::vector<ImageRun>& runs, std::size_t from, std::size_t to,
             const Value& value) {
  double squares = 0;
  int n = 0;
  for (const ImageRun& run : runs) {
    for (std::size_t k = from; k < std::min(to, run.log.frames.size()); ++k) {
      for (const FeatureRecord& feature : run.log.frames[k].features) {
        squares += value(feature);
        ++n;
      }
    }
  }
  return std::sqrt(squares / n);
}

double relativeChiSquared(const FeatureRecord& feature) {
  return std::pow(feature.estimate.chi * feature.Z_true - 1, 2);
}
double pixelErrorSquared(const FeatureRecord& feature) {
  return std::pow(feature.u - feature.u_true, 2) + std::pow(feature.v - feature.v_true, 2);
}

/// After when the true error stays below kDone_px, median over the runs [s].
double completed_s(const std::vector<ImageRun>& runs) {
  std::vector<double> times;
  for (const ImageRun& run : runs) {
    std::size_t since = run.log.frames.size();
    while (since > 0 && run.error_px(since - 1) < kDone_px) --since;
    times.push_back(static_cast<double>(since) * kPeriod_s);
  }
  return detail::medianOf(times);
}

bool allEnd(const std::vector<ImageRun>& runs, Outcome outcome) {
  return std::all_of(runs.begin(), runs.end(),
                     [&](const ImageRun& run) { return run.log.outcome == outcome; });
}

/// Distance of the camera from its goal [m].
double cameraError(const ImageRun& run, double time_s) {
  const std::size_t k = std::min(frameAt(time_s), run.wMc.size() - 1);
  const Eigen::Vector2d at = run.wMc[k].translation().head<2>();
  return (at - Eigen::Vector2d(1, 0)).norm();
}

void addOpenEyed(Measurements& measured, unsigned seed, unsigned seeds) {
  Scenario perfect = imageScenario();
  perfect.sensing.pixel_noise = 0;
  const auto exact = runs(perfect, seed, 1);
  measured.add("images/i/completed", allEnd(exact, Outcome::converged));
  measured.add("images/i/error", rmsAt(exact, frameAt(2), SIZE_MAX, relativeChiSquared) < .02);

  const auto noisy = runs(imageScenario(), seed, 2 * seeds);
  for (const int time_s : {5, 7, 10}) {
    measured.add(fmt::format("images/ii/{}s/relchi", time_s),
                 rmsAt(noisy, frameAt(time_s), frameAt(time_s) + 1, relativeChiSquared));
  }
  measured.add("images/ii/completed", completed_s(noisy));
}

void addShortOcclusion(Measurements& measured, unsigned seed, unsigned seeds) {
  const auto survived = runs(hidden(7, 9, EstimatorKind::window), seed, seeds);
  measured.add("images/iii/rms", rmsAt(survived, 70, 90, pixelErrorSquared));
  measured.add("images/iii/last", rmsAt(survived, 89, 90, pixelErrorSquared));
  measured.add("images/iii/completed", completed_s(survived));
  measured.add("images/iii/all-complete", allEnd(survived, Outcome::converged));
  Scenario blind = hidden(7, 9, EstimatorKind::constant);
  blind.control.hidden_sigma = kNeverStop_px;
  measured.add("images/iii/z-star", allEnd(runs(blind, seed, 1), Outcome::leftImage));
}

void addLongOcclusion(Measurements& measured, unsigned seed, unsigned seeds) {
  Scenario daring = hidden(7, 20, EstimatorKind::window);
  daring.control.hidden_sigma = kNeverStop_px;
  double sum = 0, worst = 0;
  for (const ImageRun& run : runs(daring, seed, seeds)) {
    sum += cameraError(run, 20);
    worst = std::max(worst, cameraError(run, 20));
  }
  measured.add("images/long/mean", sum / seeds);
  measured.add("images/long/max", worst);
  const auto cautious = runs(hidden(7, 20, EstimatorKind::window), seed, 1);
  measured.add("images/long/cautious", allEnd(cautious, Outcome::converged));
  daring.depth.estimator = EstimatorKind::constant;
  measured.add("images/long/z-star", allEnd(runs(daring, seed, 1), Outcome::leftImage));
}

}  // namespace

Scenario imageScenario() {
  Scenario s;
  s.name = "noise";
  s.duration = 40;
  s.camera.rate = {1 / kPeriod_s};
  s.camera.fx = s.camera.fy = kFocal_px;
  s.target.points = {{-0.3, 0.3, 0}, {0.3, 0.3, 0}, {0.3, -0.3, 0}, {-0.3, -0.3, 0}};
  s.target.radius = 0.03;
  s.target.pose = {{0, 0, 0.5}, {-M_PI / 2, 0, M_PI / 2}};
  s.robot.type = RobotKind::panUnicycle;
  s.robot.pan_axis = 0.1;
  s.robot.camera_offset = {0.1, 0, 0.5};
  s.robot.initial.x = kStart.x;
  s.robot.initial.y = kStart.y;
  s.robot.initial.theta = kStart.theta;
  s.robot.goal.emplace();
  s.robot.goal->x = kGoal.x;
  s.robot.goal->y = kGoal.y;
  s.robot.goal->theta = kGoal.theta;
  s.robot.limits.v = s.robot.limits.w = s.robot.limits.pan = 5;
  s.robot.limits.dv = s.robot.limits.dw = 1000;
  s.sensing.pixel_noise = 1;
  s.odometry.rate = 1 / kPeriod_s;
  s.depth.estimator = EstimatorKind::window;
  s.depth.initial = 1;
  s.depth.Z_min = 0.15;
  s.control.law = Law::task;
  s.control.gain = 0.7;
  s.expect.emplace();
  return s;
}

double ImageRun::error_px(std::size_t frame) const {
  double largest = 0;
  for (const FeatureRecord& feature : log.frames[frame].features) {
    const Eigen::Vector2d& goal = log.goals[static_cast<std::size_t>(feature.id)];
    largest = std::max(
        {largest, std::abs(feature.u_true - goal.x()), std::abs(feature.v_true - goal.y())});
  }
  return largest;
}

ImageRun runThroughImages(const Scenario& scenario) {
  Witness witness;
  ImageRun run;
  run.log = depthservo::run(scenario, &witness);
  run.wMc = std::move(witness.wMc);
  return run;
}

void addImages(Measurements& measured, unsigned seed, unsigned seeds) {
  addOpenEyed(measured, seed, seeds);
  addShortOcclusion(measured, seed, seeds);
  addLongOcclusion(measured, seed, seeds);
}

}  // namespace depthservo::durand2010
