#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "depthservo/pose/VisualMotionObserver.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;
using Options = VisualMotionObserverOptions;
using Points = std::vector<Eigen::Vector3d>;

const double kNever = std::numeric_limits<double>::infinity();
const Points kPlate{{.1, .1, 0}, {-.1, .1, 0}, {-.1, -.1, 0}, {.1, -.1, 0}};
const Points kSolid{{.5, .5, .5}, {-.5, .5, .5}, {-.5, -.5, .5}, {.5, -.5, .5}};
const Points kBox{{.1, .1, 0},  {-.1, .1, 0}, {-.1, -.1, 0},
                  {.1, -.1, 0}, {0, .1, .1},  {0, -.1, .1}};

Eigen::Isometry3d at(double x, double y, double z) {
  Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
  g.translation() << x, y, z;
  return g;
}

Eigen::Isometry3d turned(Eigen::Isometry3d g, double angle, const Eigen::Vector3d& axis) {
  g.linear() = g.linear() * Eigen::AngleAxisd(angle, axis.normalized()).matrix();
  return g;
}

/// A camera and a target that move in a world, by their own rotation and position (no exponentials:
/// many small steps of the midpoint rule).
struct Scene {
  Points points;
  Eigen::Isometry3d cMo;
  Twist target{};  // target axes

  /// Both twists held for this long.
  void move(const Twist& camera, double duration_s) {
    const int steps = std::max(1, static_cast<int>(std::ceil(duration_s / 1e-3)));
    const double h = duration_s / steps;
    for (int i = 0; i < steps; ++i) {
      cMo = step(camera, h).inverse() * cMo * step(target, h);
    }
  }

  std::vector<PointObservation> image(double sigma = 0, Random* noise = nullptr) const {
    std::vector<PointObservation> observations;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d cP = cMo * points[i];
      const double dx = noise ? noise->normal(sigma) : 0, dy = noise ? noise->normal(sigma) : 0;
      observations.push_back(
          {static_cast<int>(i), {cP.x() / cP.z() + dx, cP.y() / cP.z() + dy, sigma}});
    }
    return observations;
  }

  double Z(int id) const { return (cMo * points[static_cast<std::size_t>(id)]).z(); }

 private:
  static Eigen::Isometry3d step(const Twist& twist, double h) {
    Eigen::Isometry3d g = Eigen::Isometry3d::Identity();
    const double angle = twist.angular.norm() * h;
    if (angle > 0) {
      const Eigen::Vector3d axis = twist.angular.normalized();
      g.linear() = Eigen::AngleAxisd(angle, axis).matrix();
      g.translation() = Eigen::AngleAxisd(angle / 2, axis) * twist.linear * h;
    } else {
      g.translation() = twist.linear * h;
    }
    return g;
  }
};

Options optionsFrom(const Eigen::Isometry3d& guess, double ke = 9) {
  Options options;
  options.ke = ke;
  options.cMo = guess;
  return options;
}

/// The paper's observer to the letter: from a guess, one method, no guard.
Options plain(const Eigen::Isometry3d& guess, ImageErrorMethod method, double ke = 9) {
  Options options = optionsFrom(guess, ke);
  options.method = method;
  options.start = Options::Start::fromGuess;
  options.iterateAbove_rad = kNever;
  options.lostFrames = Options::LostFrames::unguarded;
  return options;
}

double angleBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

/// Drives an observer along a scene: an odometry row and an image per call.
struct Drive {
  Scene scene;
  VisualMotionObserver observer;
  MotionBuffer odometry = MotionBuffer(512);
  double time_s = 0;

  Drive(const Scene& start, const Options& options)
      : scene(start), observer(start.points, options) {
    observer.advance(odometry, 0);
  }
  void move(const Twist& camera, double duration_s) {
    odometry.push(time_s, camera);
    time_s += duration_s;
    odometry.holdUntil(time_s);
    scene.move(camera, duration_s);
    observer.advance(odometry, time_s);
  }
  void see(double sigma = 0, Random* noise = nullptr) {
    observer.correct(scene.image(sigma, noise));
  }
};

Twist cameraTwist(double t) { return {{.1 * std::cos(t), .05, .03}, {.1, -.2 * std::sin(t), .2}}; }

// ------------------------------------------------------------------------------------- image
// Jacobian

class ImageJacobian : public ::testing::TestWithParam<ImageErrorMethod> {};
INSTANTIATE_TEST_SUITE_P(Methods, ImageJacobian,
                         ::testing::Values(ImageErrorMethod::mixed, ImageErrorMethod::taylor,
                                           ImageErrorMethod::iterated));

