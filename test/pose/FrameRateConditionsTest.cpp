#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "depthservo/pose/FrameRateConditions.h"
#include "depthservo/pose/PoseRegulation.h"
#include "depthservo/pose/VisualMotionObserver.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

const double kRoot2 = std::sqrt(2.0), kRoot5 = std::sqrt(5.0), kC = 3 - kRoot5;

/// Time at which y' = f(y) from 0 reaches the limit: Runge-Kutta over y, dt/dy = 1/f(y).
double timeToReach(double limit, const std::function<double(double)>& f) {
  const int steps = 2000;
  const double h = limit / steps;
  double t = 0;
  for (int i = 0; i < steps; ++i) {
    const double y = i * h;
    t += h / 6 * (1 / f(y) + 4 / f(y + h / 2) + 1 / f(y + h));
  }
  return t;
}

double largestSingularValue(double p, double q, double r, double s) {
  Eigen::Matrix2d M;
  M << p, q, r, s;
  return M.jacobiSvd().singularValues()(0);
}

TEST(FrameRateConditions, haveTheValuesOfThePapersSimulation) {
  SampledGains g{6.5, 1.7, .95, .83, kRoot2, 35.29289};
  const ObserverConditions o = observerConditions(g), oSharp = observerConditions(g, Norms::sharp);
  EXPECT_NEAR(o.eq7, 6.9789, 1e-4);
  EXPECT_NEAR(o.eq17a, 38.6674, 1e-4);
  EXPECT_NEAR(o.eq17b, 14.3753, 1e-4);
  EXPECT_NEAR(o.eq16, 2.4740, 1e-4);
  EXPECT_NEAR(o.required_fps, 38.6674, 1e-4);
  EXPECT_NEAR(o.true_limit_fps, .85, 1e-12);
  EXPECT_NEAR(oSharp.eq7, 4.5737, 1e-4);
  EXPECT_NEAR(oSharp.eq17a, 26.8806, 1e-4);
  EXPECT_NEAR(oSharp.eq17b, 9.6951, 1e-4);
  g.U0 = 35.41789;
  const RegulationConditions r = regulationConditions(g),
                             rSharp = regulationConditions(g, Norms::sharp);
  EXPECT_NEAR(*r.eq23, 30.3903, 1e-4);
  EXPECT_NEAR(r.eq28a, 59.6042, 1e-4);
  EXPECT_NEAR(r.eq28b, 55.7196, 1e-4);
  EXPECT_NEAR(r.eq27, 7.8168, 1e-4);
  EXPECT_NEAR(r.required_fps, 59.6042, 1e-4);
  EXPECT_NEAR(r.true_limit_fps, .7040, 1e-4);
  EXPECT_TRUE(r.satisfiedAt(60));
  EXPECT_FALSE(r.satisfiedAt(59));
  EXPECT_NEAR(*rSharp.eq23, 22.0714, 1e-4);
  EXPECT_NEAR(rSharp.eq28a, 44.7738, 1e-4);
  EXPECT_NEAR(rSharp.eq28b, 41.7653, 1e-4);
}

TEST(FrameRateConditions, showThatThePapersExperimentIsBelowThem) {
  const SampledGains g{2, 1.4, .9, .83, .4, 0};
  EXPECT_NEAR(observerConditions(g).eq7, 5.9111, 1e-4);
  EXPECT_NEAR(*regulationConditions(g).eq23, 23.5503, 1e-4);
  EXPECT_NEAR(*regulationConditions(g, Norms::sharp).eq23, 17.239, 1e-3);
  EXPECT_NEAR(regulationConditions(g).true_limit_fps, .4956, 1e-4);
  EXPECT_FALSE(regulationConditions(g).satisfiedAt(18));
}

