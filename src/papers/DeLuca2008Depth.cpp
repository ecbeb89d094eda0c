#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "papers/DeLuca2008.h"
#include "depth/EulerObserver.h"
#include "papers/rungeKutta.h"

namespace depthservo::deluca2008 {
namespace {

constexpr double kFocal_px = 128;
constexpr double kNever = std::numeric_limits<double>::infinity();

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

double square(double a) { return a * a; }

/// The camera's motion in section 5.1.
Twist twistAt(double t) {
  return {{0.1 * std::cos(2 * M_PI * t), 0, 0.5 * std::cos(M_PI * t)},
          {0.6 * std::cos(M_PI * t / 2), 0, 1}};
}

/// How the observer is computed.
enum class Scheme {
  continuous,   ///< the differential equation with the point as it moves, 1 kHz
  euler,        ///< the differential equation, one step per image
  held,         ///< the differential equation at 1 kHz or finer, the image held between frames
  flowEuler,    ///< exact flow, then k dt e and k_3 dt Omega.e
  poleMatched,  ///< exact flow and matched poles: the library's observer
};

struct Sample {
  double t = 0;
  Eigen::Vector2d e = Eigen::Vector2d::Zero();  ///< measured minus estimated [px]
  double error = 0;                             ///< true minus estimated chi [1/m]
};

struct Experiment {
  double chi = 2, guess_chi = 1, gainScale = 1, duration_s = 4;

  ObserverGains gains() const {
    return {20 * gainScale, 0.5 * square(gainScale * kFocal_px), 0, 0};
  }