/// The projection moved by a finite difference along each axis of SE(3) must give back that axis.
TEST_P(ImageJacobian, invertsFiniteDifferencesOfTheProjection) {
  Random random(1);
  const double step = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Isometry3d guess =
        turned(at(random.uniform(-.3, .3), random.uniform(-.3, .3), random.uniform(1, 3)),
               random.uniform(0, .8), random.direction());
    for (int axis = 0; axis < 6; ++axis) {
      Vector6d expected = Vector6d::Zero();
      expected(axis) = step;
      Scene scene{kSolid, guess};
      scene.target = {expected.head<3>(), expected.tail<3>()};
      scene.move({}, 1);
      VisualMotionObserver observer(kSolid, plain(guess, GetParam()));
      observer.correct(scene.image());
      ASSERT_EQ(observer.verdict(), ImageVerdict::accepted);
      EXPECT_MATRIX_NEAR(observer.error(), expected, 1e-10);
    }
  }
}

struct Spread {
  double median, largest;
};

/// Relative error of e_e over random directions, from (0, 0, 1.5).
Spread errorOf(ImageErrorMethod method, double distance, double angle) {
  Random random(2);
  std::vector<double> errors;
  for (int i = 0; i < 1001; ++i) {
    const Eigen::Isometry3d guess = at(0, 0, 1.5);
    Eigen::Isometry3d g_ee = Eigen::Isometry3d::Identity();
    if (distance > 0) g_ee.translation() = distance * random.direction();
    if (angle > 0) g_ee = turned(g_ee, angle, random.direction());
    const Scene scene{kSolid, guess * g_ee};
    VisualMotionObserver observer(kSolid, plain(guess, method));
    observer.correct(scene.image());
    if (observer.verdict() != ImageVerdict::accepted) continue;
    errors.push_back((observer.error() - poseError(g_ee)).norm() / poseError(g_ee).norm());
  }
  EXPECT_GT(errors.size(), 990u);
  std::sort(errors.begin(), errors.end());
  return {errors[errors.size() / 2], errors.back()};
}

TEST(VisualMotionObserver, taylorErrorIsOfFirstOrder) {
  const double translation[][3] = {{.1, .03, .05}, {.5, .13, .33}, {1, .23, .98}};
  for (const auto& [size, median, largest] : translation) {
    const Spread e = errorOf(ImageErrorMethod::taylor, size, 0);
    EXPECT_NEAR(e.median, median, .1 * median + .005) << size << " m";
    EXPECT_NEAR(e.largest, largest, .1 * largest + .005) << size << " m";
  }
  const double rotation[][3] = {{.1, .09, .11}, {.5, .41, .58}, {1, 1.03, 1.3}};
  for (const auto& [size, median, largest] : rotation) {
    const Spread e = errorOf(ImageErrorMethod::taylor, 0, size);
    EXPECT_NEAR(e.median, median, .1 * median + .005) << size << " rad";
    EXPECT_NEAR(e.largest, largest, .1 * largest + .005) << size << " rad";
  }
}

TEST(VisualMotionObserver, mixedErrorIsExactInTranslation) {
  for (const double size : {.1, .5, 1.}) {
    EXPECT_LT(errorOf(ImageErrorMethod::mixed, size, 0).largest, 1e-10) << size << " m";
  }
  const double rotation[][3] = {{.1, .06, .10}, {.5, .33, .60}, {1, .95, 2.1}};
  for (const auto& [size, median, largest] : rotation) {
    const Spread e = errorOf(ImageErrorMethod::mixed, 0, size);
    EXPECT_NEAR(e.median, median, .1 * median + .005) << size << " rad";
    EXPECT_NEAR(e.largest, largest, .1 * largest + .005) << size << " rad";
  }
}

TEST(VisualMotionObserver, iteratedErrorIsExactUpToOneRadian) {
  for (const double size : {.1, .5, 1.}) {
    EXPECT_LT(errorOf(ImageErrorMethod::iterated, size, 0).largest, 1e-9) << size << " m";
    EXPECT_LT(errorOf(ImageErrorMethod::iterated, 0, size).largest, 1e-9) << size << " rad";
  }
}

// ---------------------------------------------------------------------------------------- observer
// law

TEST(VisualMotionObserver, errorDecaysByOneMinusKeTPerFrameWhateverTheCameraDoes) {
  const double ke = 5, T = 1. / 30;
  for (const auto lostFrames : {Options::LostFrames::guarded, Options::LostFrames::unguarded}) {
    const Eigen::Isometry3d start = turned(at(.1, .2, 1.5), .4, {1, 2, 3});
    Options options = plain(start * at(.1, -.05, .2), ImageErrorMethod::mixed, ke);
    options.lostFrames = lostFrames;
    Drive drive({kBox, start}, options);
    double expected = at(.1, -.05, .2).translation().norm();
    for (int i = 0; i < 30; ++i, expected *= 1 - ke * T) {
      drive.see();
      ASSERT_NEAR(drive.observer.error().norm(), expected, 1e-5);
      drive.move(cameraTwist(i * T), T);
    }
  }
}

