#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "papers/DeLuca2008.h"
#include "papers/rungeKutta.h"

namespace depthservo::deluca2008 {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kFocal_px = 128;
constexpr double kNever = std::numeric_limits<double>::infinity();

using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

double square(double a) { return a * a; }

/// The camera's motion in section 5.1.
Twist twistAt(double t) {
  return {{0.1 * std::cos(2 * kPi * t), 0, 0.5 * std::cos(kPi * t)},
          {0.6 * std::cos(kPi * t / 2), 0, 1}};
}

/// d(x, y, chi)/dt of a still point, and of the observer with drift and Omega at the measured
/// point.
struct Image {
  double x, y;
};
Eigen::Vector2d excitation(const Twist& u, Image p) {
  return {-u.linear.x() + p.x * u.linear.z(), -u.linear.y() + p.y * u.linear.z()};
}
Vector3 pointRate(const Twist& u, Image p, double chi) {
  const Eigen::Vector2d Omega = excitation(u, p);
  const Vector3& w = u.angular;
  return {Omega.x() * chi + p.x * p.y * w.x() - (1 + p.x * p.x) * w.y() + p.y * w.z(),
          Omega.y() * chi + (1 + p.y * p.y) * w.x() - p.x * p.y * w.y() - p.x * w.z(),
          chi * chi * u.linear.z() + chi * (p.y * w.x() - p.x * w.y())};
}

/// The observer as an ordinary differential equation (eq. 11-14), normalised.
struct Gains {
  double k = 20, k_3 = 0.5 * kFocal_px * kFocal_px;
};
Vector3 observerRate(const Gains& gains, const Twist& u, Image measured, const Vector3& estimate) {
  const Eigen::Vector2d e(measured.x - estimate.x(), measured.y - estimate.y());
  Vector3 rate = pointRate(u, measured, estimate.z());
  rate.head<2>() += gains.k * e;
  rate.z() += gains.k_3 * excitation(u, measured).dot(e);
  return rate;
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

  Gains gains() const { return {20 * gainScale, 0.5 * square(gainScale * kFocal_px)}; }

  /// A sample at 0 and after each image; stops when the estimate is beyond all sense.
  std::vector<Sample> run(Scheme scheme, double rate_Hz) const;
};

Image project(const Vector3& P) { return {P.x() / P.z(), P.y() / P.z()}; }

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
Vector3 continuousStep(const Gains& k, const Vector3& P, const Vector3& estimate, double t,
                       double dt) {
  Vector6 joint;
  joint << P, estimate;
  const auto rate = [&](double time, const Vector6& state) -> Vector6 {
    const Twist u = twistAt(time);
    const Vector3 p = state.head<3>();
    Vector6 derivative;
    derivative << Vector3(-u.linear - u.angular.cross(p)),
        observerRate(k, u, project(p), state.tail<3>());
    return derivative;
  };
  return rungeKutta(rate, t, joint, dt).tail<3>();
}

/// The differential equation with the image held.
Vector3 heldStep(const Gains& k, Image held, const Vector3& estimate, double t, double dt) {
  const int steps = std::max(1, static_cast<int>(std::lround(dt / 1e-3)));
  const auto rate = [&](double time, const Vector3& state) -> Vector3 {
    return observerRate(k, twistAt(time), held, state);
  };
  Vector3 next = estimate;
  for (int j = 0; j < steps; ++j) next = rungeKutta(rate, t + j * dt / steps, next, dt / steps);
  return next;
}

Vector3 flowStep(const Gains& k, Image now, const Vector3& estimate, double t, double dt) {
  const Twist u = twistAt(t + dt / 2);
  const PointState p =
      flow(Motion::fromTwist(u, dt), {estimate.x(), estimate.y(), estimate.z()}).point;
  const Eigen::Vector2d e(now.x - p.x, now.y - p.y);
  return {p.x + k.k * dt * e.x(), p.y + k.k * dt * e.y(),
          p.chi + k.k_3 * dt * excitation(u, now).dot(e)};
}

std::vector<Sample> Experiment::run(Scheme scheme, double rate_Hz) const {
  const Gains k = gains();
  const double dt = 1 / rate_Hz;
  const Image start{10 / kFocal_px, -10 / kFocal_px};
  Vector3 P = Vector3(start.x, start.y, 1) / chi;
  Vector3 estimate(start.x, start.y, guess_chi);
  NonlinearObserverOptions options;
  options.gains = {k.k, k.k_3, 0, 0};
  NonlinearDepthObserver observer(options);
  observer.reset({start.x, start.y, 0}, {1 / guess_chi});

  std::vector<Sample> samples{{0, {0, 0}, chi - guess_chi}};
  for (int i = 0; i < std::lround(duration_s * rate_Hz); ++i) {
    const double t = i * dt;
    const Vector3 P_before = P;
    P = move(P, t, dt);
    const Image before = project(P_before), now = project(P);
    switch (scheme) {
      case Scheme::continuous:
        estimate = continuousStep(k, P_before, estimate, t, dt);
        break;
      case Scheme::euler:
        estimate += dt * observerRate(k, twistAt(t), before, estimate);
        break;
      case Scheme::held:
        estimate = heldStep(k, before, estimate, t, dt);
        break;
      case Scheme::flowEuler:
        estimate = flowStep(k, now, estimate, t, dt);
        break;
      case Scheme::poleMatched: {
        observer.predict(Motion::fromTwist(twistAt(t + dt / 2), dt));
        observer.correct({now.x, now.y, 0});
        const DepthEstimate e = observer.estimate();
        estimate = {e.x, e.y, e.chi};
        break;
      }
    }
    samples.push_back({t + dt,
                       {kFocal_px * (now.x - estimate.x()), kFocal_px * (now.y - estimate.y())},
                       1 / P.z() - estimate.z()});
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

/// A time that may be never.
void addSettled(Rows& rows, const std::string& id, const std::string& claim, double expected_s,
                double ours_s, double frame_s) {
  if (expected_s == kNever) {
    rows.addTruth(id + "-never", claim + ": never", ours_s == kNever);
  } else {
    rows.addWithin(id, claim, expected_s, ours_s, "s", std::max(frame_s, 0.05 * expected_s));
  }
}

void continuousRows(Rows& rows) {
  struct Reading {
    const char *id, *name;
    Experiment experiment;
    double settled_s[3], at1s, e_px[2];
  };
  for (const Reading& r :
       {Reading{"chi", "chi(0) = 2, guess 1", {2, 1}, {1.10, 1.23, 1.87}, -.0254, {.68, .18}},
        Reading{"Z", "Z(0) = 2, guess 1", {.5, 1}, {1.05, 1.43, 1.86}, .0134, {.25, .07}}}) {
    const auto samples = r.experiment.run(Scheme::continuous, 1000);
    const double limits[] = {1e-2, 1e-3, 1e-4};
    for (int i = 0; i < 3; ++i) {
      addSettled(rows, fmt::format("5.1/{}/below-{:g}", r.id, limits[i]),
                 fmt::format("error of chi below {:g} after, {}", limits[i], r.name),
                 r.settled_s[i], settled(samples, limits[i]), 1e-3);
    }
    ReproduceRow& at1s = rows.addWithin(fmt::format("5.1/{}/at-1s", r.id),
                                        fmt::format("error of chi at 1 s, {}", r.name), r.at1s,
                                        errorAt(samples, 1), "1/m", 1e-4);
    at1s.paper = "practically zero after 1 s";
    at1s.note = "1 to 3 % of chi is left; which of the two readings is meant is not legible";
    for (int i = 0; i < 2; ++i) {
      rows.addWithin(fmt::format("5.1/{}/e{}", r.id, i + 1),
                     fmt::format("largest image error |e{}|, {}", i + 1, r.name), r.e_px[i],
                     largest(samples, i), "px", 0.01);
    }
  }
  Vector3 P = Vector3(10 / kFocal_px, -10 / kFocal_px, 1) / 2;
  double extent = 0;
  for (int i = 0; i < 4000; ++i) {
    extent = std::max({extent, std::abs(project(P).x), std::abs(project(P).y)});
    P = move(P, i * 1e-3, 1e-3);
  }
  rows.addWithin("5.1/extent", "largest image coordinate of the point, chi(0) = 2", 176,
                 kFocal_px * extent, "px", 1)
      .note = "it leaves the view of a camera of 320 px";
}

struct SchemeRow {
  Scheme scheme;
  double rate_Hz, below[2], at1s, at4s, lastDigit1s, lastDigit4s;
};
constexpr double kUnstated = std::numeric_limits<double>::quiet_NaN();

const char* idOf(Scheme scheme) {
  constexpr const char* ids[] = {"continuous", "euler", "held", "flow-euler", "pole-matched"};
  return ids[static_cast<int>(scheme)];
}
const char* nameOf(Scheme scheme) {
  constexpr const char* names[] = {"continuous", "Euler's method", "image held between frames",
                                   "exact flow, Euler correction", "exact flow, matched poles"};
  return names[static_cast<int>(scheme)];
}

void schemeRows(Rows& rows) {
  using S = Scheme;
  for (const SchemeRow& r : {
           SchemeRow{S::euler, 30, {kNever, kNever}, kUnstated, kNever, 0, 0},
           SchemeRow{S::euler, 60, {kNever, kNever}, -.045, -.34, 1e-3, 1e-2},
           SchemeRow{S::euler, 100, {kNever, kNever}, -.039, -.068, 1e-3, 1e-3},
           SchemeRow{S::euler, 1000, {3.82, kNever}, -.027, -.0078, 1e-3, 1e-4},
           SchemeRow{S::held, 30, {kNever, kNever}, .091, 1.37, 1e-3, 1e-2},
           SchemeRow{S::held, 60, {kNever, kNever}, .018, .37, 1e-3, 1e-2},
           SchemeRow{S::held, 100, {kNever, kNever}, -.003, .15, 1e-3, 1e-2},
           SchemeRow{S::flowEuler, 30, {.93, kNever}, -.003, .0024, 1e-3, 1e-4},
           SchemeRow{S::flowEuler, 60, {1.05, 2.62}, -.012, 5e-4, 1e-3, 1e-4},
           SchemeRow{S::flowEuler, 100, {1.07, 1.20}, -.016, 2e-4, 1e-3, 1e-4},
           SchemeRow{S::flowEuler, 1000, {1.088, 1.365}, -.020, 2e-6, 1e-3, 1e-6},
           SchemeRow{S::poleMatched, 30, {1.07, kNever}, -.018, .0023, 1e-3, 1e-4},
           SchemeRow{S::poleMatched, 60, {1.08, 2.62}, -.020, 6e-4, 1e-3, 1e-4},
           SchemeRow{S::poleMatched, 100, {1.09, 1.25}, -.021, 2e-4, 1e-3, 1e-4},
           SchemeRow{S::poleMatched, 1000, {1.09, 1.411}, -.021, 2e-6, 1e-3, 1e-6},
       }) {
    const auto samples = Experiment{}.run(r.scheme, r.rate_Hz);
    const std::string id = fmt::format("5.1/{}-{}Hz", idOf(r.scheme), r.rate_Hz);
    const std::string at = fmt::format("{}, {} Hz", nameOf(r.scheme), r.rate_Hz);
    if (r.at4s == kNever) {
      rows.addTruth(id + "/diverges", "the estimate diverges, " + at, errorAt(samples, 4) == kNever)
          .note = "as printed, with the paper's gains, at the frame rate of a camera";
      continue;
    }
    const double limits[] = {1e-2, 1e-3};
    for (int i = 0; i < 2; ++i) {
      addSettled(rows, fmt::format("{}/below-{:g}", id, limits[i]),
                 fmt::format("error of chi below {:g} after, {}", limits[i], at), r.below[i],
                 settled(samples, limits[i]), 1 / r.rate_Hz);
    }
    rows.addWithin(id + "/at-1s", "error of chi at 1 s, " + at, r.at1s, errorAt(samples, 1), "1/m",
                   r.lastDigit1s);
    rows.addWithin(id + "/at-4s", "error of chi at 4 s, " + at, r.at4s, errorAt(samples, 4), "1/m",
                   r.lastDigit4s);
  }
}

void gainRows(Rows& rows) {
  const auto worst = [](Scheme scheme, double gainScale) {
    Experiment experiment;
    experiment.gainScale = gainScale;
    return std::abs(errorAt(experiment.run(scheme, 30), 4));
  };
  rows.addTruth("5.1/gains/euler", "half the gains, 30 Hz: Euler's method still off after 4 s",
                worst(Scheme::euler, 0.5) > 0.05);
  rows.addTruth("5.1/gains/flow-euler",
                "1.5 times the gains, 30 Hz: exact flow with Euler correction fails",
                worst(Scheme::flowEuler, 1.5) > 0.05);
  double error = 0;
  for (double scale : {.5, 1., 1.5, 3., 10.}) {
    error = std::max(error, worst(Scheme::poleMatched, scale));
  }
  rows.addTruth("5.1/gains/pole-matched",
                "0.5 to 10 times the gains, 30 Hz: matched poles stay below 0.006 after 4 s",
                error < 0.006);
}

Figure depthFigure() {
  Figure figure;
  figure.name = "depth-error";
  figure.title = "Depth of a point, section 5.1: how the observer is sampled decides";
  figure.caption =
      "Error of the inverse depth, true minus estimated, from chi(0) = 2 with the guess 1. Above: "
      "the observer as a differential equation, and the paper's two image errors. Below: at the 30 "
      "images per second of a camera, Euler's method diverges with the paper's own gains; holding "
      "the image between frames ends in a wrong depth; the exact flow follows the differential "
      "equation.";
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
  for (int i = 0; i < 4; ++i) add(Experiment{}.run(schemes[i], 30), nameOf(schemes[i]), i);
  figure.panels = {error, image, sampled, magnitude};
  return figure;
}

}  // namespace

void addDepthExperiments(Rows& rows, std::vector<Figure>& figures, const ReproduceOptions&) {
  continuousRows(rows);
  schemeRows(rows);
  gainRows(rows);
  figures.push_back(depthFigure());
}

}  // namespace depthservo::deluca2008
