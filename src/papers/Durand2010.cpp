#include "papers/Durand2010.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "depthservo/depth/WindowDepthEstimator.h"
#include "motion/median.h"
#include "papers/runPapers.h"

namespace depthservo {
namespace {

using namespace durand2010;

std::size_t tickAt(double time_s) { return std::lround(time_s / kPeriod_s); }

double square(double x) { return x * x; }

struct Method {
  const char* id;
  Fit fit;
};
const Method kLeastSquares{"ls", fitLeastSquares};
const Method kLikelihood{"ml", fitMaximumLikelihood};
const Method kRobust{"robust", fitRobustly};

/// Errors of many estimates against the truth.
struct Errors {
  double relchi2 = 0, Z2 = 0;
  int n = 0, rejected = 0;

  void add(double chi, double chiTrue) {
    const double Z = 1 / chiTrue;
    relchi2 += square((chi - chiTrue) * Z);
    ++n;
    if (chi > 0 && 1 / chi < 3 * Z) {
      Z2 += square(1 / chi - Z);
    } else {
      ++rejected;
    }
  }
  double relchi() const { return std::sqrt(relchi2 / n); }
  double rms_Z() const { return std::sqrt(Z2 / (n - rejected)); }
  double rejectedPercent() const { return 100.0 * rejected / n; }
};

Errors errorsAt(const std::vector<Run>& runs, std::size_t tick, const Method& method,
                int m = kWindow) {
  Errors errors;
  for (const Run& run : runs) {
    for (int i = 0; i < kPoints; ++i) {
      errors.add(fitAt(run, static_cast<int>(tick), i, method.fit, m).chi(),
                 run[tick].truth[i].chi);
    }
  }
  return errors;
}

std::vector<Run> simulateAll(unsigned first, unsigned seeds, Noise noise, int ticks,
                             const Occlusion& occlusion = {}) {
  std::vector<Run> runs;
  for (unsigned i = 0; i < seeds; ++i) runs.push_back(simulate(first + i, noise, ticks, occlusion));
  return runs;
}

void addNoiseFree(Measurements& measured) {
  const Run run = simulate(0, Noise::none, 400);
  for (int i = 0; i < 3; ++i) measured.add(fmt::format("noise-free/command-{}", i), run[0].q[i]);
  for (const auto& [id, tick] : {std::pair{"5s", 50u}, {"7s", 70u}, {"end", 399u}}) {
    const auto& [x, y, theta, pan] = run[tick].state;
    for (const auto& [component, value] :
         {std::pair{"x", x}, {"y", y}, {"theta", theta}, {"pan", pan}}) {
      measured.add(fmt::format("noise-free/{}-{}", id, component), value);
    }
  }
  for (const int time_s : {0, 7, 9, 12, 15, 20}) {
    measured.add(fmt::format("noise-free/error-{}s", time_s), run[tickAt(time_s)].error_px);
  }
  double excursion[2] = {};
  for (const Tick& tick : run) {
    for (const PointState& p : tick.truth) {
      excursion[0] = std::max(excursion[0], kFocal_px * std::abs(p.x));
      excursion[1] = std::max(excursion[1], kFocal_px * std::abs(p.y));
    }
  }
  measured.add("noise-free/excursion-x", excursion[0]);
  measured.add("noise-free/excursion-y", excursion[1]);
}

/// (i): the estimator itself, from the first image on.
void addPerfectData(Measurements& measured) {
  const Run run = simulate(0, Noise::none, 200);
  for (WindowMethod method : {WindowMethod::leastSquares, WindowMethod::maximumLikelihood}) {
    WindowOptions options;
    options.method = method;
    double worst = 0;
    for (int i = 0; i < kPoints; ++i) {
      WindowDepthEstimator estimator(options);
      const auto seen = [&](const Tick& tick) {
        return PointMeasurement{tick.truth[i].x, tick.truth[i].y, 0};
      };
      estimator.reset(seen(run[0]), {1});
      for (std::size_t k = 1; k < run.size(); ++k) {
        estimator.predict(Motion::fromPoses(run[k - 1].wMc, run[k].wMc, kPeriod_s));
        estimator.correct(seen(run[k]));
        worst = std::max(worst, std::abs(estimator.estimate().Z() - 1 / run[k].truth[i].chi));
      }
    }
    measured.add(method == WindowMethod::leastSquares ? "i/ls/error" : "i/ml/error", worst);
  }
}

/// (ii): 1 px noise.
void addNoise(Measurements& measured, const std::vector<Run>& runs) {
  for (const int time_s : {1, 2, 3, 5, 7, 10}) {
    for (const Method& method : {kLeastSquares, kLikelihood}) {
      const Errors errors = errorsAt(runs, tickAt(time_s), method);
      const std::string id = fmt::format("ii/{}s/{}", time_s, method.id);
      measured.add(id + "/rms-Z", errors.rms_Z());
      measured.add(id + "/relchi", errors.relchi());
      measured.add(id + "/rejected", errors.rejectedPercent());
    }
  }
}

void addConvergence(Measurements& measured, const std::vector<Run>& runs) {
  struct Case {
    Method method;
    int m;
  };
  for (const Case& c : {Case{kLeastSquares, 20}, Case{kLikelihood, 20}, Case{kLikelihood, 50}}) {
    std::map<double, double> since_s{{0.2, 0}, {0.1, 0}, {0.05, 0}};
    for (std::size_t tick = 1; tick < runs[0].size(); ++tick) {
      const double relchi = errorsAt(runs, tick, c.method, c.m).relchi();
      for (auto& [limit, since] : since_s) {
        if (!(relchi < limit)) since = static_cast<double>(tick + 1) * kPeriod_s;
      }
    }
    for (const auto& [limit, since] : since_s) {
      measured.add(fmt::format("ii/below-{}/{}{}", limit, c.method.id, c.m), since);
    }
  }
}

void addWindows(Measurements& measured, const std::vector<Run>& runs) {
  for (const int m : {5, 10, 20, 30, 50}) {
    for (const Method& method : {kLeastSquares, kLikelihood}) {
      measured.add(fmt::format("ii/window-{}/{}", m, method.id),
                   errorsAt(runs, 50, method, m).relchi());
    }
  }
}

void addOutliers(Measurements& measured, const std::vector<Run>& runs, unsigned seed) {
  std::vector<int> ticks(kWindow + 1);
  for (int j = 0; j <= kWindow; ++j) ticks[j] = 50 - j;
  for (const std::string spoilt : {"clean", "past", "current"}) {
    for (const Method& method : {kLeastSquares, kLikelihood, kRobust}) {
      std::mt19937 engine(seed);
      std::uniform_real_distribution<double> unit;
      const auto throwOff = [&](WindowImage& image) {
        const double angle = 2 * M_PI * unit(engine);
        image.point.x += 10 / kFocal_px * std::cos(angle);
        image.point.y += 10 / kFocal_px * std::sin(angle);
      };
      Errors errors;
      for (const Run& run : runs) {
        for (int i = 0; i < kPoints; ++i) {
          std::vector<WindowImage> images = imagesAt(run, ticks, i);
          if (spoilt == "current") throwOff(images[0]);
          for (std::size_t j = 1; j < images.size(); ++j) {
            if (spoilt == "past" && unit(engine) < 0.1) throwOff(images[j]);
          }
          errors.add(fitOf(images, method.fit).chi(), run[50].truth[i].chi);
        }
      }
      measured.add(fmt::format("ii/outliers-{}/{}", spoilt, method.id), errors.relchi());
    }
  }
}

/// Start values of the reconstruction.
PointState withRawImage(const Run& run, int point, double chi) {
  const PointState& m = run.back().measured[point];
  return {m.x, m.y, chi};
}
PointState startLeastSquares(const Run& run, int point) {
  const int last = static_cast<int>(run.size()) - 1;
  return withRawImage(run, point, fitAt(run, last, point, fitLeastSquares).chi());
}
PointState startLikelihood(const Run& run, int point) {
  const int last = static_cast<int>(run.size()) - 1;
  const Eigen::Vector3d p = fitAt(run, last, point, fitMaximumLikelihood).point;
  return {p.x(), p.y(), p.z()};
}
auto startScaled(double factor) {
  return [factor](const Run& run, int point) {
    return withRawImage(run, point, run.back().truth[point].chi / factor);
  };
}
PointState startDesired(const Run& run, int point) { return withRawImage(run, point, 1); }

}  // namespace

std::vector<durand2010::OcclusionCase> durand2010::occlusionCases() {
  using W = WhileHidden;
  return {{"ls", "Z by least squares, raw image (paper)", W::reconstruct, startLeastSquares},
          {"ml", "maximum likelihood", W::reconstruct, startLikelihood},
          {"true-Z", "true Z, raw image", W::reconstruct, startScaled(1)},
          {"0.5Z", "0.5 Z", W::reconstruct, startScaled(0.5)},
          {"0.7Z", "0.7 Z", W::reconstruct, startScaled(0.7)},
          {"1.5Z", "1.5 Z", W::reconstruct, startScaled(1.5)},
          {"2Z", "2 Z", W::reconstruct, startScaled(2)},
          {"z-star", "depth at the goal", W::reconstruct, startDesired},
          {"frozen", "features frozen", W::freeze, {}},
          {"held-velocity", "velocity held", W::holdVelocity, {}},
          {"stop", "robot stopped", W::stop, {}}};
}

namespace {

/// How far the features used are from the true ones while hidden.
double reconstruction_px(const std::vector<Run>& runs, std::size_t from, std::size_t to) {
  double sum = 0;
  for (const Run& run : runs) {
    for (std::size_t tick = from; tick < to; ++tick) {
      for (int i = 0; i < kPoints; ++i) {
        sum += square(run[tick].used[i].x - run[tick].truth[i].x) +
               square(run[tick].used[i].y - run[tick].truth[i].y);
      }
    }
  }
  const double n = static_cast<double>(runs.size() * (to - from) * kPoints);
  return kFocal_px * std::sqrt(sum / n);
}

/// After when the true error stays below 8 px; median over the runs [s].
double completed_s(const std::vector<Run>& runs) {
  std::vector<double> times;
  for (const Run& run : runs) {
    std::size_t since = run.size();
    while (since > 0 && run[since - 1].error_px < 8) --since;
    times.push_back(static_cast<double>(since) * kPeriod_s);
  }
  return detail::medianOf(times);
}

/// (iii): images hidden for 7 <= t < 9 s.
void addShortOcclusion(Measurements& measured, unsigned seed, unsigned seeds,
                       const std::vector<Run>& unhidden) {
  constexpr int kTicks = 250, kFrom = 70, kTo = 90;
  measured.add("iii/none-hidden/completed", completed_s(unhidden));
  bool allComplete = true;
  for (const OcclusionCase& c : occlusionCases()) {
    const auto runs =
        simulateAll(seed, seeds, Noise::gaussian, kTicks, {kFrom, kTo, c.what, c.start});
    const std::string id = fmt::format("iii/{}", c.id);
    measured.add(id + "/rms", reconstruction_px(runs, kFrom, kTo));
    measured.add(id + "/last", reconstruction_px(runs, kTo - 1, kTo));
    measured.add(id + "/completed", completed_s(runs));
    allComplete = allComplete && std::all_of(runs.begin(), runs.end(), [](const Run& run) {
                    return run.back().error_px < 8;
                  });
  }
  measured.add("iii/all-complete", allComplete);
  const Run exact =
      simulate(0, Noise::none, kTo, {kFrom, kTo, WhileHidden::reconstruct, startLeastSquares});
  measured.add("iii/noise-free", reconstruction_px({exact}, kFrom, kTo));
}

/// The first images after the occlusion, with and without those from before it.
void addReturn(Measurements& measured, unsigned seed, unsigned seeds) {
  const auto runs = simulateAll(seed, seeds, Noise::gaussian, 93,
                                {70, 90, WhileHidden::reconstruct, startLeastSquares});
  std::vector<int> kept{90};
  for (int tick = 69; tick > 69 - kWindow; --tick) kept.push_back(tick);
  Errors keeping, restarting;
  for (const Run& run : runs) {
    for (int i = 0; i < kPoints; ++i) {
      keeping.add(fitOf(imagesAt(run, kept, i), fitLeastSquares).chi(), run[90].truth[i].chi);
      restarting.add(fitOf(imagesAt(run, {92, 91, 90}, i), fitLeastSquares).chi(),
                     run[92].truth[i].chi);
    }
  }
  measured.add("iii/return/keeping", keeping.relchi());
  measured.add("iii/return/restarting", restarting.relchi());
}

/// Images hidden for 7 <= t < 20 s: where the camera is then.
void addLongOcclusion(Measurements& measured, unsigned seed, unsigned seeds) {
  constexpr int kFrom = 70, kTo = 200;
  for (const OcclusionCase& c : occlusionCases()) {
    const auto runs =
        simulateAll(seed, seeds, Noise::gaussian, kTo + 1, {kFrom, kTo, c.what, c.start});
    double sum = 0, worst = 0;
    int nearTarget = 0;
    const Eigen::Vector3d goal(1, 0, 0);
    for (const Run& run : runs) {
      const double error = (run.back().wMc.translation() - goal).norm();
      sum += error;
      worst = std::max(worst, error);
      nearTarget += std::any_of(run.begin(), run.end(),
                                [](const Tick& tick) { return tick.wMc.translation().x() < 0.15; });
    }
    const std::string id = fmt::format("long/{}", c.id);
    measured.add(id + "/mean", sum / static_cast<double>(runs.size()));
    measured.add(id + "/max", worst);
    measured.add(id + "/near-target", 100. * nearTarget / static_cast<double>(runs.size()));
  }
}

/// From when on the observer is within 5 % for all points, without noise; at most 15 s [s].
double settled_s(const SampledObserver& observer, const Run& exact) {
  double since_s = 0;
  for (int i = 0; i < kPoints; ++i) {
    const std::vector<double> errors = observer.relativeErrors(exact, i, 151);
    for (std::size_t j = 0; j < errors.size(); ++j) {
      if (std::abs(errors[j]) < 0.05) continue;
      since_s = std::max(since_s, static_cast<double>(j + 2) * kPeriod_s);
    }
  }
  return since_s;
}

/// De Luca's observer on the same images.
void addObserver(Measurements& measured, const std::vector<Run>& runs) {
  struct Case {
    const char* id;
    SampledObserver observer;
  };
  const Run exact = simulate(0, Noise::none, 151);
  double best5s = 1;
  for (const Case& c : {Case{"5-100", {5, 100, false}}, Case{"5-500", {5, 500, false}},
                        Case{"5-2000", {5, 2000, false}}, Case{"5-5000", {5, 5000, false}},
                        Case{"2-scheduled", {2, 1, true}}, Case{"5-scheduled", {5, 6.25, true}}}) {
    const std::string id = fmt::format("observer/{}", c.id);
    const double since_s = settled_s(c.observer, exact);
    measured.add(id + "/settled", since_s);
    measured.add(id + "/never-settles", since_s > 15);
    std::map<int, Errors> errors{{2, {}}, {3, {}}, {5, {}}, {7, {}}, {10, {}}};
    for (const Run& run : runs) {
      for (int i = 0; i < kPoints; ++i) {
        const std::vector<double> relative = c.observer.relativeErrors(run, i, 101);
        for (auto& [time_s, at] : errors) at.add(1 + relative[10 * time_s - 1], 1);
      }
    }
    for (const auto& [time_s, at] : errors) {
      measured.add(fmt::format("{}/{}s", id, time_s), at.relchi());
    }
    best5s = std::min(best5s, errors[5].relchi());
  }
  measured.add("observer/ls-not-better", errorsAt(runs, 50, kLeastSquares).relchi() >= best5s);
  measured.add("observer/ml50-better", errorsAt(runs, 50, kLikelihood, 50).relchi() < best5s);
}

/// What cannot hold as printed.
void addPrint(Measurements& measured) {
  PanUnicycle robot({0.1, 0.1, 0, 0});
  const PanUnicycle::State printed{5, 5, 2.35, 0};
  int ahead = 0;
  for (const PointState& p : project(robot.wMcAt(printed))) ahead += p.chi > 0;
  measured.add("print/start", ahead);
  const Run run = simulate(0, Noise::none, 2);
  const double dx = run[1].state.x - run[0].state.x, dy = run[1].state.y - run[0].state.y;
  measured.add("print/arctan", std::abs(std::atan2(dy, dx) - std::atan(dy / dx)));
}

}  // namespace

Experiments runDurand2010(const ReproduceOptions& options) {
  const unsigned seeds = options.full ? 1000 : 200;
  Experiments r;
  Measurements& measured = r.measured;
  addPrint(measured);
  addNoiseFree(measured);
  addPerfectData(measured);
  const auto runs = simulateAll(options.seed, seeds, Noise::gaussian, 250);
  std::vector<Run> approach;
  approach.reserve(runs.size());
  for (const Run& run : runs) approach.emplace_back(run.begin(), run.begin() + 105);
  addNoise(measured, approach);
  addConvergence(measured, approach);
  addWindows(measured, approach);
  addOutliers(measured, approach, options.seed);
  const auto uniform = simulateAll(options.seed, seeds, Noise::uniform, 25);
  for (const Method& method : {kLeastSquares, kLikelihood}) {
    measured.add(fmt::format("ii/uniform/{}", method.id), errorsAt(uniform, 20, method).relchi());
  }
  addShortOcclusion(measured, options.seed, seeds, runs);
  addReturn(measured, options.seed, seeds);
  addLongOcclusion(measured, options.seed, seeds);
  addObserver(measured, approach);
  addImages(measured, options.seed, options.full ? 100 : 6);
  r.figures = figures(options.seed);
  return r;
}

}  // namespace depthservo
