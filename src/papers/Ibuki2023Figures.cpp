#include <algorithm>
#include <functional>

#include "depthservo/pose/FrameRateConditions.h"
#include "papers/Ibuki2023.h"

namespace depthservo::ibuki2023 {
namespace {

constexpr double kBound = 7.8168;      // (27), on |e|
constexpr std::size_t kPlotted = 600;  // points of a curve
constexpr double kLeast = 1e-9;        // of a logarithmic axis

/// One quantity of a simulation over time, thinned out.
Curve over(const Trace& trace, const std::function<double(const Sample&)>& quantity, Curve curve) {
  const std::size_t step = std::max<std::size_t>(1, trace.samples.size() / kPlotted);
  for (std::size_t i = 0; i < trace.samples.size(); i += step) {
    curve.add(trace.samples[i].time_s, quantity(trace.samples[i]));
  }
  return curve;
}

double errorOf(const Sample& sample) { return std::max(sample.e, kLeast); }
double energyOf(const Sample& sample) { return std::max(sample.U, kLeast * kLeast); }

/// Energy and size of the errors over time, of a coupled and a cascade law.
std::vector<Panel> errorPanels(const Trace& coupled, const Trace& cascade) {
  Panel U = Panel::labelled("", "time [s]", "energy U of the errors");
  Panel e = Panel::labelled("", "time [s]", "error |e| [m, rad]");
  U.logY = e.logY = true;
  U.curves = {over(coupled, energyOf, Curve::named("coupled law (22)")),
              over(cascade, energyOf, Curve::named("cascade"))};
  e.curves = {over(coupled, errorOf, Curve::named("coupled law (22)")),
              over(cascade, errorOf, Curve::named("cascade"))};
  return {U, e};
}

/// Linear and angular velocity of the camera.
std::vector<Panel> velocities(const Trace& trace, bool isPlanar) {
  std::vector<Panel> panels{Panel::labelled("", "time [s]", "velocity of the camera [m/s]"),
                            Panel::labelled("", "time [s]", "turn rate of the camera [rad/s]")};
  const char* axes[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    if (!isPlanar || i != 1) {
      panels[0].curves.push_back(over(
          trace, [i](const Sample& s) { return s.twist.linear[i]; }, Curve::named(axes[i])));
    }
    if (!isPlanar || i == 1) {
      panels[1].curves.push_back(over(
          trace, [i](const Sample& s) { return s.twist.angular[i]; }, Curve::named(axes[i])));
    }
  }
  return panels;
}

Figure simulationFigure(bool isVariable) {
  const Experiment experiment = isVariable ? simulationAVariable() : simulationA(60);
  Experiment cascade = experiment, images = rendered(experiment);
  cascade.law = Law::cascade;
  images.method = ImageErrorMethod::iterated;
  const Trace coupled = simulate(experiment), alone = simulate(cascade), seen = simulate(images);
  std::vector<Panel> panels = errorPanels(coupled, alone);
  panels[0].yRange = {1e-12, 100};
  panels[1].yRange = {1e-6, 20};
  panels[1].curves.push_back(
      over(seen, errorOf, Curve::named("coupled, through rendered images", Curve::Style::dashed)));
  panels[1].curves.push_back(
      Curve::level(kBound, 0, experiment.end_s, "guaranteed in the end, (27)"));
  Figure figure;
  figure.name = isVariable ? "simulation-variable-rate" : "simulation-60fps";
  figure.columns = 2;
  figure.panels = std::move(panels);
  std::vector<Panel> driven = velocities(coupled, false);
  driven[0].yRange = {-3, 3};
  driven[1].yRange = {-2, 2};
  figure.panels.insert(figure.panels.end(), driven.begin(), driven.end());
  return figure;
}

Figure experimentFigure() {
  Experiment b = experimentB(), cascade = b, images = rendered(b);
  cascade.law = images.law = Law::cascade;
  images.noise_px = 0.5;
  const Trace coupled = simulate(b), alone = simulate(cascade), seen = simulate(images);
  std::vector<Panel> panels = errorPanels(coupled, alone);
  panels[0].yRange = {1e-14, 1};
  panels[1].yRange = {1e-6, 1};
  panels[1].curves.push_back(
      over(seen, errorOf, Curve::named("cascade, rendered images, 0.5 px noise")));
  Figure figure;
  figure.name = "experiment-18fps";
  figure.columns = 2;
  figure.panels = std::move(panels);
  const std::vector<Panel> driven = velocities(alone, true);
  figure.panels.insert(figure.panels.end(), driven.begin(), driven.end());
  return figure;
}

Figure sweepFigure() {
  const double rates[] = {.6, .7, .8, .9, 1, 1.2, 1.5, 2, 3, 5, 10, 20, 30, 60};
  Panel moving = Panel::labelled("target turning and swinging", "frame rate [Hz]",
                                 "largest |e|, 32 s to 50 s [m, rad]");
  Panel still = Panel::labelled("target still for 10 s", "frame rate [Hz]", "|e| at 60 s [m, rad]");
  moving.logX = still.logX = moving.logY = still.logY = true;
  moving.yRange = {0.3, 1000};
  still.yRange = {1e-10, 1000};
  struct Variant {
    const char* name;
    Law law;
    VisualMotionObserverOptions::LostFrames lostFrames;
  };
  using LostFrames = VisualMotionObserverOptions::LostFrames;
  for (const Variant& variant : {Variant{"coupled law (22)", Law::coupled, LostFrames::unguarded},
                                 Variant{"coupled, guarded", Law::coupled, LostFrames::guarded},
                                 Variant{"cascade, guarded", Law::cascade, LostFrames::guarded}}) {
    Curve largest = Curve::named(variant.name), end = Curve::named(variant.name);
    for (const double fps : rates) {
      Experiment experiment = sweepAt(fps, variant.law);
      experiment.lostFrames = variant.lostFrames;
      const Trace trace = simulate(experiment);
      largest.add(fps, std::min(trace.largest(32, 50), 999.));
      end.add(fps, std::clamp(trace.samples.back().e, kLeast, 999.));
    }
    moving.curves.push_back(largest);
    still.curves.push_back(end);
  }
  Figure figure;
  figure.name = "frame-rate-sweep";
  figure.columns = 2;
  figure.panels = {moving, still};
  return figure;
}

Figure noiseFigure(const ReproduceOptions& options) {
  Panel depth = Panel::labelled("", "observer gain ke [1/s]", "rms depth error [mm]");
  depth.logX = depth.logY = true;
  Curve still = Curve::named("still target"), moving = Curve::named("moving target"),
        stillPose = Curve::named("pose of each image alone, still", Curve::Style::dashed, 0),
        movingPose = Curve::named("pose of each image alone, moving", Curve::Style::dashed, 1),
        stillSeen = Curve::named("still, rendered images", Curve::Style::points, 0),
        movingSeen = Curve::named("moving, rendered images", Curve::Style::points, 1);
  still.colour = 0;
  moving.colour = 1;
  for (const double ke : {.7, 1.4, 2.5, 5., 9., 13., 18.}) {
    for (const bool isRendered : {false, true}) {
      Experiment c = experimentB();
      if (isRendered) c = rendered(c);
      if (!isRendered) c.source = ErrorSource::image;
      c.law = Law::cascade;
      c.ke = ke;
      c.noise_px = .5;
      c.seed = options.seed;
      c.comparesPose = true;
      c.end_s = 25;
      PoseErrors errors[2], poses[2];
      for (const Trace::FramePoses& frame : simulate(c).frames) {
        if (frame.time_s < 7) continue;
        const int isMoving = frame.time_s < 10 ? 0 : 1;
        errors[isMoving].add(frame.observed, frame.truth, c.points);
        if (frame.fromOneImage) poses[isMoving].add(*frame.fromOneImage, frame.truth, c.points);
      }
      const auto add = [ke](Curve& curve, const PoseErrors& e) { curve.add(ke, 1e3 * e.depth()); };
      add(isRendered ? stillSeen : still, errors[0]);
      add(isRendered ? movingSeen : moving, errors[1]);
      if (isRendered) continue;
      add(stillPose, poses[0]);
      add(movingPose, poses[1]);
    }
  }
  depth.curves = {still, moving, stillPose, movingPose, stillSeen, movingSeen};
  Figure figure;
  figure.name = "noise";
  figure.panels = {depth};
  return figure;
}

Figure conditionsFigure() {
  Panel rates = Panel::labelled("", "observer gain ke [1/s]", "frame rate [Hz]");
  rates.logX = rates.logY = true;
  Curve observer = Curve::named("observer converges, (7)"),
        regulation = Curve::named("regulation with kc = 4 ke converges, (23)"),
        moving = Curve::named("regulation, moving target: some bound, (28b)", Curve::Style::dashed),
        limit = Curve::named("corrections overshoot below, ke/2", Curve::Style::dashed);
  for (double ke = .2; ke < 21; ke *= 1.2) {
    const SampledGains gains{4 * ke, ke, .95, 1e9, 1, 0};
    const auto o = observerConditions(gains);
    const auto r = regulationConditions(gains);
    observer.add(ke, o.eq7);
    regulation.add(ke, *r.eq23);
    moving.add(ke, r.eq28b);
    limit.add(ke, o.true_limit_fps);
  }
  rates.curves = {observer, regulation, moving, limit};
  Figure figure;
  figure.name = "conditions";
  figure.panels = {rates};
  return figure;
}

}  // namespace

std::vector<Figure> figures(const ReproduceOptions& options) {
  return {simulationFigure(false), simulationFigure(true), experimentFigure(),
          sweepFigure(),           noiseFigure(options),   conditionsFigure()};
}

}  // namespace depthservo::ibuki2023
