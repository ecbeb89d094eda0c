#include <gtest/gtest.h>
#include <visp3/vs/vpServo.h>

#include <cmath>
#include <vector>

#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/features/FeatureMoments.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "support/FourPointScene.h"
#include "support/MatrixMatchers.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using namespace test;
using Points = std::vector<Eigen::Vector3d>;  // in the camera frame
using Matrix36 = Eigen::Matrix<double, 3, 6>;

Matrix36 eigen(const vpMatrix& L) {
  EXPECT_EQ(L.getRows(), 3u);
  EXPECT_EQ(L.getCols(), 6u);
  return Eigen::Map<const Eigen::Matrix<double, 3, 6, Eigen::RowMajor>>(L.data);
}

/// The features by their definition.
Eigen::Vector3d features(const Points& points, double scale) {
  const double n = static_cast<double>(points.size());
  double xg = 0, yg = 0, a = 0;
  for (const auto& p : points) {
    xg += p.x() / p.z() / n;
    yg += p.y() / p.z() / n;
  }
  for (const auto& p : points) {
    a += std::pow(p.x() / p.z() - xg, 2) + std::pow(p.y() / p.z() - yg, 2);
  }
  return {xg, yg, scale / std::sqrt(a)};
}

std::vector<PointState> states(const Points& points) {
  std::vector<PointState> result;
  for (const auto& p : points) result.push_back({p.x() / p.z(), p.y() / p.z(), 1 / p.z()});
  return result;
}

std::vector<DepthEstimate> estimates(const Points& points, double sigma_chi = .1) {
  std::vector<DepthEstimate> result;
  for (const PointState& p : states(points)) {
    DepthEstimate e;
    e.x = p.x;
    e.y = p.y;
    e.chi = p.chi;
    e.sigma_chi = sigma_chi;
    e.status = DepthStatus::valid;
    result.push_back(e);
  }
  return result;
}

/// n points on a plane tilted by up to 60 degrees, about 1 m away.
Points tilted(Random& random, int n) {
  const Eigen::Vector3d axis = Eigen::Vector3d(random.normal(1), random.normal(1), 0).normalized();
  const Eigen::Matrix3d R = Eigen::AngleAxisd(random.uniform(-1, 1), axis).matrix();
  const Eigen::Vector3d centre(random.uniform(-.3, .3), random.uniform(-.3, .3),
                               random.uniform(.7, 2));
  Points points;
  for (int i = 0; i < n; ++i) {
    points.push_back(centre +
                     R * Eigen::Vector3d(random.uniform(-.2, .2), random.uniform(-.2, .2), 0));
  }
  return points;
}

TEST(FeatureMoments, interactionMatrixIsTheDerivativeOfTheFeaturesOnTiltedPlanes) {
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const Points points = tilted(random, random.integer(3, 9));
    FeatureMoments s(0.7);
    s.update(estimates(points));
    if (s.planeStatus() != MomentsPlane::fitted) continue;  // three points nearly on a line
    ASSERT_NEAR(
        (Eigen::Vector3d(s.get_xg(), s.get_yg(), s.get_size()) - features(points, .7)).norm(), 0,
        1e-12);
    Matrix36 L;
    for (int j = 0; j < 6; ++j) {
      const double h = 1e-5;
      const auto moved = [&](double step) {
        Points now = points;
        for (auto& p : now) {
          const Eigen::Vector3d axis = Eigen::Vector3d::Unit(j % 3);
          if (j < 3) {
            p -= step * axis;
          } else {
            p = Eigen::AngleAxisd(-step, axis) * p;
          }
        }
        return features(now, .7);
      };
      L.col(j) = (moved(h) - moved(-h)) / (2 * h);
    }
    const double size = std::max(1., L.cwiseAbs().maxCoeff());
    EXPECT_MATRIX_NEAR((eigen(s.interaction()) / size).eval(), (L / size).eval(), 1e-7);
  }
}