/// Each condition is the time in which the change since the last frame, at the rate the proof
/// allows it, uses up its margin.
TEST(FrameRateConditions, areTheTimesOfTheProofsDifferentialInequalities) {
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const double ke = std::exp(random.uniform(-2, 3)), kc = ke * std::exp(random.uniform(0, 3));
    const double delta = random.uniform(.05, .99), gamma = std::exp(random.uniform(-3, 2));
    const double kappa = random.integer(0, 9) == 0 ? 0 : std::exp(random.uniform(-3, 1));
    const double U0 = std::exp(random.uniform(-3, 4));
    const SampledGains g{kc, ke, delta, gamma, kappa, U0};
    SCOPED_TRACE(i);
    const auto expectRate = [](double rate, double margin,
                               const std::function<double(double)>& growth) {
      EXPECT_NEAR(rate * timeToReach(margin, growth), 1, 1e-6);
    };
    const double small = kRoot2 * (ke * gamma + kappa) / (ke * delta);
    const double mu = 2 * (kRoot2 * ke * gamma + kappa) / (kC * ke * delta);
    const double chi = kC * delta / (2 * kRoot2);

    const ObserverConditions o = observerConditions(g);
    expectRate(o.eq7, delta, [&](double y) { return 2 * ke * (1 + y) * (1 + y); });
    expectRate(o.eq17a, gamma,
               [&](double y) { return ke * (y + 2 * std::sqrt(2 * U0)) + 2 * kappa; });
    expectRate(o.eq17b, gamma, [&](double y) { return ke * (y + 2 * small) + 2 * kappa; });
    const ObserverConditions oSharp = observerConditions(g, Norms::sharp);
    expectRate(oSharp.eq7, delta, [&](double y) { return ke * (1 + y) * (kRoot2 + y); });
    expectRate(oSharp.eq17a, gamma, [&](double y) { return ke * (y + 2 * std::sqrt(U0)) + kappa; });
    expectRate(oSharp.eq17b, gamma, [&](double y) { return ke * (y + kRoot2 * small) + kappa; });

    const RegulationConditions r = regulationConditions(g);
    const double S = kc + 4 * ke + std::sqrt(kc * kc + 4 * ke * ke);
    expectRate(*r.eq23, chi,
               [&](double y) { return 2 * kRoot2 * ke * y * y + S * y + std::sqrt(10.0) * ke; });
    expectRate(r.eq28a, gamma,
               [&](double y) { return 2 * (ke * (y + std::sqrt(5 * U0)) + kappa); });
    expectRate(r.eq28b, gamma, [&](double y) { return 2 * (ke * (y + kRoot5 * mu) + kappa); });
    const RegulationConditions rSharp = regulationConditions(g, Norms::sharp);
    const double lambda =
        std::max(largestSingularValue(std::hypot(kc + ke, kc), ke, ke, kRoot5 * ke),
                 largestSingularValue(kc + ke, ke, ke, ke));
    expectRate(*rSharp.eq23, chi, [&](double y) {
      return kRoot2 * ke * y * y + (lambda + ke) * y + std::sqrt(6.0) * ke;
    });
    expectRate(rSharp.eq28a, gamma,
               [&](double y) { return ke * (y + std::sqrt(12 * U0)) + kappa; });
    expectRate(rSharp.eq28b, gamma,
               [&](double y) { return ke * (y + std::sqrt(12.0) * mu) + kappa; });
  }
}

/// The linear loop, frame by frame with small steps in between, on one axis.
double growthOverFrames(double kc, double ke, double T, int frames) {
  double e_c = 1, e_e = -.5;
  for (int i = 0; i < frames; ++i) {
    const double held = e_e;
    const int steps = 400;
    const double h = T / steps;
    for (int k = 0; k < steps; ++k) {  // midpoint rule
      const auto u = [&](double c) { return ke * (held - c); };
      const double half = e_c + h / 2 * (-kc * e_c + u(e_c));
      e_e -= h * u(half);
      e_c += h * (-kc * half + u(half));
    }
  }
  return std::hypot(e_c, e_e);
}