TEST(VisualMotionObserver, oneIntervalIsTheSameAsManyShortOnes) {
  const Eigen::Isometry3d start = at(0, 0, 1.5), guess = turned(at(.1, 0, 1.4), .2, {1, 1, 0});
  Options coupled = plain(guess, ImageErrorMethod::mixed);
  coupled.coupledGoal = at(0, 0, .5);
  Options guarded = plain(guess, ImageErrorMethod::mixed);
  guarded.lostFrames = Options::LostFrames::guarded;
  for (const Options& options : {plain(guess, ImageErrorMethod::mixed), guarded, coupled}) {
    Drive once({kBox, start}, options), often({kBox, start}, options);
    once.see();
    often.see();
    const Twist twist = cameraTwist(.3);
    once.move(twist, .3);
    for (int i = 0; i < 60; ++i) often.move(twist, .005);
    EXPECT_MATRIX_NEAR(once.observer.cMo().matrix(), often.observer.cMo().matrix(), 1e-9);
  }
}

TEST(VisualMotionObserver, followsAMovingTargetWithTheLagSpeedOverGain) {
  const Twist V{{.04, -.02, .04}, {0, 0, 0}};
  for (const double ke : {2., 9., 18.}) {
    Scene scene{kBox, at(0, 0, 1)};
    scene.target = V;
    Drive drive(scene, optionsFrom(at(0, 0, 1), ke));
    for (int i = 0; i < 150; ++i) {
      drive.see();
      drive.move({{.04, 0, .04}, {0, 0, 0}}, 1. / 30);
    }
    drive.see();
    EXPECT_NEAR(drive.observer.error().norm(), V.linear.norm() / ke, 1e-4) << ke;
  }
}

TEST(VisualMotionObserver, tracksATurningTarget) {
  Scene scene{kBox, at(0, 0, 1)};
  Drive drive(scene, optionsFrom(scene.cMo));
  for (int i = 0; i < 300; ++i) {
    drive.see();
    const double t = i / 30.;
    drive.scene.target = {{.05 * std::sin(t), .03, .1 * std::cos(t)}, {0, .4 * std::sin(t), .2}};
    drive.move({{0, .03, 0}, {0, 0, .2}}, 1. / 30);
    ASSERT_LT(angleBetween(drive.observer.cMo(), drive.scene.cMo), .4 / 9 + .03) << i;
    for (int id = 0; id < 6; ++id) {
      ASSERT_NEAR(drive.observer.estimate(id).Z(), drive.scene.Z(id), .03) << i;
    }
  }
}

TEST(VisualMotionObserver, gapsLongerThanTwoOverTheGainNeedTheGuard) {
  const Eigen::Isometry3d start = at(0, 0, 1.5), guess = turned(at(.4, -.3, 1.2), .4, {1, 1, 1});
  Options options = plain(guess, ImageErrorMethod::iterated, 1.7);
  for (const bool isGuarded : {false, true}) {
    if (isGuarded) options.lostFrames = Options::LostFrames::guarded;
    Drive drive({kSolid, start}, options);
    for (int i = 0; i < 40; ++i) {
      drive.observer.correctPose(drive.scene.cMo);
      drive.move(cameraTwist(0), 1 / .8);
    }
    const double e = poseError(drive.observer.cMo().inverse() * drive.scene.cMo).norm();
    EXPECT_TRUE(isGuarded ? e < 1e-5 : e > 10) << e;
    EXPECT_NEAR(drive.observer.minimumFrameRate(), .8, 1e-9);
  }
}

TEST(VisualMotionObserver, lateImageMeetsThePoseOfItsExposure) {
  // At keT = 1.5 a correction applied one frame late would diverge. Images arrive late here, and
  // the pose between is asked for all the same.
  const double T = .1;
  const Eigen::Isometry3d start = at(0, 0, 1.5);
  Drive drive({kSolid, start},
              plain(turned(at(.3, 0, 1.2), .3, {0, 1, 1}), ImageErrorMethod::iterated, 15));
  MotionBuffer odometry(512);
  Scene scene{kSolid, start};
  std::vector<PointObservation> late = scene.image();
  double pose_error = 0;
  for (int i = 0; i < 60; ++i) {
    const Twist twist = cameraTwist(i * T);
    odometry.push(i * T, twist);
    odometry.holdUntil((i + 1) * T);
    scene.move(twist, T);
    drive.observer.advance(odometry, i * T);  // the image of this time comes only now
    drive.observer.correct(late);
    late = scene.image();
    const Eigen::Isometry3d now = drive.observer.cMo(odometry, (i + 1) * T);
    pose_error = poseError(now.inverse() * scene.cMo).norm();
  }
  EXPECT_LT(pose_error, 1e-5);
}