TEST(FeatureMoments, planeIsTheOneThePointsAreOn) {
  const Eigen::Vector3d abc(.3, -.2, .8);
  std::vector<PointState> points;
  for (double x : {-.2, .1, .3}) {
    for (double y : {-.1, .2}) points.push_back({x, y, abc.dot(Eigen::Vector3d(x, y, 1))});
  }
  FeatureMoments s;
  EXPECT_EQ(s.planeStatus(), MomentsPlane::unset);
  s.buildFrom(points);
  EXPECT_EQ(s.planeStatus(), MomentsPlane::fitted);
  EXPECT_MATRIX_NEAR(s.plane(), abc, 1e-12);
  EXPECT_NEAR(1 / s.Z(), abc.dot(Eigen::Vector3d(s.get_xg(), s.get_yg(), 1)), 1e-12);
}

TEST(FeatureMoments, vagueDepthDoesNotTiltThePlane) {
  Random random(2);
  const Points points = tilted(random, 6);
  std::vector<DepthEstimate> seen = estimates(points, 1e-3);
  FeatureMoments exact, s, equally;
  exact.update(seen);
  seen[2].chi *= 2;
  std::vector<PointState> same;
  for (const DepthEstimate& p : seen) same.push_back({p.x, p.y, p.chi});
  seen[2].sigma_chi = 5;
  s.update(seen);
  equally.buildFrom(same);
  EXPECT_MATRIX_NEAR(s.plane(), exact.plane(), 1e-5);
  EXPECT_GT((equally.plane() - exact.plane()).norm(), .1) << "so the weights matter";
}

TEST(FeatureMoments, collinearPointsGiveAFacingPlaneAndSaySo) {
  for (double width : {0., 1e-12, 1e-3}) {
    std::vector<PointState> points;
    for (int i = 0; i < 5; ++i) {
      const double x = .05 * i, off = i % 2 ? width : -width;
      points.push_back({x - off, 2 * x + off, 1 + (i % 2 ? .02 : -.02)});  // noisy depths
    }
    FeatureMoments s;
    s.buildFrom(points);
    EXPECT_EQ(s.planeStatus(), MomentsPlane::frontoParallel) << width;
    EXPECT_NEAR(s.Z(), 1, .01);
    EXPECT_EQ(s.plane().head<2>().norm(), 0);
    EXPECT_LT(eigen(s.interaction()).cwiseAbs().maxCoeff(), 30);
  }
  FeatureMoments two;
  two.buildFrom({{0, 0, 1}, {.1, .1, 1.5}});
  EXPECT_EQ(two.planeStatus(), MomentsPlane::frontoParallel);
}

TEST(FeatureMoments, depthsThatPutAPointBehindTheCameraGiveAFacingPlane) {
  FeatureMoments s;
  s.buildFrom({{-.1, -.1, .05}, {.1, -.1, 5}, {.1, .1, 5}, {-.1, .1, .05}, {-.3, 0, .05}});
  EXPECT_EQ(s.planeStatus(), MomentsPlane::frontoParallel);
  EXPECT_NEAR(1 / s.Z(), 10.15 / 5, 1e-12);
}

TEST(FeatureMoments, pointsThatCannotBeUsedLeaveTheFeaturesAsTheyWere) {
  FeatureMoments s;
  const std::vector<PointState> good{{-.1, -.1, 1}, {.1, -.1, 1}, {.1, .1, 1}, {-.1, .1, 1}};
  s.buildFrom({});
  EXPECT_EQ(s.planeStatus(), MomentsPlane::unset);
  s.buildFrom(good);
  const Matrix36 L = eigen(s.interaction());
  const std::vector<std::vector<PointState>> bad{{},
                                                 {{.1, .1, 1}, {.1, .1, 1}},
                                                 {{NAN, 0, 1}, {1, 1, 1}, {2, 0, 1}},
                                                 {{0, 0, INFINITY}, {1, 1, 1}, {2, 0, 1}}};
  for (const auto& points : bad) {
    s.buildFrom(points);
    EXPECT_EQ(s.planeStatus(), MomentsPlane::unusable);
    EXPECT_EQ(s.get_xg(), 0);
    EXPECT_EQ(eigen(s.interaction()), L);
  }
  s.buildFrom(good);
  EXPECT_EQ(s.planeStatus(), MomentsPlane::fitted);
}