TEST(FrameRateConditions, trueLimitIsWhereTheLinearLoopStartsToGrow) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const double ke = std::exp(random.uniform(-1, 2)), kc = ke * std::exp(random.uniform(-2, 3));
    const double limit = regulationConditions({kc, ke, .9, 1, 1, 1}).true_limit_fps;
    EXPECT_LT(growthOverFrames(kc, ke, 1 / (1.02 * limit), 600), 1) << kc << " " << ke;
    EXPECT_GT(growthOverFrames(kc, ke, 1 / (.98 * limit), 600), 10) << kc << " " << ke;
    EXPECT_LT(growthOverFrames(kc, ke, 1 / (3 * limit), 600), 1e-3) << "no second limit above";
  }
}

TEST(FrameRateConditions, nothingIsProvedBelowTheObserverGain) {
  const RegulationConditions r = regulationConditions({1, 2, .9, 1, .1, 1});
  EXPECT_FALSE(r.eq23);
  EXPECT_FALSE(r.satisfiedAt(1e9));
  EXPECT_TRUE(std::isfinite(r.required_fps) && std::isfinite(r.eq28a) && std::isfinite(r.eq28b));
}

TEST(FrameRateConditions, refuseParametersOutOfRange) {
  const SampledGains good{2, 1.4, .9, .83, .4, 1};
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto expectRefused = [&](double SampledGains::*field, std::initializer_list<double> bad) {
    for (const double value : bad) {
      SampledGains g = good;
      g.*field = value;
      EXPECT_THROW(regulationConditions(g), std::invalid_argument) << value;
      if (field != &SampledGains::kc) {
        EXPECT_THROW(observerConditions(g), std::invalid_argument) << value;
      }
    }
  };
  expectRefused(&SampledGains::kc, {0, -1, nan, inf});
  expectRefused(&SampledGains::ke, {0, -1, nan, inf});
  expectRefused(&SampledGains::delta, {0, 1, -1, nan, inf});
  expectRefused(&SampledGains::gamma, {0, -1, nan, inf});
  expectRefused(&SampledGains::kappa, {-1, nan, inf});
  expectRefused(&SampledGains::U0, {-1, nan, inf});
  EXPECT_THROW(designObserver(0, 1), std::invalid_argument);
  EXPECT_THROW(designRegulation(nan, 1), std::invalid_argument);
  EXPECT_THROW(designRegulation(30, 1, 1), std::invalid_argument);
  EXPECT_THROW(likelyObserverGain(30, 0, 1), std::invalid_argument);
}

TEST(FrameRateCheck, agreesWithTheConditionsAtTheBestGamma) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const double fps = std::exp(random.uniform(0, 5)), kappa = std::exp(random.uniform(-3, 1));
    const GainDesign observer = designObserver(fps, kappa);
    const FrameRateCheck o = checkFrameRate(fps, observer.gains.ke, kappa);
    EXPECT_NEAR(o.bound, observer.bound, 1e-9 * observer.bound);
    EXPECT_EQ(o.verdict, FrameRateVerdict::guaranteed);
    const GainDesign regulation = designRegulation(fps, kappa);
    const FrameRateCheck r =
        checkFrameRate(fps, regulation.gains.ke, kappa, .95, regulation.gains.kc);
    EXPECT_NEAR(r.bound, regulation.bound, 1e-9 * regulation.bound);
    EXPECT_EQ(r.verdict, FrameRateVerdict::guaranteed);
    EXPECT_NEAR(r.true_limit_fps, regulationConditions(regulation.gains).true_limit_fps, 1e-12);
  }
}