  /// A sample at 0 and after each image; stops when the estimate is numerically invalid.
  std::vector<Sample> run(Scheme scheme, double rate_Hz) const;
};

Vector2 project(const Vector3& P) { return P.head<2>() / P.z(); }

Vector3 move(const Vector3& P, double t, double dt) {
  const int steps = std::max(1, static_cast<int>(std::ceil(dt / 1e-3 - 1e-9)));
  Vector3 moved = P;
  const auto rate = [](double time, const Vector3& p) -> Vector3 {
    const Twist u = twistAt(time);
    return -u.linear - u.angular.cross(p);
  };
  for (int i = 0; i < steps; ++i) moved = rungeKutta(rate, t + i * dt / steps, moved, dt / steps);
  return moved;
}

/// The differential equation with the point as it moves.
Vector3 continuousStep(const ObserverGains& k, const Vector3& P, const Vector3& estimate, double t,
                       double dt) {
  Vector6d joint;
  joint << P, estimate;
  const auto rate = [&](double time, const Vector6d& state) -> Vector6d {
    const Twist u = twistAt(time);
    const Vector3 p = state.head<3>();
    Vector6d derivative;
    derivative << Vector3(-u.linear - u.angular.cross(p)),
        EulerObserver::rate(k, u, project(p), state.tail<3>());
    return derivative;
  };
  return rungeKutta(rate, t, joint, dt).tail<3>();
}

/// The differential equation with the image held.
Vector3 heldStep(const ObserverGains& k, const Vector2& held, const Vector3& estimate, double t,
                 double dt) {
  const int steps = std::max(1, static_cast<int>(std::lround(dt / 1e-3)));
  const auto rate = [&](double time, const Vector3& state) -> Vector3 {
    return EulerObserver::rate(k, twistAt(time), held, state);
  };
  Vector3 next = estimate;
  for (int j = 0; j < steps; ++j) next = rungeKutta(rate, t + j * dt / steps, next, dt / steps);
  return next;
}

Vector3 flowStep(const ObserverGains& k, const Vector2& now, const Vector3& estimate, double t,
                 double dt) {
  const Twist u = twistAt(t + dt / 2);
  const PointState p =
      flow(Motion::fromTwist(u, dt), {estimate.x(), estimate.y(), estimate.z()}).point;
  const Vector2 e = now - Vector2(p.x, p.y);
  return {p.x + k.k * dt * e.x(), p.y + k.k * dt * e.y(),
          p.chi + k.k_3 * dt * EulerObserver::Omega(u, now).dot(e)};
}

std::vector<Sample> Experiment::run(Scheme scheme, double rate_Hz) const {
  const ObserverGains k = gains();
  const double dt = 1 / rate_Hz;
  const Vector2 start(10 / kFocal_px, -10 / kFocal_px);
  Vector3 P = start.homogeneous() / chi;
  Vector3 estimate(start.x(), start.y(), guess_chi);
  NonlinearObserverOptions options;
  options.gains = k;
  NonlinearDepthObserver observer(options);
  observer.reset({start.x(), start.y(), 0}, {1 / guess_chi});

  std::vector<Sample> samples{{0, {0, 0}, chi - guess_chi}};
  for (int i = 0; i < std::lround(duration_s * rate_Hz); ++i) {
    const double t = i * dt;
    const Vector3 P_before = P;
    P = move(P, t, dt);
    const Vector2 before = project(P_before), now = project(P);
    switch (scheme) {
      case Scheme::continuous:
        estimate = continuousStep(k, P_before, estimate, t, dt);
        break;
      case Scheme::euler:
        estimate += dt * EulerObserver::rate(k, twistAt(t), before, estimate);
        break;
      case Scheme::held:
        estimate = heldStep(k, before, estimate, t, dt);
        break;
      case Scheme::flowEuler:
        estimate = flowStep(k, now, estimate, t, dt);
        break;
      case Scheme::poleMatched: {
        observer.predict(Motion::fromTwist(twistAt(t + dt / 2), dt));
        observer.correct({now.x(), now.y(), 0});
        const DepthEstimate e = observer.estimate();
        estimate = {e.x, e.y, e.chi};
        break;
      }
    }
    samples.push_back({t + dt, kFocal_px * (now - estimate.head<2>()), 1 / P.z() - estimate.z()});
    if (!(std::abs(samples.back().error) < 1e3)) break;
  }
  return samples;
}

/// From when on the error stays below the limit; never: infinite.
double settled(const std::vector<Sample>& samples, double limit) {
  double since = kNever;
  for (const Sample& s : samples) {
    if (!(std::abs(s.error) < limit)) {
      since = kNever;
    } else if (since == kNever) {
      since = s.t;
    }
  }
  return since;
}

double errorAt(const std::vector<Sample>& samples, double t) {
  double error = kNever;
  for (const Sample& s : samples) {
    if (s.t <= t + 1e-9) error = s.error;
  }
  return samples.back().t < t - 1e-9 ? kNever : error;
}

double largest(const std::vector<Sample>& samples, int axis) {
  double largest = 0;
  for (const Sample& s : samples) largest = std::max(largest, std::abs(s.e[axis]));
  return largest;
}

/// When the error stays below the limits, and whether it never does.
void addSettled(Measurements& measured, const std::string& id, const std::vector<Sample>& samples,
                std::initializer_list<double> limits) {
  for (const double limit : limits) {
    const double since = settled(samples, limit);
    const std::string below = fmt::format("{}/below-{:g}", id, limit);
    measured.add(below, since);
    measured.add(below + "-never", since == kNever);
  }
}

void addContinuous(Measurements& measured) {
  const std::pair<const char*, Experiment> readings[] = {{"5.1/chi", {2, 1}}, {"5.1/Z", {.5, 1}}};
  for (const auto& [id, experiment] : readings) {
    const auto samples = experiment.run(Scheme::continuous, 1000);
    addSettled(measured, id, samples, {1e-2, 1e-3, 1e-4});
    measured.add(fmt::format("{}/at-1s", id), errorAt(samples, 1));
    for (int i = 0; i < 2; ++i) measured.add(fmt::format("{}/e{}", id, i + 1), largest(samples, i));
  }
  Vector3 P = Vector3(10 / kFocal_px, -10 / kFocal_px, 1) / 2;
  double extent = 0;
  for (int i = 0; i < 4000; ++i) {
    extent = std::max(extent, project(P).cwiseAbs().maxCoeff());
    P = move(P, i * 1e-3, 1e-3);
  }
  measured.add("5.1/extent", kFocal_px * extent);
}

constexpr const char* kSchemeIds[] = {"continuous", "euler", "held", "flow-euler", "pole-matched"};
constexpr const char* kSchemeNames[] = {"continuous", "Euler's method", "image held between frames",
                                        "exact flow, Euler correction",
                                        "exact flow, matched poles"};

void addSchemes(Measurements& measured) {
  for (const Scheme scheme :
       {Scheme::euler, Scheme::held, Scheme::flowEuler, Scheme::poleMatched}) {
    for (const int rate_Hz : {30, 60, 100, 1000}) {
      const auto samples = Experiment{}.run(scheme, rate_Hz);
      const std::string id =
          fmt::format("5.1/{}-{}Hz", kSchemeIds[static_cast<int>(scheme)], rate_Hz);
      addSettled(measured, id, samples, {1e-2, 1e-3});
      measured.add(id + "/at-1s", errorAt(samples, 1));
      measured.add(id + "/at-4s", errorAt(samples, 4));
      measured.add(id + "/diverges", errorAt(samples, 4) == kNever);
    }
  }
}

void addGains(Measurements& measured) {
  const auto worst = [](Scheme scheme, double gainScale) {
    Experiment experiment;
    experiment.gainScale = gainScale;
    return std::abs(errorAt(experiment.run(scheme, 30), 4));
  };
  measured.add("5.1/gains/euler", worst(Scheme::euler, 0.5) > 0.05);
  measured.add("5.1/gains/flow-euler", worst(Scheme::flowEuler, 1.5) > 0.05);
  double error = 0;
  for (double scale : {.5, 1., 1.5, 3., 10.}) {
    error = std::max(error, worst(Scheme::poleMatched, scale));
  }
  measured.add("5.1/gains/pole-matched", error < 0.006);
}

Figure depthFigure() {
  Figure figure;
  figure.name = "depth-error";
  figure.columns = 2;
  const auto curve = [](const std::vector<Sample>& samples, const std::string& title,
                        const auto& value) {
    Curve c = Curve::named(title);
    for (const Sample& s : samples) c.add(s.t, value(s));
    return c;
  };
  const auto chi = [](const Sample& s) { return s.error; };
  const auto continuous = Experiment{}.run(Scheme::continuous, 1000);
  const auto other = Experiment{.5, 1}.run(Scheme::continuous, 1000);

  Panel error =
      Panel::labelled("error of chi, continuous observer", "time [s]", "chi - estimate [1/m]");
  error.curves.push_back(curve(continuous, "chi(0) = 2, guess 1", chi));
  error.curves.push_back(curve(other, "Z(0) = 2 m, guess 1", chi));
  Panel image = Panel::labelled("error in the image, continuous observer", "time [s]", "e [px]");
  image.curves.push_back(curve(continuous, "e1", [](const Sample& s) { return s.e.x(); }));
  image.curves.push_back(curve(continuous, "e2", [](const Sample& s) { return s.e.y(); }));

  Panel sampled = Panel::labelled("error of chi at 30 Hz", "time [s]", "chi - estimate [1/m]");
  sampled.yRange = {-1.5, 3};
  Panel magnitude = Panel::labelled("the same, magnitude", "time [s]", "|chi - estimate| [1/m]");
  magnitude.logY = true;
  magnitude.yRange = {1e-4, 10};
  const auto add = [&](const std::vector<Sample>& samples, const std::string& title, int colour) {
    for (Panel* panel : {&sampled, &magnitude}) {
      const bool isMagnitude = panel == &magnitude;
      Curve c = curve(samples, isMagnitude ? "" : title,
                      [&](const Sample& s) { return isMagnitude ? std::abs(s.error) : s.error; });
      c.colour = colour;
      panel->curves.push_back(std::move(c));
    }
  };
  add(continuous, "continuous", Curve::kBlack);
  const Scheme schemes[] = {Scheme::poleMatched, Scheme::flowEuler, Scheme::held, Scheme::euler};
  for (int i = 0; i < 4; ++i)
    add(Experiment{}.run(schemes[i], 30), kSchemeNames[static_cast<int>(schemes[i])], i);
  figure.panels = {error, image, sampled, magnitude};
  return figure;
}

}  // namespace

void addDepthExperiments(Experiments& r, const ReproduceOptions&) {
  addContinuous(r.measured);
  addSchemes(r.measured);
  addGains(r.measured);
  r.figures.push_back(depthFigure());
}

}  // namespace depthservo::deluca2008
