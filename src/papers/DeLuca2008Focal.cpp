#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "depthservo/depth/FocalLengthObserver.h"
#include "papers/DeLuca2008.h"
#include "papers/rungeKutta.h"

namespace depthservo::deluca2008 {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kFrameRate_Hz = 30;

using Vector3 = Eigen::Vector3d;
using Vector4 = Eigen::Vector4d;
using Vector7 = Eigen::Matrix<double, 7, 1>;

/// A point before a moving camera, and what is estimated of its focal length.
struct Experiment {
  double focal_px;
  Eigen::Vector2d start_px;
  double Z;
  std::function<Twist(double)> twist;
  FocalGains gains;
  double duration_s;

  Vector3 start() const { return {Z * start_px.x() / focal_px, Z * start_px.y() / focal_px, Z}; }
  Eigen::Vector2d image(const Vector3& P) const { return focal_px / P.z() * P.head<2>(); }
};

/// Section 5.2: pure rotation.
Experiment numericalExample(double k_3) {
  const auto twist = [](double t) {
    return Twist{{0, 0, 0}, {0.5 * std::cos(M_PI * t / 2), 0.3 * std::sin(M_PI * t), 0}};
  };
  return {128, {10, -10}, 1, twist, {50, k_3, 1}, 5};
}

constexpr double kLever_m = 0.07, kSide_m = 0.02;  // camera in the robot's frame

/// Section 7.1: the unicycle turns on the spot; its camera is not on the axis.
Experiment onUnicycle(double Z, double k_4 = 0.01) {
  const auto twist = [](double t) {
    const double turn = 6 * M_PI / 180 * std::cos(M_PI * t / 4);
    return Twist{{-kLever_m * turn, 0, -kSide_m * turn}, {0, -turn, 0}};
  };
  return {1096, {17, 132.99}, Z, twist, {30, 1500, k_4}, 60};
}

Vector3 pointRate(const Twist& u, const Vector3& P) { return -u.linear - u.angular.cross(P); }

/// The observer as a differential equation (eq. 19-24): d(y1, y2, lambda, 1/lambda)/dt.
Vector4 observerRate(const FocalGains& k, const Vector3& w, const Eigen::Vector2d& y,
                     const Vector4& h) {
  const double turning = y.y() * w.x() - y.x() * w.y();
  const Eigen::Vector2d c = turning * y, e = y - h.head<2>();
  return {-w.y() * h[2] + c.x() * h[3] + y.y() * w.z() + k.k * e.x(),
          w.x() * h[2] + c.y() * h[3] - y.x() * w.z() + k.k * e.y(),
          k.k_3 * (-w.y() * e.x() + w.x() * e.y()), k.k_4 * c.dot(e)};
}

struct Sample {
  double t = 0, focal_px = 0;
};
using Samples = std::vector<Sample>;

/// The differential equation along the point's own motion, steps of 1 ms.
Samples continuous(const Experiment& x) {
  Vector7 state;
  state << x.start(), x.start_px, 0, 0;
  const auto rate = [&](double t, const Vector7& s) -> Vector7 {
    const Twist u = x.twist(t);
    const Vector3 P = s.head<3>();
    Vector7 derivative;
    derivative << pointRate(u, P), observerRate(x.gains, u.angular, x.image(P), s.tail<4>());
    return derivative;
  };
  constexpr double h = 1e-3;
  Samples samples{{0, 0}};
  for (int i = 0; i < std::lround(x.duration_s / h); ++i) {
    state = rungeKutta(rate, i * h, state, h);
    samples.push_back({(i + 1) * h, state[5]});
  }
  return samples;
}

/// The image and the motion since the last one, as a camera gives them.
struct Frame {
  double t = 0;
  Twist twist;  ///< in the middle of the interval
  Eigen::Vector2d before, now;
};

/// Runs something on every frame; it gives lambda.
Samples sampled(const Experiment& x, const std::function<double(const Frame&)>& step) {
  constexpr double dt = 1 / kFrameRate_Hz;
  constexpr int kSteps = 33;
  const auto rate = [&](double t, const Vector3& P) { return pointRate(x.twist(t), P); };
  Samples samples{{0, 0}};
  Vector3 P = x.start();
  for (int i = 0; i < std::lround(x.duration_s * kFrameRate_Hz); ++i) {
    Frame frame{(i + 1) * dt, x.twist((i + 0.5) * dt), x.image(P), {}};
    for (int j = 0; j < kSteps; ++j) {
      P = rungeKutta(rate, (i + double(j) / kSteps) * dt, P, dt / kSteps);
    }
    frame.now = x.image(P);
    samples.push_back({frame.t, step(frame)});
    if (!(std::abs(samples.back().focal_px) < 1e6)) break;
  }
  return samples;
}

/// One step of Euler's method per image.
Samples euler(const Experiment& x) {
  Vector4 h(x.start_px.x(), x.start_px.y(), 0, 0);
  return sampled(x, [&](const Frame& frame) {
    const double dt = 1 / kFrameRate_Hz;
    h += dt * observerRate(x.gains, x.twist(frame.t - dt).angular, frame.before, h);
    return h[2];
  });
}

/// The library's observer.
Samples observed(const Experiment& x) {
  FocalLengthObserver::Options options;
  options.gains = x.gains;
  FocalLengthObserver observer(options);
  observer.reset({x.start_px.x(), x.start_px.y(), 0});
  return sampled(x, [&](const Frame& frame) {
    observer.predict(Motion::fromTwist(frame.twist, 1 / kFrameRate_Hz));
    observer.correct({frame.now.x(), frame.now.y(), 0});
    return observer.estimate().focal_px;
  });
}

bool diverges(const Samples& samples) { return !(std::abs(samples.back().focal_px) < 1e6); }

double focalAt(const Samples& samples, double t) {
  double focal_px = kNever;
  for (const Sample& s : samples) {
    if (s.t <= t + 1e-9) focal_px = s.focal_px;
  }
  return focal_px;
}

/// From when on the focal length is this close to a value.
double settled(const Samples& samples, double value_px, double limit_px) {
  double since = kNever;
  for (const Sample& s : samples) {
    if (!(std::abs(s.focal_px - value_px) < limit_px)) {
      since = kNever;
    } else if (since == kNever) {
      since = s.t;
    }
  }
  return since;
}

/// What the motion of the numerical example tells at an instant.
struct Excitation {
  double t = 0, eta1 = 0, eta2 = 0, sigma_min = 0;
};
std::vector<Excitation> excitations(const Experiment& x) {
  std::vector<Excitation> all;
  Vector3 P = x.start();
  const auto rate = [&](double t, const Vector3& p) { return pointRate(x.twist(t), p); };
  constexpr double h = 1e-3;
  for (int i = 0; i <= std::lround(x.duration_s / h); ++i) {
    const Vector3 w = x.twist(i * h).angular;
    const Eigen::Vector2d y = x.image(P);
    const double eta1 = y.x() * w.x() + y.y() * w.y(), eta2 = y.y() * w.x() - y.x() * w.y();
    Eigen::Matrix2d Omega;
    Omega << -w.y(), w.x(), y.x() * eta2, y.y() * eta2;
    all.push_back({i * h, eta1, eta2, Omega.jacobiSvd().singularValues()[1]});
    P = rungeKutta(rate, i * h, P, h);
  }
  return all;
}

void addNumericalExample(Measurements& measured) {
  const double focal_px = 128;
  const Samples printed = continuous(numericalExample(5000));
  for (const double limit_px : {10., 1.28, .1}) {
    measured.add(fmt::format("5.2/printed/below-{:g}", limit_px),
                 settled(printed, focal_px, limit_px));
  }
  for (const int k_3 : {500, 700}) {
    const Samples exact = continuous(numericalExample(k_3));
    const Samples ours = observed(numericalExample(k_3));
    bool isAhead = true;
    for (int s = 1; s <= 5; ++s) {
      const double error_px = focal_px - focalAt(exact, s);
      measured.add(fmt::format("5.2/k3-{}/at-{}s", k_3, s), error_px);
      isAhead = isAhead && std::abs(focal_px - focalAt(ours, s)) <= std::abs(error_px);
    }
    measured.add(fmt::format("5.2/k3-{}/observer-30Hz", k_3), isAhead);
  }
  measured.add("5.2/printed/euler-30Hz", diverges(euler(numericalExample(5000))));
  measured.add("5.2/printed/observer-30Hz",
               settled(observed(numericalExample(5000)), focal_px, 1.28) <= 0.51);

  const auto excited = excitations(numericalExample(500));
  for (const int s : {1, 3, 5}) {
    const Excitation& e = excited[static_cast<std::size_t>(1000 * s)];
    const bool isStill = std::abs(e.eta1) + std::abs(e.eta2) < 1e-9;
    measured.add(fmt::format("5.2/sigma-min/at-{}s", s), isStill ? e.sigma_min : kNever);
  }
  for (const int s : {2, 4}) {
    const auto from = excited.begin() + 1000 * (s - 1), to = from + 2000;
    const auto best = std::max_element(from, to, [](const Excitation& a, const Excitation& b) {
      return a.sigma_min < b.sigma_min;
    });
    measured.add(fmt::format("5.2/sigma-min/peak-{}s", s), best->t);
  }
}

void addUnicycle(Measurements& measured) {
  for (const int Z : {1, 2, 4, 20}) {
    const std::string id = fmt::format("7.1/bias/Z-{}", Z);
    const double ours_px = continuous(onUnicycle(Z)).back().focal_px;
    const double at30Hz_px = observed(onUnicycle(Z)).back().focal_px;
    measured.add(id, ours_px);
    measured.add(id + "/law", ours_px);
    measured.add(id + "/observer-30Hz", at30Hz_px);
    measured.add(id + "/compensated", compensatedFocal(at30Hz_px, kLever_m, Z));
  }
  const Samples exact = continuous(onUnicycle(2));
  for (const int s : {5, 10, 20}) measured.add(fmt::format("7.1/at-{}s", s), focalAt(exact, s));
  measured.add("7.1/settled", settled(exact, exact.back().focal_px, 11) <= 30);
  measured.add("7.1/euler-30Hz", diverges(euler(onUnicycle(2))));
  measured.add("7.1/euler-30Hz/small-k4", euler(onUnicycle(2, 1e-5)).back().focal_px);
}

Curve curve(const Samples& samples, const std::string& title) {
  Curve c = Curve::named(title);
  for (const Sample& s : samples) c.add(s.t, s.focal_px);
  return c;
}

Figure numericalFigure() {
  Figure figure;
  figure.name = "focal-length";
  figure.columns = 2;
  Panel focal = Panel::labelled("lambda, differential equation", "time [s]", "lambda [px]");
  Panel sampledFocal =
      Panel::labelled("lambda at 30 Hz, the library's observer", "time [s]", "lambda [px]");
  for (double k_3 : {5000., 700., 500.}) {
    const std::string title = fmt::format("k_3 = {:g}", k_3);
    focal.curves.push_back(curve(continuous(numericalExample(k_3)), title));
    sampledFocal.curves.push_back(curve(observed(numericalExample(k_3)), title));
  }
  for (Panel* panel : {&focal, &sampledFocal}) {
    panel->curves.push_back(Curve::level(128, 0, 5));
    panel->yRange = {0, 190};
  }
  Panel eta = Panel::labelled("eta1 and eta2: nothing is learnt where one stays 0", "time [s]",
                              "[px rad/s]");
  Panel sigma = Panel::labelled("least singular value of Omega", "time [s]", "sigma_min [rad/s]");
  Curve eta1 = Curve::named("eta1"), eta2 = Curve::named("eta2"), sigma_min;
  for (const Excitation& e : excitations(numericalExample(500))) {
    eta1.add(e.t, e.eta1);
    eta2.add(e.t, e.eta2);
    sigma_min.add(e.t, e.sigma_min);
  }
  eta.curves = {eta1, eta2};
  sigma.curves = {sigma_min};
  figure.panels = {focal, sampledFocal, eta, sigma};
  return figure;
}

Figure unicycleFigure() {
  Figure figure;
  figure.name = "focal-length-unicycle";
  figure.columns = 2;
  Panel focal =
      Panel::labelled("lambda at 30 Hz, the library's observer", "time [s]", "lambda [px]");
  Panel compensated = Panel::labelled("the same, lever arm compensated", "time [s]", "lambda [px]");
  Panel law = Panel::labelled("after a minute", "depth of the point [m]", "lambda [px]");
  Curve points = Curve::named("simulated", Curve::Style::points);
  Curve line = Curve::named("lambda (1 + rx/Z)");
  for (double Z : {1., 2., 4., 20.}) {
    const Samples samples = observed(onUnicycle(Z));
    focal.curves.push_back(curve(samples, fmt::format("Z = {:g} m", Z)));
    Samples divided = samples;
    for (Sample& s : divided) s.focal_px = compensatedFocal(s.focal_px, kLever_m, Z);
    compensated.curves.push_back(curve(divided, ""));
    points.add(Z, samples.back().focal_px);
  }
  for (double Z = 0.8; Z < 25; Z *= 1.05) line.add(Z, 1096 * (1 + kLever_m / Z));
  law.curves = {line, points, Curve::level(1096, 0.8, 25, "true")};
  law.logX = true;
  for (Panel* panel : {&focal, &compensated}) {
    panel->curves.push_back(Curve::level(1096, 0, 60));
    panel->yRange = {900, 1300};
  }
  Panel diverging = Panel::labelled("printed gains at 30 Hz, Z = 2 m", "time [s]", "lambda [px]");
  diverging.curves = {curve(observed(onUnicycle(2)), "the library's observer"),
                      curve(euler(onUnicycle(2)), "Euler's method"), Curve::level(1096, 0, 10)};
  diverging.xRange = {0, 10};
  diverging.yRange = {-3000, 3000};
  figure.panels = {focal, diverging, compensated, law};
  return figure;
}

}  // namespace

void addFocalExperiments(Experiments& r, const ReproduceOptions&) {
  addNumericalExample(r.measured);
  addUnicycle(r.measured);
  r.figures.push_back(numericalFigure());
  r.figures.push_back(unicycleFigure());
}

}  // namespace depthservo::deluca2008
