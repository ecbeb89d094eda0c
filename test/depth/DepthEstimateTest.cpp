#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <string>

#include "depthservo/depth/DepthEstimate.h"
#include "support/Random.h"
#include "support/StillPoint.h"

namespace depthservo {
namespace {

using test::Random;
using test::StillPoint;

constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(DepthEstimate, intervalIsThatOfTwoSigmaOfTheInverseDepth) {
  DepthEstimate e;
  e.chi = 0.5;
  e.sigma_chi = 0.1;
  EXPECT_NEAR(e.interval().low, 1 / 0.7, 1e-15);
  EXPECT_NEAR(e.interval().high, 1 / 0.3, 1e-15);
  EXPECT_NEAR(e.sigma_Z(), 0.4, 1e-15);
  e.sigma_chi = 0.25;
  EXPECT_EQ(e.interval().high, kInf) << "it may be arbitrarily far";
}

TEST(DepthEstimate, everyStatusHasItsOwnWord) {
  std::set<std::string> words;
  for (DepthStatus status :
       {DepthStatus::unset, DepthStatus::converging, DepthStatus::valid, DepthStatus::unexcited,
        DepthStatus::coasting, DepthStatus::rejected, DepthStatus::lost}) {
    words.insert(toString(status));
  }
  EXPECT_EQ(words.size(), 7u);
}

TEST(DepthRange, clampsEveryInverseDepth) {
  const DepthRange range{0.1, 10};
  EXPECT_EQ(range.clampChi(1), 1);
  EXPECT_EQ(range.clampChi(0), 0.1);
  EXPECT_EQ(range.clampChi(-5), 0.1);
  EXPECT_EQ(range.clampChi(kInf), 10);
  EXPECT_EQ(range.clampChi(-kInf), 0.1);
}

TEST(DepthPrior, isMadeUsableWhateverWasGiven) {
  const DepthRange range{0.1, 10};
  for (double bad : {std::nan(""), kInf, -kInf, 0.0, -3.0}) {
    EXPECT_EQ((DepthPrior{bad, 1}.sanitised(range).Z), 1) << bad;
    EXPECT_EQ((DepthPrior{2, bad}.sanitised(range).sigma_chi), DepthPrior::kWideSigma_chi) << bad;
  }
  EXPECT_EQ((DepthPrior{0.01, 1}.sanitised(range).Z), 0.1);
  EXPECT_EQ((DepthPrior{1e9, 1}.sanitised(range).Z), 10);
  EXPECT_EQ((DepthPrior{2, 0.3}.sanitised(range).sigma_chi), 0.3);
}

TEST(PredictedEstimate, followsTheStillPoint) {
  const Twist twist{{.1, -.2, .3}, {.1, .2, -.3}};
  StillPoint point = StillPoint::at(.1, -.2, 1.5);
  DepthEstimate e;
  e.x = point.x();
  e.y = point.y();
  e.chi = point.chi();
  e.status = DepthStatus::valid;
  point.move(twist, 0.7);
  const DepthEstimate later = predicted(e, Motion::fromTwist(twist, 0.7));
  EXPECT_NEAR(later.x, point.x(), 1e-12);
  EXPECT_NEAR(later.y, point.y(), 1e-12);
  EXPECT_NEAR(later.Z(), point.Z(), 1e-12);
  EXPECT_EQ(later.status, DepthStatus::valid);
}

TEST(PredictedEstimate, sigmaIsTheSpreadOfPredictedDepths) {
  const Twist twist{{.1, -.2, .3}, {.1, .2, -.3}};
  const DepthEstimate e{.1, -.2, 1 / 1.5, 1e-3, 0, DepthStatus::valid};
  Random random(1);
  double sum = 0, sum2 = 0;
  const int n = 4000;
  for (int i = 0; i < n; ++i) {
    StillPoint point = StillPoint::at(e.x, e.y, 1 / (e.chi + random.normal(e.sigma_chi)));
    point.move(twist, 0.05);
    sum += point.chi();
    sum2 += point.chi() * point.chi();
  }
  const double spread = std::sqrt(sum2 / n - std::pow(sum / n, 2));
  EXPECT_NEAR(predicted(e, Motion::fromTwist(twist, 0.05)).sigma_chi, spread, 0.04 * spread);
}

TEST(PredictedEstimate, behindTheCameraIsLostAndStaysInPlace) {
  const DepthEstimate e{.1, -.2, 1, .01, 0, DepthStatus::valid};
  const DepthEstimate later = predicted(e, Motion::fromTwist({{0, 0, 2}, {0, 0, 0}}, 1));
  EXPECT_EQ(later.status, DepthStatus::lost);
  EXPECT_EQ(later.x, e.x);
  EXPECT_EQ(later.chi, e.chi);
}

TEST(PredictedEstimate, staysWithinTheRange) {
  const DepthRange range{0.5, 2};
  const DepthEstimate e{0, 0, 1, .01, 0, DepthStatus::valid};
  EXPECT_NEAR(predicted(e, Motion::fromTwist({{0, 0, .9}, {0, 0, 0}}, 1), range).Z(), 0.5, 1e-12);
  EXPECT_NEAR(predicted(e, Motion::fromTwist({{0, 0, -3}, {0, 0, 0}}, 1), range).Z(), 2, 1e-12);
}

TEST(DepthEstimate, widensAsFarAsTheCameraMayHaveGone) {
  const PointSigmas before{1e-3, .05};
  const PointState point{.2, -.1, .5};
  const PointSigmas after = widened(before, point, {1, .3, .2});
  // Two sigma nearer: 1/.6 m less 0.3 m; the rotation moves a point off the axis nearer, too.
  const double nearest = 1 / (1 / .6 - .3) + .2 * std::hypot(.2, .1) * .5;
  EXPECT_NEAR(after.chi, .5 * (nearest - .5), 1e-12);
  const double r2 = .05;
  EXPECT_NEAR(after.xy, 1e-3 + .5 * (.3 * .6 * std::sqrt(1 + r2) + .2 * (1 + r2)), 1e-12);
  const PointSigmas gone = widened(before, point, {9, 3, .2});
  EXPECT_EQ(gone.chi, DepthPrior::kWideSigma_chi) << "it may be anywhere";
  EXPECT_EQ(widened({0, 7}, point, {9, 3, .2}).chi, 7) << "never narrower";
}

TEST(DepthEstimate, widensByPartsAsByTheWhole) {
  PointSigmas byParts{0, .02};
  const PointState point{0, 0, 1};
  for (int i = 0; i < 30; ++i) byParts = widened(byParts, point, {.1, .01, 0});
  EXPECT_NEAR(byParts.chi, widened({0, .02}, point, {3, .3, 0}).chi, 1e-12);
}

TEST(DepthEstimate, predictionThroughUnknownMotionCoasts) {
  DepthEstimate e;
  e.status = DepthStatus::valid;
  e.chi = .5;
  e.sigma_chi = .01;
  const DepthEstimate after = predicted(e, Motion::notKnown({.5, .2, 0}));
  EXPECT_EQ(after.status, DepthStatus::coasting);
  EXPECT_EQ(after.chi, .5);
  EXPECT_GT(after.sigma_chi, .03);
}

TEST(DepthEstimate, isCautiousWhileInDoubt) {
  DepthEstimate e;
  e.chi = 1;
  e.sigma_chi = .5;
  EXPECT_FALSE(e.isDoubtful());
  EXPECT_EQ(e.cautiousZ(), 1);
  e.sigma_chi = .6;
  EXPECT_TRUE(e.isDoubtful());
  EXPECT_NEAR(e.cautiousZ(), 1 / 2.2, 1e-12);
}

TEST(DepthEstimate, statusCanBeStreamed) {
  std::ostringstream out;
  out << DepthStatus::coasting;
  EXPECT_EQ(out.str(), "coasting");
}

}  // namespace
}  // namespace depthservo
