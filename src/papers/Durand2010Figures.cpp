#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "depthservo/depth/CramerRaoBound.h"
#include "papers/Durand2010.h"

namespace depthservo::durand2010 {
namespace {

constexpr int kFrom = 70, kTo = 90, kLongTo = 200;  // ticks without images

double seconds(std::size_t tick) { return static_cast<double>(tick) * kPeriod_s; }

const OcclusionCase& caseNamed(const std::vector<OcclusionCase>& cases, const std::string& id) {
  return *std::find_if(cases.begin(), cases.end(),
                       [&](const OcclusionCase& c) { return c.id == id; });
}

/// Where the camera goes on the floor.
Curve cameraPath(const Run& run, Curve path) {
  for (const Tick& tick : run) {
    path.add(tick.wMc.translation().x(), tick.wMc.translation().y());
  }
  return path;
}

Panel floorPanel() {
  Panel panel = Panel::labelled("", "x [m]", "y [m]");
  panel.axes = Panel::Axes::map;
  Curve landmark = Curve::named("landmark, from above", Curve::Style::points, Curve::kBlack);
  landmark.add(0, -0.3);
  landmark.add(0, 0.3);
  Curve goal = Curve::named("goal of the camera", Curve::Style::points, 3);
  goal.add(1, 0);
  panel.curves = {landmark, goal};
  return panel;
}

Panel imagePanel(const Run& run) {
  Panel panel = Panel::labelled("", "x [px]", "y [px]");
  panel.axes = Panel::Axes::image;
  PanUnicycle robot({0.1, 0.1, 0, 0});
  const Points goal = project(robot.wMcAt(kGoal));
  Curve goals = Curve::named("goals", Curve::Style::points, Curve::kBlack);
  for (int i = 0; i < kPoints; ++i) {
    Curve path = Curve::named(fmt::format("point {}", i));
    path.colour = i;
    for (const Tick& tick : run) {
      path.add(kFocal_px * tick.truth[i].x, kFocal_px * tick.truth[i].y);
    }
    panel.curves.push_back(path);
    goals.add(kFocal_px * goal[i].x, kFocal_px * goal[i].y);
  }
  panel.curves.push_back(goals);
  return panel;
}

Figure motionFigure(unsigned seed) {
  const auto cases = occlusionCases();
  const auto start = caseNamed(cases, "ml").start;
  const Run free = simulate(seed, Noise::none, 300);
  const Run hidden =
      simulate(seed, Noise::gaussian, 300, {kFrom, kTo, WhileHidden::reconstruct, start});
  Panel floor = floorPanel();
  floor.curves.push_back(
      cameraPath(free, Curve::named("camera, without noise", Curve::Style::line, 0)));
  floor.curves.push_back(
      cameraPath(hidden, Curve::named("1 px noise, hidden 7 s to 9 s", Curve::Style::dashed, 1)));
  Figure figure;
  figure.name = "motion";
  figure.columns = 2;
  figure.panels = {floor, imagePanel(free)};
  return figure;
}

/// Root mean square of relative errors of chi, over runs and points, by tick.
struct Spread {
  std::vector<double> squares;
  std::vector<int> n;

