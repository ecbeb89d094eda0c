#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "depthservo/depth/DepthGains.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(DepthGains, ofThePaperAreStableUpToTheExcitationsOfTheSpecification) {
  const DepthGains paper = DepthGains::given(48, 44000, 0.1, 30);
  EXPECT_NEAR(paper.euler().high, 0.181, 5e-4);
  EXPECT_NEAR(paper.flowEuler().high, 0.128, 5e-4);
  EXPECT_EQ(DepthGains::poleMatched().high, kInf);
  EXPECT_NEAR(DepthGains::given(48, 44000, 0.114, 30).damping(), 1, 5e-3);
  EXPECT_NEAR(DepthGains::given(48, 44000, 0.08, 30).wn(), 17, 0.3);
  EXPECT_NEAR(paper.k_3_px(1096), 0.0366, 5e-5);
}

/// Largest magnitude of the poles of the error under lateral motion, without the flow of the image.
double spectralRadius(double trace, double determinant) {
  const double D = trace * trace / 4 - determinant;
  return D < 0 ? std::sqrt(determinant)
               : std::max(std::abs(trace / 2 + std::sqrt(D)), std::abs(trace / 2 - std::sqrt(D)));
}

TEST(DepthGains, marginIsWhereTheSampledErrorGrows) {
  for (double k : {10., 48., 55., 70.}) {
    for (double k_3 : {1000., 8192.}) {
      const DepthGains gains{k, k_3, 0.1, 30};
      const double dt = 1 / gains.fps;
      const auto isInside = [](const DepthGains::Stability& s, double W) {
        return s.low < W && W < s.high;
      };
      for (double W = 0.01; W < 2; W *= 1.01) {
        // e1' = e1 + dt (-k e1 + W e3), e3' = e3 - dt k_3 W e1
        const double m = k_3 * W * W * dt * dt;
        const double euler = spectralRadius(2 - k * dt, 1 - k * dt + m);
        if (std::abs(euler - 1) > 1e-3) {
          EXPECT_EQ(isInside(gains.euler(), W), euler < 1) << "k " << k << ", W " << W;
        }
        // e1 = e1 + W dt e3 first, then (1 - k dt) e1 and e3 - k_3 dt W e1
        const double flow = spectralRadius(2 - k * dt - m, 1 - k * dt);
        if (std::abs(flow - 1) > 1e-3) {
          EXPECT_EQ(isInside(gains.flowEuler(), W), flow < 1) << "k " << k << ", W " << W;
        }
      }
    }
  }
}

TEST(DepthGains, designedSettleInTheTimeAskedForAndAreCriticallyDamped) {
  const DepthGains gains = DepthGains::design(1, 0.1, 30);
  EXPECT_NEAR(gains.damping(), 1, 1e-12);
  EXPECT_NEAR(gains.settling_s(), 1, 1e-9);
  EXPECT_NEAR(gains.wn(), 5.83, 1e-9);
  EXPECT_GT(gains.flowEuler().margin(0.1), 1);
}

TEST(DepthGains, settlingTimeIsThatOfTheDifferentialEquation) {
  // e'' + k e' + k_3 W^2 e = 0 from rest.
  for (double zeta : {0.5, 1.0, 2.0, 5.0}) {
    const double wn = 4, W = 0.1;
    const DepthGains gains = DepthGains::given(2 * zeta * wn, wn * wn / (W * W), W, 30);
    double e = 1, rate = 0, last = 0;
    const double dt = 1e-5;
    for (double t = 0; t < 15; t += dt) {
      rate += dt * (-gains.k * rate - wn * wn * e);
      e += dt * rate;
      if (std::abs(e) > 0.02) last = t;
    }
    const double tolerance = zeta < 1 ? 0.25 : 0.01;  // of the envelope, when it swings
    EXPECT_NEAR(gains.settling_s(), last, tolerance * last) << zeta;
    EXPECT_GE(gains.settling_s(), 0.99 * last) << zeta;
  }
}

TEST(DepthGains, expectedNoiseIsThatOfTheObserver) {
  const double W = 0.1, fps = 30, Z = 1.5, noise_px = 0.5, focal_px = 600;
  const DepthGains gains = DepthGains::design(1.5, W, fps);
  NonlinearObserverOptions options;
  options.gains = {gains.k, gains.k_3, 0, 0};
  test::Random random(3);
  double squares = 0;
  int count = 0;
  for (int run = 0; run < 40; ++run) {
    test::StillPoint point = test::StillPoint::at(.4, 0, Z);
    NonlinearDepthObserver observer(options);
    const double sigma = noise_px / focal_px;
    observer.reset(point.measured(sigma), {Z});
    for (int i = 0; i < 400; ++i) {
      const Twist twist{{W, 0, 0}, {0, 0, 0}};
      point.move(twist, 1 / fps);
      observer.predict(Motion::fromTwist(twist, 1 / fps));
      observer.correct({point.x() + random.normal(sigma), point.y() + random.normal(sigma), sigma});
      if (i < 100) continue;
      squares += std::pow(observer.estimate().chi - point.chi(), 2);
      ++count;
    }
  }
  const double measured = Z * Z * std::sqrt(squares / count);
  EXPECT_NEAR(gains.sigma_Z(Z, noise_px, focal_px), measured, 0.1 * measured);
}

TEST(DepthGains, inTheWrongUnitAreRefusedWithAMessageThatSaysSo) {
  try {
    DepthGains::given(48, 44000. * 1096 * 1096, 0.1, 30);  // taken for pixels
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("wrong unit"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("focal_px^2"), std::string::npos) << error.what();
  }
  EXPECT_NO_THROW(DepthGains::given(48, 44000, 0.1, 30)) << "as the paper has them, normalised";
}

TEST(DepthGains, thatCannotBeAreRefused) {
  const double bad[] = {0, -1, std::numeric_limits<double>::quiet_NaN(), kInf};
  for (double value : bad) {
    EXPECT_THROW(DepthGains::design(value, .1, 30), std::invalid_argument);
    EXPECT_THROW(DepthGains::design(1, value, 30), std::invalid_argument);
    EXPECT_THROW(DepthGains::design(1, .1, value), std::invalid_argument);
    EXPECT_THROW(DepthGains::given(value, 100, .1, 30), std::invalid_argument);
    EXPECT_THROW(DepthGains::given(10, value, .1, 30), std::invalid_argument);
  }
  EXPECT_THROW(DepthGains::design(0.1, .1, 30), std::invalid_argument) << "wn dt > 1";
}

}  // namespace
}  // namespace depthservo