TEST(VisualMotionObserver, wholePosesCorrectAsImagesDo) {
  const Eigen::Isometry3d start = at(0, 0, 1.5), guess = turned(at(.2, 0, 1.4), .6, {1, 1, 0});
  Drive images({kSolid, start}, plain(guess, ImageErrorMethod::iterated));
  Drive poses({kSolid, start}, plain(guess, ImageErrorMethod::iterated));
  for (int i = 0; i < 20; ++i) {
    images.see();
    EXPECT_TRUE(poses.observer.correctPose(poses.scene.cMo));
    for (Drive* drive : {&images, &poses}) drive->move(cameraTwist(i / 20.), .05);
  }
  EXPECT_MATRIX_NEAR(images.observer.cMo().matrix(), poses.observer.cMo().matrix(), 1e-9);
  Eigen::Isometry3d bad = start;
  bad.translation().x() = std::nan("");
  EXPECT_FALSE(poses.observer.correctPose(bad));
}

TEST(VisualMotionObserver, coupledLawPullsTheEstimateTowardsTheGoal) {
  const Eigen::Isometry3d truth = at(0, 0, 1.5), goal = at(0, 0, .5);
  Options options = plain(truth, ImageErrorMethod::mixed);
  Drive cascade({kSolid, truth}, options);
  options.coupledGoal = goal;
  Drive coupled({kSolid, truth}, options);
  for (int i = 0; i < 100; ++i) {
    for (Drive* drive : {&cascade, &coupled}) {
      drive->see();
      drive->move({}, .03);
    }
  }
  EXPECT_NEAR(cascade.observer.estimate(0).Z(), 2, 1e-9);
  EXPECT_NEAR(coupled.observer.estimate(0).Z(), 1.5, .01) << "halfway: the bias of law (22)";
}

// ----------------------------------------------------------------------------------------------
// depths

TEST(VisualMotionObserver, givesEveryDepthFromTheFirstImageOn) {
  const Eigen::Isometry3d truth = turned(at(.2, -.1, 1.7), .6, {1, -1, .3});
  const Scene scene{kBox, truth};
  VisualMotionObserver observer(kBox, optionsFrom(at(0, 0, 1)));
  EXPECT_EQ(observer.estimate(0).status, DepthStatus::unset);
  observer.correct(scene.image(1e-3));
  for (int id = 0; id < 6; ++id) {
    const DepthEstimate e = observer.estimate(id);
    EXPECT_NEAR(e.Z(), scene.Z(id), 1e-8);
    EXPECT_EQ(e.status, DepthStatus::valid);
    EXPECT_EQ(e.x, scene.image()[static_cast<std::size_t>(id)].measurement.x);
    EXPECT_EQ(e.sigma_xy, 1e-3);
  }
}

TEST(VisualMotionObserver, needsNoPoseToStartWhenTheTargetFacesTheCamera) {
  for (const double Z : {.1, 1., 10., 90.}) {
    const Scene scene{kBox, turned(at(.4, -.2, 1.7), .5, {1, 1, .3})};
    VisualMotionObserver observer(kBox);
    EXPECT_TRUE(observer.setPrior(0, {Z}));
    observer.correct(scene.image());
    EXPECT_EQ(observer.verdict(), ImageVerdict::accepted) << Z;
    EXPECT_NEAR(observer.estimate(3).Z(), scene.Z(3), 1e-8) << Z;
  }
}

TEST(VisualMotionObserver, depthErrorStaysWithinItsBound) {
  Random random(5);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Isometry3d guess = at(0, 0, 2);
    const Eigen::Isometry3d truth = turned(
        guess * at(random.uniform(-.3, .3), random.uniform(-.3, .3), random.uniform(-.3, .3)),
        random.uniform(0, 1), random.direction());
    const Scene scene{kSolid, truth};
    VisualMotionObserver observer(kSolid, plain(guess, ImageErrorMethod::iterated));
    EXPECT_EQ(observer.depthErrorBound(0), kNever);
    observer.correct(scene.image());
    for (int id = 0; id < 4; ++id) {
      const double error = std::abs(observer.estimate(id).Z() - scene.Z(id));
      ASSERT_LE(error, observer.depthErrorBound(id) + 1e-9);
    }
  }
}

/// Share of depths within two sigma, after two seconds, over runs with noise.
double coverage(const Twist& target, double ke, double* meanSquare) {
  Random random(6);
  const double sigma = .5 / 800;
  int within = 0, count = 0;
  *meanSquare = 0;
  for (int run = 0; run < 20; ++run) {
    Scene scene{kSolid, turned(at(0, 0, 2), random.uniform(0, .5), random.direction())};
    scene.target = target;
    Drive drive(scene, optionsFrom(at(0, 0, 2), ke));
    for (int i = 0; i < 90; ++i) {
      drive.see(sigma, &random);
      if (i >= 60) {
        for (int id = 0; id < 4; ++id) {
          const DepthEstimate e = drive.observer.estimate(id);
          const double ratio = (e.Z() - drive.scene.Z(id)) / e.sigma_Z();
          within += std::abs(ratio) < 2;
          *meanSquare += ratio * ratio;
          ++count;
        }
      }
      drive.move({}, 1. / 30);
    }
  }
  *meanSquare /= count;
  return static_cast<double>(within) / count;
}