TEST(FrameRateCheck, saysWhereEachGuaranteeEnds) {
  const double ke = 1.7, kc = 6.5, kInf = std::numeric_limits<double>::infinity();
  const auto verdictAt = [&](double fps, std::optional<double> coupled = {}) {
    return checkFrameRate(fps, ke, 0, .95, coupled).verdict;
  };
  EXPECT_EQ(verdictAt(6.98), FrameRateVerdict::guaranteed);
  EXPECT_EQ(verdictAt(6.97), FrameRateVerdict::likely);
  EXPECT_EQ(verdictAt(.86), FrameRateVerdict::likely);
  EXPECT_EQ(verdictAt(.85), FrameRateVerdict::tooSlow);
  EXPECT_EQ(verdictAt(30.4, kc), FrameRateVerdict::guaranteed);
  EXPECT_EQ(verdictAt(30.3, kc), FrameRateVerdict::likely);
  EXPECT_EQ(verdictAt(.705, kc), FrameRateVerdict::likely);
  EXPECT_EQ(verdictAt(.703, kc), FrameRateVerdict::tooSlow);
  EXPECT_EQ(verdictAt(1e6, 1.), FrameRateVerdict::likely) << "nothing is proved for kc < ke";
  EXPECT_EQ(verdictAt(kInf), FrameRateVerdict::guaranteed);
  EXPECT_EQ(checkFrameRate(60, ke, 0).bound, 0) << "a still target";
  EXPECT_TRUE(std::isinf(checkFrameRate(6.9, ke, 0).bound));
  EXPECT_THROW(checkFrameRate(0, ke, 0), std::invalid_argument);
  EXPECT_THROW(checkFrameRate(std::nan(""), ke, 0), std::invalid_argument);
  EXPECT_THROW(checkFrameRate(30, -1, 0), std::invalid_argument);
  EXPECT_THROW(checkFrameRate(30, ke, -1), std::invalid_argument);
}

TEST(GainDesign, meetsItsConditionsWithNothingToSpare) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const double fps = std::exp(random.uniform(1, 6)), kappa = std::exp(random.uniform(-4, 1));
    const double delta = random.uniform(.5, .99), U0 = std::exp(random.uniform(-3, 4));
    SCOPED_TRACE(i);
    SampledGains g = designObserver(fps, kappa, delta, U0).gains;
    const ObserverConditions o = observerConditions(g);
    EXPECT_NEAR(std::max(o.eq17a, o.eq17b), fps, 1e-6 * fps);
    g = designRegulation(fps, kappa, delta, U0).gains;
    const RegulationConditions r = regulationConditions(g);
    EXPECT_NEAR(std::max(r.eq28a, r.eq28b), fps, 1e-6 * fps);
    EXPECT_NEAR(*r.eq23, fps, 1e-6 * fps);
    EXPECT_GE(g.kc, g.ke);
    g = designRegulation(fps, kappa, delta).gains;
    EXPECT_NEAR(regulationConditions(g).eq28b, fps, 1e-6 * fps);
  }
}

TEST(GainDesign, hasNoBetterNeighbour) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    const double fps = std::exp(random.uniform(1, 6)), kappa = std::exp(random.uniform(-4, 1));
    const GainDesign o = designObserver(fps, kappa), r = designRegulation(fps, kappa);
    for (const double factor : {.7, .9, .99, 1.01, 1.1}) {
      // The smallest gamma that the condition allows at another ke, by bisection.
      const auto boundAt = [&](const SampledGains& best, auto rate, auto bound) {
        SampledGains g = best;
        g.ke *= factor;
        g.kc = std::max(g.kc, g.ke);
        double low = 1e-12, high = 1e12;
        for (int k = 0; k < 200; ++k) {
          g.gamma = std::sqrt(low * high);
          (rate(g) > fps ? low : high) = g.gamma;
        }
        return bound(g);
      };
      EXPECT_GE(boundAt(
                    o.gains, [](const auto& g) { return observerConditions(g).eq17b; },
                    [](const auto& g) { return observerConditions(g).eq16; }),
                o.bound * (1 - 1e-9));
      EXPECT_GE(boundAt(
                    r.gains, [](const auto& g) { return regulationConditions(g).eq28b; },
                    [](const auto& g) { return regulationConditions(g).eq27; }),
                r.bound * (1 - 1e-9));
    }
  }
}

