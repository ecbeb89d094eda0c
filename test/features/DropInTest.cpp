// FeaturePoint in the place of vpFeaturePoint: until `observe` is called nothing may change.
#include <gtest/gtest.h>
#include <visp3/blob/vpDot.h>
#include <visp3/blob/vpDot2.h>

#include <cmath>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

#include "depthservo/features/FeaturePoint.h"
#include "support/FourPointScene.h"

namespace depthservo {
namespace {

using namespace test;

static_assert(std::is_base_of_v<vpFeaturePoint, FeaturePoint>);

class DropIn : public ::testing::TestWithParam<vpServo::vpServoIteractionMatrixType> {};

TEST_P(DropIn, givesTheSameCommandsOverAWholeRun) {
  for (double Z : {1.0, 3.0, 0.3}) {
    std::vector<vpFeaturePoint> plain(4);
    std::vector<FeaturePoint> ours(4);
    for (std::size_t i = 0; i < 4; ++i) {
      plain[i].set_Z(Z);
      ours[i].set_Z(Z);
    }
    const ServoOutcome expected = servo(plain, GetParam(), 200);
    const ServoOutcome outcome = servo(ours, GetParam(), 200);
    for (std::size_t k = 0; k < expected.commands.size(); ++k) {
      for (unsigned j = 0; j < 6; ++j) {
        ASSERT_NEAR(outcome.commands[k][j], expected.commands[k][j], 1e-12) << "frame " << k;
      }
    }
    EXPECT_NEAR(outcome.error, expected.error, 1e-12);
  }
}

TEST_P(DropIn, givesTheSameCommandsWithTheTrueDepthInEveryFrame) {
  // vpFeatureBuilder::create(s, point) sets Z as well, as ViSP's simulation examples do.
  const auto run = [](auto& s) {
    FourPointScene scene;
    std::vector<vpFeaturePoint> s_star(4);
    vpServo task;
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(GetParam());
    for (std::size_t i = 0; i < 4; ++i) {
      vpPoint p = scene.desired(i);
      vpFeatureBuilder::create(s_star[i], p);
      task.addFeature(s[i], s_star[i]);
    }
    std::vector<vpColVector> commands;
    for (int k = 0; k < 50; ++k) {
      for (std::size_t i = 0; i < 4; ++i) vpFeatureBuilder::create(s[i], scene.seen(i));
      commands.push_back(task.computeControlLaw());
      scene.apply(commands.back());
    }
    return commands;
  };
  std::vector<vpFeaturePoint> plain(4);
  std::vector<FeaturePoint> ours(4);
  const auto expected = run(plain), commands = run(ours);
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR((commands[k] - expected[k]).frobeniusNorm(), 0, 1e-12) << "frame " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(InteractionMatrices, DropIn,
                         ::testing::Values(vpServo::CURRENT, vpServo::MEAN, vpServo::DESIRED));

TEST(DropInFeature, isInitialisedLikeTheBaseClass) {
  const vpFeaturePoint plain;
  FeaturePoint ours;
  EXPECT_EQ(ours.get_Z(), plain.get_Z());
  EXPECT_EQ(ours.get_x(), plain.get_x());
  EXPECT_EQ(ours.dimension_s(), 2u);
  EXPECT_EQ(ours.getDimension(), 2u);
  EXPECT_EQ(ours.estimate().status, DepthStatus::unset);
}

TEST(DropInFeature, interactionAndErrorAreThoseOfTheBaseClassForEverySelection) {
  vpFeaturePoint plain, s_star;
  FeaturePoint ours;
  plain.buildFrom(.1, -.2, 1.7);
  ours.buildFrom(.1, -.2, 1.7);
  s_star.buildFrom(.3, .1, .5);
  for (unsigned select : {static_cast<unsigned>(vpFeaturePoint::FEATURE_ALL),
                          vpFeaturePoint::selectX(), vpFeaturePoint::selectY()}) {
    const vpMatrix expected = plain.interaction(select), L = ours.interaction(select);
    ASSERT_EQ(L.getRows(), expected.getRows());
    EXPECT_EQ((L - expected).frobeniusNorm(), 0);
    const vpColVector expectedError = plain.error(s_star, select);
    const vpColVector error = ours.error(s_star, select);
    ASSERT_EQ(error.size(), expectedError.size());
    EXPECT_EQ((error - expectedError).frobeniusNorm(), 0);
  }
}

TEST(DropInFeature, everyFeatureBuilderOverloadSetsTheSamePoint) {
  const vpCameraParameters cam(600, 600, 100, 80), wrongCam(610, 590, 98, 83);
  vpImage<unsigned char> I(160, 200, 220);
  for (unsigned v = 0; v < 160; ++v) {
    for (unsigned u = 0; u < 200; ++u) {
      if (std::hypot(u - 130., v - 60.) < 12) I[v][u] = 20;
    }
  }
  vpDot dot;
  dot.setGraphics(false);
  dot.initTracking(I, vpImagePoint(60, 130));
  vpDot2 dot2;
  dot2.setGraphics(false);
  dot2.initTracking(I, vpImagePoint(60, 130));
  vpPoint point(.1, -.1, 0);
  point.track(vpHomogeneousMatrix(.05, .02, 1.3, .1, .2, .3));

  const auto expectSame = [](const char* name, const auto& create) {
    SCOPED_TRACE(name);
    vpFeaturePoint plain;
    FeaturePoint ours;
    plain.set_Z(2);
    ours.set_Z(2);
    create(plain);
    create(ours);
    EXPECT_NE(ours.get_x(), 0);
    EXPECT_EQ(ours.get_x(), plain.get_x());
    EXPECT_EQ(ours.get_y(), plain.get_y());
    EXPECT_EQ(ours.get_Z(), plain.get_Z());
    ours.observe(vpColVector(6, 0.), 0.1);  // and each counts as a new measurement
    EXPECT_NE(ours.estimate().status, DepthStatus::unset);
    EXPECT_NEAR(ours.estimate().Z(), plain.get_Z(), 1e-12);
  };
  expectSame("vpDot", [&](auto& s) { vpFeatureBuilder::create(s, cam, dot); });
  expectSame("vpDot2", [&](auto& s) { vpFeatureBuilder::create(s, cam, dot2); });
  expectSame("vpImagePoint",
             [&](auto& s) { vpFeatureBuilder::create(s, cam, vpImagePoint(60, 130)); });
  expectSame("vpPoint", [&](auto& s) { vpFeatureBuilder::create(s, point); });
  expectSame("two cameras", [&](auto& s) { vpFeatureBuilder::create(s, cam, wrongCam, point); });
}

std::string printed(const vpBasicFeature& s, unsigned select = vpBasicFeature::FEATURE_ALL) {
  ::testing::internal::CaptureStdout();
  s.print(select);
  return ::testing::internal::GetCapturedStdout();
}

TEST(DropInFeature, printsLikeTheBaseClassUntilObservedAndMoreAfterwards) {
  vpFeaturePoint plain;
  FeaturePoint ours;
  plain.buildFrom(.1, .2, 1.5);
  ours.buildFrom(.1, .2, 1.5);
  for (unsigned select : {static_cast<unsigned>(vpFeaturePoint::FEATURE_ALL),
                          vpFeaturePoint::selectX(), vpFeaturePoint::selectY()}) {
    EXPECT_EQ(printed(ours, select), printed(plain, select));
  }
  ours.setServoDepth(ServoDepth::observed);
  ours.observe(vpColVector(6, 0.), 0.1);
  const std::string text = printed(ours), expected = printed(plain);
  EXPECT_EQ(text.substr(0, expected.size()), expected);
  EXPECT_NE(text.find("1.5"), std::string::npos) << text;
  EXPECT_NE(text.find("sigma_Z"), std::string::npos) << text;
}

TEST(DropInFeature, displayOnAnImageWithoutDisplayDoesNothing) {
  const vpCameraParameters cam(600, 600, 50, 40);
  vpImage<unsigned char> gray(80, 100, 7);
  vpImage<vpRGBa> colour(80, 100);
  FeaturePoint s;
  s.buildFrom(.01, .01, 1);
  for (int i = 0; i < 2; ++i) {
    s.display(cam, gray);
    s.display(cam, colour);
    s.observe(vpColVector(6, 0.), 0.1);
  }
  for (unsigned i = 0; i < gray.getSize(); ++i) ASSERT_EQ(gray.bitmap[i], 7);
}

TEST(DropInFeature, addFeatureWithoutADesiredOneServosToTheCentre) {
  const auto run = [](auto& s) {
    vpServo task;
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(vpServo::CURRENT);
    s.buildFrom(.1, -.2, 1.5);
    task.addFeature(s);
    return task.computeControlLaw();
  };
  vpFeaturePoint plain;
  FeaturePoint ours;
  const vpColVector expected = run(plain), v = run(ours);
  EXPECT_NEAR((v - expected).frobeniusNorm(), 0, 1e-12);
}

TEST(DropInFeature, duplicateIsAFeatureOfItsOwn) {
  FeaturePoint s;
  s.buildFrom(.1, .2, 1.5);
  s.observe(vpColVector(6, 0.), 0.1);
  const std::unique_ptr<FeaturePoint> copy(s.duplicate());
  EXPECT_EQ(copy->getDeallocate(), vpBasicFeature::user);
  copy->buildFrom(.3, .3, 4);
  copy->observe(vpColVector(6, 0.), 0.1);
  EXPECT_EQ(s.get_x(), .1);
  EXPECT_NEAR(s.estimate().Z(), 1.5, 1e-12);
  EXPECT_NEAR(copy->estimate().Z(), 4, 1e-12);
  copy->init();
  EXPECT_EQ(copy->estimate().status, DepthStatus::unset);
  EXPECT_EQ(copy->get_Z(), 1);
}

TEST(DropInFeature, copiesContinueIndependently) {
  vpColVector v(6, 0.);
  v[0] = .1;
  FeaturePoint s;
  const auto measure = [&v](FeaturePoint& f, int i) {
    f.set_x(.2 - .1 * i * kPeriod_s);
    f.set_y(.1);
    f.observe(v, kPeriod_s);
  };
  for (int i = 0; i < 20; ++i) measure(s, i);
  FeaturePoint copied(s), assigned;
  assigned = s;
  for (int i = 20; i < 40; ++i) {
    measure(s, i);
    measure(copied, i);
    measure(assigned, i);
    ASSERT_EQ(copied.estimate().chi, s.estimate().chi) << "a copy knows all that was learnt";
    ASSERT_EQ(assigned.estimate().chi, s.estimate().chi);
  }
  const double Z = s.estimate().Z();
  copied.setDepth(10, 1e-3);
  EXPECT_EQ(s.estimate().Z(), Z);
  EXPECT_EQ(assigned.estimate().Z(), Z);
}

TEST(DropInFeature, copyOfAFeatureThatATaskOwnsBelongsToTheUser) {
  FeaturePoint owned;
  owned.setDeallocate(vpBasicFeature::vpServo);
  FeaturePoint copied(owned), assigned;
  assigned = owned;
  EXPECT_EQ(copied.getDeallocate(), vpBasicFeature::user);
  EXPECT_EQ(assigned.getDeallocate(), vpBasicFeature::user);
  FeaturePoint& same = assigned;
  assigned = same;
  EXPECT_EQ(assigned.getDeallocate(), vpBasicFeature::user);
}

TEST(DropInFeature, unusableDepthNeverReachesTheInteractionMatrix) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  vpFeaturePoint plain;
  plain.buildFrom(.1, .2, 1.5);
  const vpMatrix expected = plain.interaction();
  for (double bad : {std::nan(""), kInf, -kInf, 0.0, -1.0, 1e-9}) {
    FeaturePoint s;
    s.set_x(.1);
    s.set_y(.2);
    s.set_Z(1.5);
    s.interaction();
    s.set_Z(bad);
    EXPECT_EQ((s.interaction() - expected).frobeniusNorm(), 0) << "Z " << bad;
    EXPECT_EQ(s.get_Z(), 1.5) << "the last usable one";
  }
}

}  // namespace
}  // namespace depthservo