TEST(VisualMotionObserver, sigmaIsHonestForAStillTarget) {
  for (const double ke : {2., 9., 30.}) {
    double meanSquare = 0;
    EXPECT_GT(coverage({}, ke, &meanSquare), .93) << ke;
    EXPECT_GT(meanSquare, .3) << "not far too wide, ke " << ke;
    EXPECT_LT(meanSquare, 1.2) << ke;
  }
}

TEST(VisualMotionObserver, sigmaKnowsTheLagBehindAMovingTarget) {
  for (const double ke : {2., 9.}) {
    double meanSquare = 0;
    EXPECT_GT(coverage({{.05, 0, .2}, {0, .1, 0}}, ke, &meanSquare), .9) << ke;
    EXPECT_LT(meanSquare, 1.5) << ke;
  }
}

TEST(VisualMotionObserver, sigmaOfAHiddenMovingTargetGrows) {
  Scene scene{kBox, at(0, 0, 1)};
  scene.target.linear.z() = .1;
  Drive drive(scene, optionsFrom(scene.cMo));
  for (int i = 0; i < 60; ++i) {
    drive.see();
    drive.move({}, 1. / 30);
  }
  const double before = drive.observer.estimate(0).sigma_Z();
  drive.move({}, 1);
  const DepthEstimate e = drive.observer.estimate(0);
  EXPECT_GT(e.sigma_Z(), 5 * before);
  EXPECT_LT(std::abs(e.Z() - drive.scene.Z(0)), 2 * e.sigma_Z());
}

// ------------------------------------------------------------------------------------ hidden and
// refused

TEST(VisualMotionObserver, hiddenPointsCoastWhileFourAreSeenAndKeepTheirDepth) {
  Scene scene{kBox, at(0, 0, 1)};
  scene.target = {{.05, 0, .05}, {0, .2, 0}};
  Drive drive(scene, optionsFrom(scene.cMo));
  for (int i = 0; i < 60; ++i) {
    auto image = drive.scene.image();
    image.erase(image.begin(), image.begin() + 2);
    drive.observer.correct(image);
    ASSERT_EQ(drive.observer.verdict(), ImageVerdict::accepted);
    ASSERT_EQ(drive.observer.estimate(0).status, DepthStatus::coasting);
    ASSERT_EQ(drive.observer.estimate(2).status, DepthStatus::valid);
    ASSERT_NEAR(drive.observer.estimate(0).Z(), drive.scene.Z(0), .02);
    drive.move({}, 1. / 30);
  }
}

TEST(VisualMotionObserver, fewerThanFourPointsCoastOnOdometry) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see();
  for (int i = 0; i < 60; ++i) {
    drive.move(cameraTwist(i / 30.), 1. / 30);
    auto image = drive.scene.image();
    image.resize(3);
    drive.observer.correct(image);
    ASSERT_EQ(drive.observer.verdict(), ImageVerdict::tooFewPoints);
    for (int id = 0; id < 6; ++id) {
      ASSERT_EQ(drive.observer.estimate(id).status, DepthStatus::coasting);
      ASSERT_NEAR(drive.observer.estimate(id).Z(), drive.scene.Z(id), 1e-6);
    }
  }
  drive.see();
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::valid);
}

TEST(VisualMotionObserver, neverStartsWithFewerThanFourPoints) {
  VisualMotionObserver observer(kPlate);
  auto image = Scene{kPlate, at(0, 0, 1)}.image();
  image.resize(3);
  observer.correct(image);
  EXPECT_EQ(observer.estimate(0).status, DepthStatus::unset);
  EXPECT_EQ(observer.verdict(), ImageVerdict::tooFewPoints);
}

TEST(VisualMotionObserver, collinearPointsAreDegenerate) {
  const Points line{{-.2, 0, 0}, {-.1, 0, 0}, {.1, 0, 0}, {.2, 0, 0}, {.3, 0, 0}};
  const Scene scene{line, turned(at(0, .1, 1), .3, {1, 2, 1})};
  for (const Eigen::Isometry3d& guess : {scene.cMo, at(0, 0, 1)}) {
    VisualMotionObserver observer(line, optionsFrom(guess));
    observer.correct(scene.image(1e-3));
    EXPECT_EQ(observer.verdict(), ImageVerdict::degenerate);
    EXPECT_EQ(observer.estimate(0).status, DepthStatus::unset);
  }
}