TEST(GainDesign, isThatOfThePaperAt60Frames) {
  const GainDesign best = designRegulation(60, kRoot2);
  EXPECT_NEAR(best.gains.ke, 1.590, 1e-3);
  EXPECT_NEAR(best.gains.gamma, .6597, 1e-3);
  EXPECT_NEAR(best.bound, 7.1020, 1e-4);
  EXPECT_NEAR(best.gains.kc, 54.57, .02);
  const GainDesign started = designRegulation(60, kRoot2, .95, 35.41789);
  EXPECT_NEAR(started.gains.ke, 1.464, 1e-3);
  EXPECT_NEAR(started.gains.gamma, .7138, 1e-3);
  EXPECT_NEAR(started.bound, 7.699, 1e-3);
}

TEST(GainDesign, stillTargetTakesTheLargestGain) {
  const GainDesign o = designObserver(30, 0), r = designRegulation(30, 0);
  EXPECT_NEAR(observerConditions({0, o.gains.ke, .95, 1, 0, 0}).eq7, 30, 1e-9);
  EXPECT_NEAR(*regulationConditions({r.gains.kc, r.gains.ke, .95, 1, 0, 0}).eq23, 30, 1e-9);
  EXPECT_EQ(o.bound, 0);
  EXPECT_EQ(r.bound, 0);
}

TEST(GainDesign, likelyGainBalancesLagAndNoise) {
  EXPECT_NEAR(likelyObserverGain(18, .1, 0), 9, 1e-6) << "without noise the fastest allowed";
  const double slow = likelyObserverGain(18, .001, .01), fast = likelyObserverGain(18, .02, .01);
  EXPECT_LT(slow, fast);
  const auto cost = [](double ke, double kappa) {
    const double x = ke / 18;
    return kappa * kappa / (ke * ke) + 1e-4 * x / (2 - x);
  };
  for (const double factor : {.9, 1.1}) EXPECT_LT(cost(slow, .001), cost(factor * slow, .001));
}

/// Observer and regulation on SE(3) with the true e_e, at odometry steps within each frame.
class Loop {
 public:
  Loop(const SampledGains& gains, bool isCoupled, Random& random)
      : observer_({}, optionsOf(gains.ke, isCoupled)), regulation_(goal(), optionsOf(gains.kc)) {
    cMo_.translation() = random.vector(1);
    cMo_.linear() = Eigen::AngleAxisd(random.uniform(0, 1), random.direction()).matrix();
    observer_.advance(odometry_, 0);
  }

  double U_e() const { return poseEnergy(observer_.cMo().inverse() * cMo_); }
  double U() const { return U_e() + poseEnergy(goal().inverse() * observer_.cMo()); }
  double e() const {
    return std::hypot(regulation_.error(observer_.cMo()).norm(),
                      poseError(observer_.cMo().inverse() * cMo_).norm());
  }
  double time() const { return t_; }

  /// One frame; `after` is called after every odometry step.
  void frame(double T, const Twist& target, const std::function<void()>& after) {
    observer_.correctPose(cMo_);
    const int substeps = 4;
    const double h = T / substeps;
    for (int i = 0; i < substeps; ++i, t_ += h) {
      const Twist twist = regulation_.command(observer_.cMo());
      odometry_.push(t_, twist);
      odometry_.holdUntil(t_ + h);
      observer_.advance(odometry_, t_ + h);
      cMo_ = isometry(Motion::fromTwist(twist, h)) * cMo_ * isometry(Motion::fromTwist(target, -h));
      after();
    }
  }

