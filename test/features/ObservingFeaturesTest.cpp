// The drop-ins for ViSP's features other than points: as ViSP's own until `observe`, right with it.
#include <gtest/gtest.h>
#include <visp3/core/vpExponentialMap.h>

#include <limits>

#include "support/FeatureTasks.h"

namespace depthservo {
namespace {

using namespace test;

constexpr double kDt = 1. / 30;

/// A pose that faces nothing in particular.
vpHomogeneousMatrix somePose() { return vpHomogeneousMatrix(.06, -.04, .8, .3, -.25, .2); }

vpColVector unit(unsigned j, double size) {
  vpColVector v(6, 0.);
  v[j] = size;
  return v;
}

vpHomogeneousMatrix moved(const vpHomogeneousMatrix& cMo, const vpColVector& v, double dt) {
  return vpExponentialMap::direct(v, dt).inverse() * cMo;
}

/// Central differences of the projected feature. \param create sets the feature from a pose
template <typename Feature, typename Create>
vpMatrix differences(const vpHomogeneousMatrix& cMo, const Create& create) {
  const double h = 1e-5;
  Feature s;
  create(s, cMo);
  const unsigned n = s.dimension_s();
  vpMatrix L(n, 6);
  for (unsigned j = 0; j < 6; ++j) {
    Feature after, before;
    create(after, moved(cMo, unit(j, 1), h));
    create(before, moved(cMo, unit(j, 1), -h));
    const vpColVector d = after.error(before);
    for (unsigned i = 0; i < n; ++i) L[i][j] = d[i] / (2 * h);
  }
  return L;
}

void expectNear(const vpMatrix& L, const vpMatrix& expected, double relative) {
  ASSERT_EQ(L.getRows(), expected.getRows());
  double size = 0, worst = 0;
  for (unsigned i = 0; i < L.getRows(); ++i) {
    for (unsigned j = 0; j < 6; ++j) {
      size = std::max(size, std::abs(expected[i][j]));
      worst = std::max(worst, std::abs(L[i][j] - expected[i][j]));
    }
  }
  EXPECT_LT(worst, relative * size) << L << "\nexpected\n" << expected;
}

/// Drives the camera past the target with exact odometry and images, then compares the interaction
/// matrix from observed parameters with the derivative of the projection. \param set what the image
/// shows, and nothing more
template <typename Feature, typename Set>
void expectTheDerivative(Feature& s, const Set& set, const vpMatrix& expected, double relative) {
  s.setErrors(ErrorProfile());
  s.setServoDepth(ServoDepth::observed);
  vpHomogeneousMatrix cMo = somePose();
  vpColVector v(6, 0.);
  std::vector<vpColVector> path;
  for (int k = 0; k < 240; ++k) {
    for (unsigned j = 0; j < 6; ++j) v[j] = .25 * std::sin(.06 * k * (1 + .3 * j) + j);
    path.push_back(v);
  }
  for (auto it = path.rbegin(); it != path.rend(); ++it) cMo = moved(cMo, *it, -kDt);
  set(s, cMo);
  s.observe(vpColVector(6, 0.), kDt);
  for (const vpColVector& twist : path) {  // and back to the pose
    cMo = moved(cMo, twist, kDt);
    set(s, cMo);
    s.observe(twist, kDt);
  }
  expectNear(s.interaction(), expected, relative);
}

double x(const vpPoint& p) { return p.get_x(); }
double y(const vpPoint& p) { return p.get_y(); }
vpPoint at(const vpHomogeneousMatrix& cMo, std::size_t i = 0) { return FourPointScene::at(i, cMo); }

TEST(ObservingFeatures, interactionMatrixOfThePolarPointIsTheDerivative) {
  const auto set = [](auto& s, const vpHomogeneousMatrix& cMo) {
    s.set_rho(std::hypot(x(at(cMo)), y(at(cMo))));
    s.set_theta(std::atan2(y(at(cMo)), x(at(cMo))));
  };
  FeaturePointPolar s;
  expectTheDerivative(s, set, differences<vpFeaturePointPolar>(somePose(), set), 1e-6);
}

TEST(ObservingFeatures, interactionMatrixOfTheDepthIsTheDerivative) {
  FeatureDepth s;
  s.setDesiredDepth(.5);
  const auto set = [](auto& f, const vpHomogeneousMatrix& cMo) {
    f.set_x(x(at(cMo)));
    f.set_y(y(at(cMo)));
  };
  const double h = 1e-5;
  vpMatrix L(1, 6);
  for (unsigned j = 0; j < 6; ++j) {
    const double after = at(moved(somePose(), unit(j, 1), h)).get_Z();
    const double before = at(moved(somePose(), unit(j, 1), -h)).get_Z();
    L[0][j] = std::log(after / before) / (2 * h);
  }
  expectTheDerivative(s, set, L, 1e-6);
  EXPECT_NEAR(s.get_LogZoverZstar(), std::log(at(somePose()).get_Z() / .5), 1e-6);
}

TEST(ObservingFeatures, interactionMatrixOfTheSegmentIsTheDerivative) {
  const auto set = [](auto& s, const vpHomogeneousMatrix& cMo) {
    const vpPoint a = at(cMo, 0), b = at(cMo, 1);
    s.setXc((x(a) + x(b)) / 2);
    s.setYc((y(a) + y(b)) / 2);
    s.setL(std::hypot(x(a) - x(b), y(a) - y(b)));
    s.setAlpha(std::atan2(y(a) - y(b), x(a) - x(b)));
  };
  FeatureSegment s;
  expectTheDerivative(s, set, differences<vpFeatureSegment>(somePose(), set), 1e-6);
}

TEST(ObservingFeatures, interactionMatrixOfTheLineIsTheDerivative) {
  const auto set = [](auto& s, const vpHomogeneousMatrix& cMo) {
    const vpLine line = LineTask::side(2, cMo);
    s.setRhoTheta(line.getRho(), line.getTheta());
  };
  FeatureLine s;
  expectTheDerivative(s, set, differences<vpFeatureLine>(somePose(), set), 1e-6);
}

template <EllipseShape kShape>
void expectTheDerivativeOfAnEllipse() {
  const auto set = [](auto& s, const vpHomogeneousMatrix& cMo) {
    vpFeatureEllipse seen;
    EllipseTask<kShape>::create(seen, cMo);
    s.buildFrom(seen.get_x(), seen.get_y(), seen.get_n20(), seen.get_n11(), seen.get_n02());
  };
  FeatureEllipse s(kShape);
  expectTheDerivative(s, set, differences<vpFeatureEllipse>(somePose(), set), 1e-6);
}

TEST(ObservingFeatures, interactionMatrixOfTheCircleIsTheDerivative) {
  expectTheDerivativeOfAnEllipse<EllipseShape::planar>();
}

TEST(ObservingFeatures, interactionMatrixOfTheSphereIsTheDerivative) {
  expectTheDerivativeOfAnEllipse<EllipseShape::sphere>();
}

/// With `observe` never called the commands are those of ViSP's own features, given the truth.
template <typename Ours, typename Theirs, typename Create>
void expectViSPsOwn(const Create& create) {
  Ours ours;
  Theirs theirs, desired;
  create(ours, somePose());
  create(theirs, somePose());
  create(desired, FeatureTask::goal());
  EXPECT_LT((ours.interaction() - theirs.interaction()).frobeniusNorm(), 1e-12);
  EXPECT_LT((ours.error(desired) - theirs.error(desired)).frobeniusNorm(), 1e-12);
  EXPECT_EQ(ours.getDimension(), theirs.getDimension());
  const auto printed = [](const vpBasicFeature& s) {
    ::testing::internal::CaptureStdout();
    s.print();
    return ::testing::internal::GetCapturedStdout();
  };
  EXPECT_EQ(printed(ours), printed(theirs));
  const std::unique_ptr<Ours> copy(ours.duplicate());
  EXPECT_LT((copy->interaction() - theirs.interaction()).frobeniusNorm(), 1e-12);
  EXPECT_EQ(copy->getDeallocate(), vpBasicFeature::user);
  EXPECT_EQ(Ours().get_s().size(), Theirs().get_s().size());
}

TEST(ObservingFeatures, areViSPsOwnUntilObserved) {
  expectViSPsOwn<FeaturePointPolar, vpFeaturePointPolar>(
      [](auto& s, const vpHomogeneousMatrix& cMo) { vpFeatureBuilder::create(s, at(cMo)); });
  expectViSPsOwn<FeatureSegment, vpFeatureSegment>([](auto& s, const vpHomogeneousMatrix& cMo) {
    vpPoint a = at(cMo, 0), b = at(cMo, 1);
    vpFeatureBuilder::create(s, a, b);
  });
  expectViSPsOwn<FeatureLine, vpFeatureLine>([](auto& s, const vpHomogeneousMatrix& cMo) {
    vpFeatureBuilder::create(s, LineTask::side(1, cMo));
  });
  expectViSPsOwn<FeatureEllipse, vpFeatureEllipse>([](auto& s, const vpHomogeneousMatrix& cMo) {
    EllipseTask<EllipseShape::planar>::create(s, cMo);
  });
  FeatureDepth depth;
  vpFeatureDepth own, zero;
  depth.buildFrom(.1, -.2, 1.3, std::log(1.3 / .5));
  own.buildFrom(.1, -.2, 1.3, std::log(1.3 / .5));
  EXPECT_LT((depth.interaction() - own.interaction()).frobeniusNorm(), 1e-12);
  EXPECT_LT((depth.error(zero) - own.error(zero)).frobeniusNorm(), 1e-12);
}

TEST(ObservingFeatures, luminanceIsViSPsOwnUntilObserved) {
  vpImage<unsigned char> image(40, 50);
  for (unsigned i = 0; i < image.getSize(); ++i) {
    image.bitmap[i] = static_cast<unsigned char>((i * 7919) % 251);
  }
  vpCameraParameters cam(100, 100, 25, 20);
  FeatureLuminance ours;
  vpFeatureLuminance theirs;
  const auto build = [&](auto& s) {
    s.init(40, 50, .7);
    s.setCameraParameters(cam);
    s.buildFrom(image);
  };
  build(ours);
  build(theirs);
  EXPECT_LT((ours.interaction() - theirs.interaction()).frobeniusNorm(), 1e-12);
  vpMatrix L, expected;
  ours.vpFeatureLuminance::interaction(L);
  theirs.interaction(expected);
  EXPECT_LT((L - expected).frobeniusNorm(), 1e-12);
  FeatureLuminance copy(ours);
  EXPECT_LT((copy.interaction() - theirs.interaction()).frobeniusNorm(), 1e-12);
}

using Parameter = FeatureTask::Parameter;

template <typename Task>
void expectSuccess(int starts) {
  for (int i = 0; i < starts; ++i) {
    Random random(static_cast<unsigned>(i + 1));
    const vpHomogeneousMatrix start(random.uniform(-.1, .1), random.uniform(-.1, .1),
                                    random.uniform(.7, 1), random.uniform(-.2, .2),
                                    random.uniform(-.2, .2), random.uniform(-.4, .4));
    for (const double factor : {.25, 4.}) {
      Task task;
      EXPECT_TRUE(succeeds(task, start, Parameter::observed, factor, 1))
          << "start " << i << ", guess " << factor << "x";
    }
  }
}

TEST(ObservingFeatures, polarPointsArriveFromWrongGuesses) { expectSuccess<PolarTask>(2); }
TEST(ObservingFeatures, depthArrivesFromWrongGuesses) { expectSuccess<DepthTask>(2); }
TEST(ObservingFeatures, segmentsArriveFromWrongGuesses) { expectSuccess<SegmentTask>(2); }
TEST(ObservingFeatures, linesArriveFromWrongGuesses) { expectSuccess<LineTask>(2); }
TEST(ObservingFeatures, momentsArriveFromWrongGuesses) { expectSuccess<MomentsTask>(2); }
TEST(ObservingFeatures, circleArrivesFromWrongGuesses) {
  expectSuccess<EllipseTask<EllipseShape::planar>>(2);
}
TEST(ObservingFeatures, sphereArrivesFromWrongGuesses) {
  expectSuccess<EllipseTask<EllipseShape::sphere>>(2);
}

TEST(ObservingFeatures, luminanceArrivesFromWrongGuessesAndKnowsThePlane) {
  const vpHomogeneousMatrix start(.03, -.02, .58, .05, -.04, .06);
  for (const double factor : {.4, 3.}) {
    LuminanceTask task;
    EXPECT_TRUE(succeeds(task, start, Parameter::observed, factor, 1)) << factor;
    const DepthEstimate e = task.feature().estimate();
    EXPECT_NEAR(e.Z(), FeatureTask::kGoal, .1 * FeatureTask::kGoal) << factor;
  }
}

/// Rubbish in the image, the twist and the parameters: what a task gets stays finite.
template <typename Feature, typename Set>
void expectFinite(Feature& s, const Set& set) {
  const double inf = std::numeric_limits<double>::infinity();
  const double rubbish[]{.1, NAN, inf, -inf, 1e300, 0, -1e9, 1e-300};
  const vpColVector wrong(3, 0.);
  vpColVector v(6, .1);
  for (const double bad : rubbish) {
    for (int k = 0; k < 12; ++k) {
      set(s, k % 3 ? .1 + .01 * k : bad);
      v[2] = k % 5 ? .1 : bad;
      ASSERT_NO_THROW(k % 7 ? s.observe(v, k % 4 ? kDt : bad) : s.observe(wrong, kDt));
      const vpMatrix L = s.interaction();
      for (unsigned i = 0; i < L.size(); ++i) ASSERT_TRUE(std::isfinite(L.data[i])) << bad;
      const vpColVector now = s.get_s();
      for (unsigned i = 0; i < now.size(); ++i) ASSERT_TRUE(std::isfinite(now[i])) << bad;
    }
  }
  EXPECT_GT(s.refused(), 0u);
}

TEST(ObservingFeatures, neverHandOnWhatIsNotFinite) {
  FeaturePointPolar polar;
  polar.set_rhoThetaZ(.1, .1, 1);
  polar.observe(vpColVector(6, 0.), kDt);
  expectFinite(polar, [](auto& s, double a) { s.set_rho(a), s.set_theta(a), s.set_Z(a); });
  FeatureDepth depth;
  depth.buildFrom(.1, .1, 1, .1);
  depth.observe(vpColVector(6, 0.), kDt);
  expectFinite(depth, [](auto& s, double a) { s.set_x(a), s.set_y(a), s.set_LogZoverZstar(a); });
  for (const bool normalized : {false, true}) {
    FeatureSegment segment(normalized);
    segment.buildFrom(.1, .1, 1, -.1, .1, 1);
    segment.observe(vpColVector(6, 0.), kDt);
    expectFinite(segment,
                 [](auto& s, double a) { s.setXc(a), s.setYc(a), s.setL(a), s.setAlpha(a); });
  }
  FeatureLine line;
  line.buildFrom(.1, .1, 0, 0, 1, -1);
  line.observe(vpColVector(6, 0.), kDt);
  expectFinite(line, [](auto& s, double a) { s.setRhoTheta(a, a), s.setABCD(a, a, a, a); });
  for (const EllipseShape shape : {EllipseShape::planar, EllipseShape::sphere}) {
    FeatureEllipse ellipse(shape);
    ellipse.buildFrom(.1, .1, .01, 0, .01, 0, 0, 1);
    ellipse.observe(vpColVector(6, 0.), kDt);
    expectFinite(ellipse, [](auto& s, double a) { s.buildFrom(a, a, a * a, 0, a, a, a, a); });
  }
}

TEST(ObservingFeatures, hiddenOnesArePredicted) {
  FeatureLine line;
  FeatureSegment segment;
  FeatureEllipse circle;
  line.setErrors(ErrorProfile());
  segment.setErrors(ErrorProfile());
  circle.setErrors(ErrorProfile());
  vpHomogeneousMatrix cMo = somePose();
  vpColVector v(6, .05);
  for (int k = 0; k < 120; ++k) {
    if (k < 90) {
      const vpLine l = LineTask::side(2, cMo);
      line.setRhoTheta(l.getRho(), l.getTheta());
      vpPoint a = at(cMo, 0), b = at(cMo, 1);
      segment.setXc((x(a) + x(b)) / 2);
      segment.setYc((y(a) + y(b)) / 2);
      segment.setL(std::hypot(x(a) - x(b), y(a) - y(b)));
      segment.setAlpha(std::atan2(y(a) - y(b), x(a) - x(b)));
      vpFeatureEllipse seen;
      EllipseTask<EllipseShape::planar>::create(seen, cMo);
      circle.buildFrom(seen.get_x(), seen.get_y(), seen.get_n20(), seen.get_n11(), seen.get_n02());
    }
    const vpColVector applied = k == 0 ? vpColVector(6, 0.) : v;
    line.observe(applied, kDt);
    segment.observe(applied, kDt);
    circle.observe(applied, kDt);
    if (k < 119) cMo = moved(cMo, v, kDt);
  }
  EXPECT_EQ(line.estimate().status, DepthStatus::coasting);
  EXPECT_EQ(segment.estimate(0).status, DepthStatus::coasting);
  EXPECT_EQ(circle.estimate().status, DepthStatus::coasting);
  const vpLine l = LineTask::side(2, cMo);
  EXPECT_NEAR(line.getRho(), l.getRho(), 1e-3);
  EXPECT_NEAR(std::remainder(line.getTheta() - l.getTheta(), 2 * M_PI), 0, 1e-3);
  EXPECT_NEAR(segment.getXc(), (x(at(cMo, 0)) + x(at(cMo, 1))) / 2, 1e-3);
  vpFeatureEllipse seen;
  EllipseTask<EllipseShape::planar>::create(seen, cMo);
  EXPECT_NEAR(circle.get_x(), seen.get_x(), 1e-3);
  EXPECT_NEAR(circle.get_n20(), seen.get_n20(), 1e-3 * seen.get_n20());
}

}  // namespace
}  // namespace depthservo