TEST(VisualMotionObserver, plateSeenEdgeOnStillTellsItsPose) {
  const Scene scene{kPlate, turned(at(0, 0, 1), M_PI / 2, {1, 0, 0})};
  VisualMotionObserver observer(kPlate, optionsFrom(turned(scene.cMo, .2, {1, 1, 0})));
  observer.correct(scene.image(1e-4));
  EXPECT_EQ(observer.verdict(), ImageVerdict::accepted);
  EXPECT_NEAR(observer.estimate(0).Z(), scene.Z(0), 1e-8);
}

/// Three places of a plate, one of them twice, with the camera on the cylinder over their circle:
/// the Jacobian has rank 5. The fourth corner, on the same circle, lifts it to 6.
TEST(VisualMotionObserver, coplanarPointsSeenFromTheirDangerousCylinderAreDegenerate) {
  const double radius = .1 * std::sqrt(2.0);
  for (const double direction : {.3, 1., 2.}) {
    const Eigen::Isometry3d onCylinder =
        turned(at(0, 0, 0), .2, {1, 2, 0}) *
        at(radius * std::cos(direction), radius * std::sin(direction), 1);
    const Points three{kPlate[0], kPlate[1], kPlate[2], kPlate[2]};
    VisualMotionObserver observer(three, optionsFrom(onCylinder));
    observer.correct(Scene{three, onCylinder}.image(1e-3));
    EXPECT_EQ(observer.verdict(), ImageVerdict::degenerate);
    EXPECT_EQ(observer.estimate(0).status, DepthStatus::unset);
    VisualMotionObserver better(kPlate, optionsFrom(onCylinder));
    better.correct(Scene{kPlate, onCylinder}.image(1e-3));
    EXPECT_EQ(better.verdict(), ImageVerdict::accepted);
  }
}

TEST(VisualMotionObserver, pointThatCoincidesWithAnotherLeavesTooLittle) {
  const Points three{{.1, .1, 0}, {-.1, .1, 0}, {0, -.1, 0}, {0, -.1, 0}};
  const Points two{{.1, .1, 0}, {.1, .1, 0}, {0, -.1, 0}, {0, -.1, 0}};
  for (const Points& points : {two, Points(4, Eigen::Vector3d(.1, .1, 0)), Points(4, {0, 0, 0})}) {
    VisualMotionObserver observer(points, optionsFrom(at(0, 0, 1)));
    observer.correct(Scene{points, at(0, 0, 1)}.image(1e-3));
    EXPECT_EQ(observer.verdict(), ImageVerdict::degenerate);
  }
  VisualMotionObserver observer(three, optionsFrom(at(0, 0, 1)));
  observer.correct(Scene{three, at(0, 0, 1)}.image(1e-3));
  EXPECT_TRUE(observer.estimate(0).status == DepthStatus::unset ||
              std::isfinite(observer.estimate(0).sigma_Z()));
}

TEST(VisualMotionObserver, degenerateImageIsRejectedAndTheNextOneUsed) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see();
  drive.move({}, .03);
  drive.observer.correct(drive.scene.image(10));  // so vague that it says nothing
  EXPECT_EQ(drive.observer.verdict(), ImageVerdict::degenerate);
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::rejected);
  drive.move({}, .03);
  drive.see();
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::valid);
}

TEST(VisualMotionObserver, targetBehindTheCameraIsLost) {
  const auto image = Scene{kBox, at(0, 0, 1)}.image();
  for (const double Z : {-1., 0., .04}) {
    VisualMotionObserver observer(kBox, optionsFrom(at(0, 0, Z)));
    observer.correct(image);
    EXPECT_EQ(observer.verdict(), ImageVerdict::behindCamera);
    EXPECT_EQ(observer.estimate(0).status, DepthStatus::lost);
    EXPECT_GE(observer.estimate(0).Z(), observer.range().Z_min * (1 - 1e-12));
  }
}

TEST(VisualMotionObserver, cameraThatDrivesPastTheTargetLosesIt) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see();
  drive.move({{0, 0, 2}, {0, 0, 0}}, 1);
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::lost);
  EXPECT_TRUE(std::isfinite(drive.observer.estimate(0).Z()));
}

TEST(VisualMotionObserver, rotationBeyondItsReachIsLostUntilAPoseIsGiven) {
  for (const double angle : {1.5, M_PI / 2 + .1, 2., 3.1}) {
    const Eigen::Isometry3d truth = turned(at(0, 0, 1), angle, {0, 0, 1});
    Drive drive({kBox, truth}, optionsFrom(at(0, 0, 1)));
    drive.see();
    const ImageVerdict verdict = drive.observer.verdict();
    EXPECT_TRUE(verdict == ImageVerdict::rotationTooLarge || verdict == ImageVerdict::inconsistent);
    EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::lost) << angle;
    drive.move({}, .03);
    EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::lost) << "still, " << angle;
    EXPECT_TRUE(drive.observer.reset(turned(truth, .2, {1, 0, 0})));
    drive.see();
    EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::valid) << angle;
    EXPECT_NEAR(drive.observer.estimate(0).Z(), drive.scene.Z(0), 1e-8) << angle;
  }
}