 private:
  static Eigen::Isometry3d goal() {
    Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
    g.translation().z() = .5;
    return g;
  }
  static Eigen::Isometry3d isometry(const Motion& motion) {
    Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
    g.linear() = motion.R;
    g.translation() = motion.t;
    return g;
  }
  static VisualMotionObserverOptions optionsOf(double ke, bool isCoupled) {
    VisualMotionObserverOptions options;
    options.ke = ke;
    options.start = VisualMotionObserverOptions::Start::fromGuess;
    options.lostFrames = VisualMotionObserverOptions::LostFrames::unguarded;
    options.cMo = Eigen::Isometry3d::Identity();
    if (isCoupled) options.coupledGoal = goal();
    options.couplingStep_s = 1e3;
    return options;
  }
  static PoseRegulationOptions optionsOf(double kc) {
    PoseRegulationOptions options;
    options.kc = kc;
    return options;
  }

  VisualMotionObserver observer_;
  PoseRegulation regulation_;
  MotionBuffer odometry_ = MotionBuffer(2);
  Eigen::Isometry3d cMo_ = Eigen::Isometry3d::Identity();
  double t_ = 0;
};

/// The proofs end to end: loops at the frame rate that the conditions ask for.
class Guarantee : public ::testing::TestWithParam<unsigned> {
 protected:
  Random random_ = Random(100 + GetParam());
  SampledGains gains_ = [this] {
    const double ke = std::exp(random_.uniform(-1, 1)), kc = ke * random_.uniform(1, 4);
    return SampledGains{
        kc, ke, random_.uniform(.5, .95), random_.uniform(.1, 1), random_.uniform(.01, .3), 0};
  }();
};
INSTANTIATE_TEST_SUITE_P(RandomGains, Guarantee, ::testing::Range(0u, 10u));

TEST_P(Guarantee, energyOfAStillTargetFallsAtThePromisedRate) {
  for (const bool isCoupled : {false, true}) {
    for (const Norms norms : {Norms::paper, Norms::sharp}) {
      Loop loop(gains_, isCoupled, random_);
      const double fps = isCoupled ? *regulationConditions(gains_, norms).eq23
                                   : observerConditions(gains_, norms).eq7;
      const double beta = gains_.ke * (1 - gains_.delta) * (isCoupled ? kC / 4 : .5);
      const auto energy = [&] { return isCoupled ? loop.U() : loop.U_e(); };
      const double start = energy();
      double last = start;
      while (loop.time() < 20 / gains_.ke) {
        loop.frame(1 / fps, {}, [&] {
          ASSERT_LE(energy(), last + 1e-12);
          last = energy();
        });
      }
      EXPECT_LE(last, 2 * start * std::exp(-2 * beta * loop.time()) + 1e-12);
    }
  }
}

TEST_P(Guarantee, errorOfAMovingTargetEndsWithinTheBound) {
  for (const bool isCoupled : {false, true}) {
    for (const Norms norms : {Norms::paper, Norms::sharp}) {
      Loop loop(gains_, isCoupled, random_);
      SampledGains g = gains_;
      g.U0 = isCoupled ? loop.U() : loop.U_e();
      const double fps = isCoupled ? regulationConditions(g, norms).required_fps
                                   : observerConditions(g, norms).required_fps;
      const double bound = isCoupled ? regulationConditions(g).eq27 : observerConditions(g).eq16;
      const double settling_s = 20 / (g.ke * (1 - g.delta));
      double largest = 0;
      Twist target;
      for (int frame = 0; loop.time() < settling_s + 10 / g.ke; ++frame) {
        if (frame % 50 == 0) {  // another direction, at full size
          target = random_.twist(1, 1);
          const double size = std::hypot(target.linear.norm(), target.angular.norm());
          target.linear *= g.kappa / size;
          target.angular *= g.kappa / size;
        }
        loop.frame(1 / fps, target, [&] {
          const double error = isCoupled ? loop.e() : std::sqrt(2 * loop.U_e());
          if (loop.time() > settling_s) largest = std::max(largest, error);
        });
      }
      EXPECT_GT(largest, 0);
      EXPECT_LE(largest, bound);
    }
  }
}

}  // namespace
}  // namespace depthservo