  explicit Spread(std::size_t ticks) : squares(ticks), n(ticks) {}
  void add(std::size_t tick, double relative) {
    squares[tick] += relative * relative;
    ++n[tick];
  }
  Curve curve(Curve to) const {
    for (std::size_t tick = 1; tick < squares.size(); ++tick) {
      if (n[tick] == 0) continue;
      to.add(seconds(tick), 100 * std::sqrt(squares[tick] / n[tick]));
    }
    return to;
  }
};

/// The limit for every estimator, mean over the points.
Curve bound(const Run& exact, std::size_t ticks) {
  Curve limit = Curve::named("limit (Cramer-Rao), all images", Curve::Style::dashed, Curve::kBlack);
  std::vector<CramerRaoBound> bounds;
  for (const PointState& point : exact[0].truth) {
    bounds.emplace_back(std::vector<PointState>{point}, std::numeric_limits<double>::infinity());
    bounds.back().measure(0, 1 / kFocal_px);
  }
  for (std::size_t tick = 1; tick < ticks; ++tick) {
    double squares = 0;
    for (CramerRaoBound& bound : bounds) {
      bound.advance(Motion::fromPoses(exact[tick - 1].wMc, exact[tick].wMc, kPeriod_s),
                    OdometryNoise::none());
      bound.measure(0, 1 / kFocal_px);
      squares += bound.relativeSigma(0) * bound.relativeSigma(0);
    }
    limit.add(seconds(tick), 100 * std::sqrt(squares / kPoints));
  }
  return limit;
}

Figure noiseFigure(unsigned seed) {
  constexpr unsigned kSeeds = 100;
  constexpr std::size_t kTicks = 131;
  struct Method {
    const char* name;
    Fit fit;
    int m;
    Spread errors;
  };
  std::vector<Method> methods = {
      {"least squares, m <= 20 (paper)", fitLeastSquares, 20, Spread(kTicks)},
      {"maximum likelihood, m <= 20", fitMaximumLikelihood, 20, Spread(kTicks)},
      {"maximum likelihood, m <= 50", fitMaximumLikelihood, 50, Spread(kTicks)}};
  Spread observer(kTicks);
  const SampledObserver scheduled{2, 1, true};
  for (unsigned i = 0; i < kSeeds; ++i) {
    const Run run = simulate(seed + i, Noise::gaussian, kTicks);
    for (int point = 0; point < kPoints; ++point) {
      for (std::size_t tick = 1; tick < kTicks; tick += 2) {
        for (Method& method : methods) {
          const double chi = fitAt(run, static_cast<int>(tick), point, method.fit, method.m).chi();
          method.errors.add(tick, chi / run[tick].truth[point].chi - 1);
        }
      }
      const auto relative = scheduled.relativeErrors(run, point, kTicks);
      for (std::size_t j = 0; j < relative.size(); ++j) observer.add(j + 1, relative[j]);
    }
  }
  Panel panel = Panel::labelled("", "time [s]", "rms relative error of 1/Z [%]");
  panel.logY = true;
  panel.yRange = {0.2, 100};
  for (const Method& method : methods) {
    panel.curves.push_back(method.errors.curve(Curve::named(method.name)));
  }
  panel.curves.push_back(
      observer.curve(Curve::named("observer (De Luca et al. 2008), k = 2, k_3 = 1/Omega^2")));
  panel.curves.push_back(bound(simulate(seed, Noise::none, kTicks), kTicks));
  Figure figure;
  figure.name = "noise";
  figure.panels = {panel};
  return figure;
}

/// How far the features used are from the true ones, by tick; rms over the runs and points [px].
Curve reconstruction(const std::vector<Run>& runs, Curve curve) {
  for (std::size_t tick = kFrom; tick < kTo; ++tick) {
    double squares = 0;
    for (const Run& run : runs) {
      for (int i = 0; i < kPoints; ++i) {
        const PointState &used = run[tick].used[i], &truth = run[tick].truth[i];
        squares += std::pow(used.x - truth.x, 2) + std::pow(used.y - truth.y, 2);
      }
    }
    curve.add(seconds(tick),
              kFocal_px * std::sqrt(squares / static_cast<double>(runs.size() * kPoints)));
  }
  return curve;
}

Figure occlusionFigure(unsigned seed) {
  constexpr unsigned kRuns = 25;
  Panel hidden = Panel::labelled("hidden for 7 s <= t < 9 s", "time [s]",
                                 "rms error of the reconstructed features [px]");
  hidden.logY = true;
  hidden.yRange = {0.5, 300};
  Panel floor = floorPanel();
  floor.title = "hidden for 7 s <= t < 20 s: way of the camera";
  floor.xRange = {0, 3};
  floor.yRange = {-1, 2};
  int colour = 0;
  const auto cases = occlusionCases();
  for (const char* id : {"ls", "ml", "true-Z", "0.7Z", "1.5Z", "z-star"}) {
    const OcclusionCase& c = caseNamed(cases, id);
    const Curve look = Curve::named(c.claim, Curve::Style::line, colour++);
    std::vector<Run> runs;
    for (unsigned i = 0; i < kRuns; ++i) {
      runs.push_back(simulate(seed + i, Noise::gaussian, kTo, {kFrom, kTo, c.what, c.start}));
    }
    hidden.curves.push_back(reconstruction(runs, look));
    floor.curves.push_back(cameraPath(
        simulate(seed, Noise::gaussian, kLongTo, {kFrom, kLongTo, c.what, c.start}), look));
  }
  Figure figure;
  figure.name = "occlusions";
  figure.columns = 2;
  figure.panels = {hidden, floor};
  return figure;
}

/// Way of the points in the image: as measured, and as predicted while hidden.
Panel imagePathsOf(const ImageRun& run) {
  Panel panel =
      Panel::labelled("hidden for 7 s <= t < 9 s: the dots in the image", "u [px]", "v [px]");
  panel.axes = Panel::Axes::image;
  panel.xRange = {0, static_cast<double>(run.log.camera.width)};
  panel.yRange = {0, static_cast<double>(run.log.camera.height)};
  Curve goals = Curve::named("goals", Curve::Style::points, Curve::kBlack);
  for (int i = 0; i < kPoints; ++i) {
    Curve seen = Curve::named(i == 0 ? "measured" : "", Curve::Style::line, 0);
    Curve predicted = Curve::named(i == 0 ? "predicted while hidden" : "", Curve::Style::line, 3);
    for (const FrameRecord& frame : run.log.frames) {
      const FeatureRecord& feature = frame.features[i];
      (feature.measured ? seen : predicted).add(feature.u, feature.v);
      (feature.measured ? predicted : seen).add(NAN, NAN);
    }
    panel.curves.push_back(seen);
    panel.curves.push_back(predicted);
    goals.add(run.log.goals[i].x(), run.log.goals[i].y());
  }
  panel.curves.push_back(goals);
  return panel;
}

Panel depthsOf(const ImageRun& run) {
  Panel panel = Panel::labelled("depth of dot 0", "time [s]", "Z [m]");
  panel.yRange = {0, 8};
  Curve truth = Curve::named("true", Curve::Style::line, Curve::kBlack);
  Curve estimate = Curve::named("estimated", Curve::Style::line, 0);
  Curve low = Curve::named("2 sigma", Curve::Style::dashed, 5),
        high = Curve::named("", Curve::Style::dashed, 5);
  for (const FrameRecord& frame : run.log.frames) {
    const FeatureRecord& feature = frame.features[0];
    const auto interval = feature.estimate.interval();
    truth.add(frame.time_s, feature.Z_true);
    estimate.add(frame.time_s, feature.estimate.Z());
    low.add(frame.time_s, interval.low);
    high.add(frame.time_s, interval.high);
  }
  panel.curves = {low, high, truth, estimate};
  return panel;
}

Figure imagesFigure(unsigned seed) {
  Panel floor = floorPanel();
  floor.title = "way of the camera";
  struct Case {
    const char* title;
    double to_s;
    EstimatorKind estimator;
  };
  Panel errors = Panel::labelled("true image error, max |s - s*|", "time [s]", "[px]");
  errors.logY = true;
  errors.yRange = {0.5, 500};
  int colour = 0;
  ImageRun shown;
  for (const Case& c : {Case{"hidden for 2 s, window", 9, EstimatorKind::window},
                        Case{"hidden for 13 s, window", 20, EstimatorKind::window},
                        Case{"hidden for 13 s, depth at the goal", 20, EstimatorKind::constant}}) {
    Scenario scenario = imageScenario();
    scenario.seed = seed;
    scenario.sensing.hidden = {{7, c.to_s, {}}};
    scenario.control.hidden_sigma = 1e5;
    scenario.depth.estimator = c.estimator;
    ImageRun run = runThroughImages(scenario);
    Curve path = Curve::named(c.title, Curve::Style::line, colour);
    for (const Eigen::Isometry3d& wMc : run.wMc) {
      path.add(wMc.translation().x(), wMc.translation().y());
    }
    floor.curves.push_back(path);
    Curve error = Curve::named(c.title, Curve::Style::line, colour);
    for (std::size_t k = 0; k < run.log.frames.size(); ++k) {
      error.add(run.log.frames[k].time_s, run.error_px(k));
    }
    errors.curves.push_back(error);
    if (colour++ == 0) shown = std::move(run);
  }
  Figure figure;
  figure.name = "images";
  figure.columns = 2;
  figure.panels = {imagePathsOf(shown), floor, depthsOf(shown), errors};
  return figure;
}

}  // namespace

std::vector<Figure> figures(unsigned seed) {
  return {motionFigure(seed), noiseFigure(seed), occlusionFigure(seed), imagesFigure(seed)};
}

}  // namespace depthservo::durand2010