TEST(VisualMotionObserver, targetThatTurnedAwayUnseenIsLost) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see();
  drive.scene.target.angular.z() = 2;
  drive.move({}, 1);
  drive.scene.target = {};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NE(drive.observer.estimate(0).status, DepthStatus::lost);
    drive.see();
    EXPECT_NE(drive.observer.estimate(0).status, DepthStatus::valid);
  }
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::lost);
}

TEST(VisualMotionObserver, resetRefusesWhatIsNoPose) {
  VisualMotionObserver observer(kBox, optionsFrom(at(0, 0, 1)));
  Eigen::Isometry3d mirrored = at(0, 0, 1), scaled = at(0, 0, 1), nan = at(0, 0, std::nan(""));
  mirrored.linear()(0, 0) = -1;
  scaled.linear() *= 2;
  for (const Eigen::Isometry3d& bad : {mirrored, scaled, nan}) {
    EXPECT_FALSE(observer.reset(bad));
    EXPECT_MATRIX_NEAR(observer.cMo().matrix(), at(0, 0, 1).matrix(), 0);
  }
}

TEST(VisualMotionObserver, wrongPointIsRejectedOnceThereIsOneToSpare) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  for (int i = 0; i < 10; ++i) {
    drive.see(1e-3);
    drive.move({}, 1. / 30);
  }
  auto image = drive.scene.image(1e-3);
  image[1].measurement.x += .2;
  drive.observer.correct(image);
  EXPECT_EQ(drive.observer.verdict(), ImageVerdict::inconsistent);
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::rejected);
  EXPECT_NEAR(drive.observer.estimate(0).Z(), drive.scene.Z(0), 1e-8);
  drive.move({}, 1. / 30);
  drive.see(1e-3);
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::valid);
}

TEST(VisualMotionObserver, pointsThatNeverFitAreGivenUp) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see(1e-3);
  for (int i = 0; i < 10; ++i) {
    drive.move({}, 1. / 30);
    auto image = drive.scene.image(1e-3);
    std::swap(image[0].measurement, image[2].measurement);
    drive.observer.correct(image);
  }
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::lost);
}

TEST(VisualMotionObserver, unknownAndRepeatedIdsAreIgnoredAndCounted) {
  const Scene scene{kBox, at(0, 0, 1)};
  auto image = scene.image();
  image.push_back({-1, {.5, .5, 0}});
  image.push_back({6, {.5, .5, 0}});
  image.push_back({1, {.5, .5, 0}});
  VisualMotionObserver observer(kBox, optionsFrom(at(0, 0, 1)));
  observer.correct(image);
  EXPECT_EQ(observer.ignored(), 3u);
  EXPECT_NEAR(observer.estimate(1).Z(), 1, 1e-9);
  EXPECT_EQ(observer.estimate(6).status, DepthStatus::unset);
  EXPECT_FALSE(observer.setPrior(6, {1}));
}

TEST(VisualMotionObserver, measurementThatIsNoNumberCountsAsHidden) {
  auto image = Scene{kBox, at(0, 0, 1)}.image();
  image[2].measurement.x = std::nan("");
  image[4].measurement.sigma = -1;
  VisualMotionObserver observer(kBox, optionsFrom(at(0, 0, 1)));
  observer.correct(image);
  EXPECT_EQ(observer.estimate(0).status, DepthStatus::valid);
  EXPECT_EQ(observer.estimate(2).status, DepthStatus::coasting);
  EXPECT_NEAR(observer.estimate(2).x, -.1, 1e-9);
}

// ---------------------------------------------------------------------------- contract of the base
// class

double garbage(Random& random) {
  static const double kValues[] = {std::nan(""), kNever, -kNever, 0,      -1,   1e-310,
                                   1e-12,        1e8,    1e100,   -1e150, 1e300};
  const int i = random.integer(0, 59);
  return i < 11 ? kValues[i] : random.uniform(-1, 1);
}