TEST(FeatureMoments, scaleGivesTheThirdFeatureItsValueAtTheGoal) {
  Random random(3);
  const Points atGoal = tilted(random, 4);
  FeatureMoments s(FeatureMoments::scaleFor(states(atGoal), 2.5));
  s.buildFrom(states(atGoal));
  EXPECT_NEAR(s.get_size(), 2.5, 1e-12);
}

TEST(FeatureMoments, selectPicksRowsAndErrors) {
  Random random(4);
  FeatureMoments s, sd;
  s.buildFrom(states(tilted(random, 4)));
  sd.buildFrom(states(tilted(random, 4)));
  const unsigned select = FeatureMoments::selectXg() | FeatureMoments::selectSize();
  const vpMatrix L = s.interaction(select);
  ASSERT_EQ(L.getRows(), 2u);
  for (unsigned j = 0; j < 6; ++j) {
    EXPECT_EQ(L[0][j], s.interaction()[0][j]);
    EXPECT_EQ(L[1][j], s.interaction()[2][j]);
  }
  const vpColVector e = s.error(sd, select);
  ASSERT_EQ(e.size(), 2u);
  EXPECT_EQ(e[0], s.get_xg() - sd.get_xg());
  EXPECT_EQ(e[1], s.get_size() - sd.get_size());
}

TEST(FeatureMoments, copiesAreIndependent) {
  Random random(5);
  FeatureMoments s(.5);
  s.buildFrom(states(tilted(random, 4)));
  FeatureMoments copy(s), assigned;
  assigned = s;
  const std::unique_ptr<FeatureMoments> duplicate(s.duplicate());
  const double before = s.get_size();
  s.buildFrom(states(tilted(random, 4)));
  EXPECT_NE(s.get_size(), before);
  for (const FeatureMoments* other : {&copy, &assigned, duplicate.get()}) {
    EXPECT_EQ(other->get_size(), before);
    EXPECT_EQ(other->planeStatus(), MomentsPlane::fitted);
  }
}

/// A servo of a free camera on moments and two points of a group; the rotations need the points.
TEST(FeatureMoments, bringsTheCameraHomeBesidePointsFromAWrongGuess) {
  const std::unique_ptr<PointSetEstimator> estimators[] = {
      PointwiseEstimator(NonlinearDepthObserver(), 4).clone(), ObjectDepthObserver(4).clone()};
  for (const auto& estimator : estimators) {
    FourPointScene scene;
    FeaturePointGroup points(*estimator, 4);
    std::vector<vpFeaturePoint> desired(4);
    std::vector<PointState> atGoal;
    for (std::size_t i = 0; i < 4; ++i) {
      vpPoint p = scene.desired(i);
      vpFeatureBuilder::create(desired[i], p);
      atGoal.push_back({p.get_x(), p.get_y(), 1 / p.get_Z()});
      points[i].set_Z(3);
      points[i].setServoDepth(ServoDepth::observed);  // it is the moments that are tested
    }
    const double scale = FeatureMoments::scaleFor(atGoal);
    FeatureMoments s(scale), sd(scale);
    sd.buildFrom(atGoal);
    vpServo task;
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(vpServo::CURRENT);
    task.setLambda(0.8);
    task.addFeature(s, sd);
    for (std::size_t i : {0, 2}) task.addFeature(points[i], desired[i]);
    vpColVector v(6, 0.);
    for (int k = 0; k < 450; ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        points[i].set_x(scene.seen(i).get_x());
        points[i].set_y(scene.seen(i).get_y());
      }
      points.observe(v, kPeriod_s);
      s.update(points);
      v = scene.apply(task.computeControlLaw());
    }
    EXPECT_LT(task.getError().frobeniusNorm(), 1e-3);
    EXPECT_NEAR(s.get_size(), 1, 1e-3);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(scene.seen(i).get_x(), desired[i].get_x(), 1e-3);
      EXPECT_NEAR(scene.seen(i).get_y(), desired[i].get_y(), 1e-3);
    }
  }
}

TEST(FeatureMoments, taskOwnsItsZeroDesiredFeature) {
  Random random(6);
  FeatureMoments s;
  s.buildFrom(states(tilted(random, 4)));
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.addFeature(s);
  task.computeControlLaw();
  EXPECT_EQ(task.getError()[0], s.get_xg());
}

}  // namespace
}  // namespace depthservo
