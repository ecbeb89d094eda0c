#include <fmt/format.h>

#include <cmath>
#include <random>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/robots/MobileManipulator.h"
#include "papers/DeLuca2008.h"
#include "depth/EulerObserver.h"

namespace depthservo::deluca2008 {
namespace {

constexpr double kFocal_px = 128, kRate_Hz = 31.25, kDuration_s = 10;
constexpr double kK = 10, kK_3 = 0.8 * kFocal_px * kFocal_px;
constexpr double kDepth = 1.56, kGuess = 20;  // m

/// Noise is judged once the depth has settled [s].
constexpr double kSettled_s = 2;

/// Where the arm starts is not printed; from here it takes the printed times. [rad]
const Eigen::Vector3d kStart(0, 0.3, -1);

Eigen::VectorXd velocityAt(double t) {
  Eigen::VectorXd velocity = Eigen::VectorXd::Zero(5);
  velocity[2] = 0.2 * std::sin(0.4 * M_PI * t);
  velocity[3] = 0.1 * std::sin(0.8 * M_PI * t);
  return velocity;
}

/// An image of the point, and how the camera has come there.
struct Frame {
  double t = 0;
  Eigen::Vector3d cP;
  Motion motion;       ///< since the image before
  Twist twist_before;  ///< at the image before
  PointState measured() const { return {cP.x() / cP.z(), cP.y() / cP.z(), 1 / cP.z()}; }
};

std::vector<Frame> frames() {
  constexpr int kSteps = 32;
  const double dt = 1 / kRate_Hz;
  MobileManipulator robot({});
  MobileManipulator::State state;
  state.joints = kStart;
  robot.setState(state);
  const Eigen::Vector3d wP = robot.wMc() * Eigen::Vector3d(0, 0, kDepth);
  std::vector<Frame> frames(1);
  frames[0].cP = {0, 0, kDepth};
  for (int i = 0; i < std::lround(kDuration_s * kRate_Hz); ++i) {
    Frame frame;
    frame.t = (i + 1) * dt;
    frame.twist_before = robot.cameraTwist(velocityAt(i * dt));
    const Eigen::Isometry3d before = robot.wMc();
    for (int j = 0; j < kSteps; ++j) {
      robot.drive(velocityAt((i + (j + 0.5) / kSteps) * dt), dt / kSteps);
    }
    frame.motion = Motion::fromPoses(before, robot.wMc(), dt);
    frame.cP = robot.wMc().inverse() * wP;
    frames.push_back(frame);
  }
  return frames;
}

struct Sample {
  double t = 0, error = 0;  ///< relative, of 1/Z
};
using Samples = std::vector<Sample>;

Samples observed(const std::vector<Frame>& frames, double noise_px, unsigned seed) {
  NonlinearObserverOptions options;
  options.gains = {kK, kK_3, 0, 0};
  NonlinearDepthObserver observer(options);
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  const auto measure = [&](const Frame& frame) {
    const PointState p = frame.measured();
    const double sigma = noise_px / kFocal_px;
    if (!(sigma > 0)) return PointMeasurement{p.x, p.y, 0};
    const double dx = sigma * normal(engine), dy = sigma * normal(engine);
    return PointMeasurement{p.x + dx, p.y + dy, sigma};
  };
  observer.reset(measure(frames[0]), {kGuess});
  Samples samples{{0, kDepth / kGuess - 1}};
  for (std::size_t i = 1; i < frames.size(); ++i) {
    observer.predict(frames[i].motion);
    observer.correct(measure(frames[i]));
    samples.push_back({frames[i].t, observer.estimate().chi * frames[i].cP.z() - 1});
  }
  return samples;
}

/// By Euler's method, without noise.
Samples euler(const std::vector<Frame>& frames) {
  EulerObserver observer({kK, kK_3, 0, 0}, DepthRange{1e-6, 1e6});
  const auto measured = [](const Frame& frame) {
    return PointMeasurement{frame.measured().x, frame.measured().y, 0};
  };
  observer.reset(measured(frames[0]), {kGuess});
  Samples samples{{0, kDepth / kGuess - 1}};
  for (std::size_t i = 1; i < frames.size(); ++i) {
    observer.predict(Motion::fromTwist(frames[i].twist_before, 1 / kRate_Hz));
    observer.correct(measured(frames[i]));
    samples.push_back({frames[i].t, observer.estimate().chi * frames[i].cP.z() - 1});
  }
  return samples;
}

/// From when on the error stays below the limit.
double settled(const Samples& samples, double limit) {
  double since = 0;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    if (std::abs(samples[i].error) >= limit) since = samples[i + 1].t;
  }
  return since;
}

double rms(const std::vector<Samples>& runs) {
  double sum = 0;
  std::size_t count = 0;
  for (const Samples& samples : runs) {
    for (const Sample& s : samples) {
      if (s.t < kSettled_s) continue;
      sum += s.error * s.error;
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

Curve curve(const Samples& samples, const std::string& title) {
  Curve c = Curve::named(title);
  for (const Sample& s : samples) c.add(s.t, 100 * s.error);
  return c;
}

}  // namespace

void addArmExperiments(Experiments& r, const ReproduceOptions& options) {
  const std::vector<Frame> all = frames();
  const Samples exact = observed(all, 0, 0), sampled = euler(all);
  for (const double limit : {.10, .05}) {
    r.measured.add(fmt::format("5.1-arm/below-{:g}", limit), settled(exact, limit));
  }
  Figure figure;
  figure.name = "depth-arm";
  figure.columns = 2;
  Panel noisy = Panel::labelled("with image noise", "time [s]", "error of 1/Z [%]");
  const unsigned seeds = options.full ? 100 : 20;
  for (const double noise_px : {.3, .1, .05}) {
    std::vector<Samples> runs;
    for (unsigned i = 0; i < seeds; ++i) runs.push_back(observed(all, noise_px, options.seed + i));
    r.measured.add(fmt::format("5.1-arm/noise-{:g}px", noise_px), rms(runs));
    noisy.curves.push_back(curve(runs[0], fmt::format("{:g} px", noise_px)));
  }
  r.measured.add("5.1-arm/euler", rms({sampled}));
  Panel scheme = Panel::labelled("without noise", "time [s]", "error of 1/Z [%]");
  scheme.curves = {curve(exact, "the library's observer"), curve(sampled, "Euler's method")};
  for (Panel* panel : {&noisy, &scheme}) panel->yRange = {-100, 100};
  for (Panel* panel : {&noisy, &scheme}) panel->xRange = {0, kDuration_s};
  figure.panels = {noisy, scheme};
  r.figures.push_back(std::move(figure));
}

}  // namespace depthservo::deluca2008