TEST(VisualMotionObserver, estimateIsFiniteAndInRangeWhateverComesIn) {
  for (const bool isGuarded : {true, false}) {
    Options options;
    if (!isGuarded) options.lostFrames = Options::LostFrames::unguarded;
    if (!isGuarded) options.coupledGoal = at(0, 0, 1);
    VisualMotionObserver observer(kBox, options);
    MotionBuffer odometry(64);
    Random random(8);
    const DepthRange range = observer.range();
    double t = 0;
    for (int i = 0; i < 30000; ++i) {
      const int what = random.integer(0, 11);
      if (what == 0) {
        Eigen::Isometry3d g = at(garbage(random), garbage(random), garbage(random));
        g.linear()(0, 1) = garbage(random);
        observer.reset(g);
        observer.correctPose(g);
      } else if (what == 1) {
        observer.setPrior(random.integer(-1, 6), {garbage(random), garbage(random)});
        observer.correctDepth(random.integer(-1, 6), {garbage(random), garbage(random)});
      } else if (what == 2 && random.integer(0, 9) == 0) {
        observer.reset();
      } else if (what < 6) {
        const Twist twist{{garbage(random), garbage(random), garbage(random)},
                          {garbage(random), garbage(random), garbage(random)}};
        odometry.push(t, twist);
        t += random.uniform(0, .1);
        observer.advance(odometry, random.integer(0, 9) == 0 ? garbage(random) : t);
      } else {
        auto image =
            Scene{kBox, turned(at(0, 0, 1), random.uniform(0, 1), random.direction())}.image();
        if (what < 9) {
          for (auto& o : image) o.measurement = {garbage(random), garbage(random), garbage(random)};
          image[0].id = random.integer(-5, 10);
        }
        observer.correct(image);
      }
      ASSERT_TRUE(observer.cMo().matrix().allFinite()) << i;
      for (int id = -1; id < 7; ++id) {
        for (const DepthEstimate& e : {observer.estimate(id), observer.estimate(id, odometry, t)}) {
          ASSERT_TRUE(std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.sigma_Z()) &&
                      std::isfinite(e.sigma_xy) && std::isfinite(e.sigma_chi))
              << "step " << i << ", status " << toString(e.status);
          ASSERT_GE(e.Z(), range.Z_min * (1 - 1e-12));
          ASSERT_LE(e.Z(), range.Z_max * (1 + 1e-12));
          ASSERT_GE(e.sigma_chi, 0);
        }
      }
    }
    // From here on all is well.
    observer.reset();
    Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
    drive.observer = observer;
    drive.observer.advance(drive.odometry, 0);
    for (int i = 0; i < 100; ++i) {
      drive.see(1e-3);
      drive.move({}, 1. / 30);
    }
    drive.see(1e-3);
    const DepthEstimate e = drive.observer.estimate(0);
    EXPECT_EQ(e.status, DepthStatus::valid);
    EXPECT_NEAR(e.Z(), 1, 1e-6);
  }
}

TEST(VisualMotionObserver, lateOdometryLeavesEverythingUntilItHasArrived) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see();
  drive.move(cameraTwist(0), .1);
  const Eigen::Isometry3d before = drive.observer.cMo();
  EXPECT_EQ(drive.observer.advance(drive.odometry, .12), Coverage::afterEnd);
  EXPECT_EQ(drive.observer.advance(drive.odometry, -1), Coverage::reversed);
  EXPECT_EQ(drive.observer.advance(drive.odometry, std::nan("")), Coverage::reversed);
  EXPECT_EQ(drive.observer.time(), .1);
  EXPECT_MATRIX_NEAR(drive.observer.cMo().matrix(), before.matrix(), 0);
}

TEST(VisualMotionObserver, odometryThatStartsLaterStartsAnewFromTheLastPose) {
  VisualMotionObserver observer(kBox, optionsFrom(at(0, 0, 1)));
  MotionBuffer empty;
  observer.advance(empty, 0);
  observer.correct(Scene{kBox, at(0, 0, 2)}.image());
  EXPECT_EQ(observer.advance(empty, .5), Coverage::empty);
  EXPECT_EQ(observer.time(), .5);
  EXPECT_EQ(observer.estimate(0).status, DepthStatus::unset);
  EXPECT_NEAR(observer.estimate(0).Z(), 2, 1e-9) << "kept as a guess";
  observer.correct(Scene{kBox, at(.3, 0, 2.5)}.image());
  EXPECT_NEAR(observer.estimate(0).Z(), 2.5, 1e-9);
}

TEST(VisualMotionObserver, resetForgetsAndClonesAreIndependent) {
  Drive drive({kBox, at(0, 0, 1)}, optionsFrom(at(0, 0, 1)));
  drive.see();
  const auto clone = drive.observer.clone();
  drive.observer.reset();
  EXPECT_TRUE(std::isnan(drive.observer.time()));
  EXPECT_EQ(drive.observer.estimate(0).status, DepthStatus::unset);
  EXPECT_EQ(drive.observer.verdict(), ImageVerdict::none);
  EXPECT_EQ(clone->estimate(0).status, DepthStatus::valid);
  EXPECT_EQ(clone->time(), 0);
}

}  // namespace
}  // namespace depthservo
