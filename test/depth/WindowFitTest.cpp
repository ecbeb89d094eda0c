// The window's fits against truth by plain projection, and their statistics over fixed seeds.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "depthservo/depth/WindowFit.h"
#include "support/Random.h"

namespace depthservo {
namespace {

using test::Random;

constexpr double kSigma = 1.0 / 600;

/// A point and a camera at several places; place 0 is where it is now.
struct Scene {
  Eigen::Vector3d wP;
  std::vector<Eigen::Isometry3d> wMc;

  Eigen::Vector3d seenFrom(std::size_t i) const { return wMc[i].inverse() * wP; }
  double chi() const { return 1 / seenFrom(0).z(); }

  std::vector<WindowImage> images(double sigma = 0, Random* random = nullptr) const {
    std::vector<WindowImage> result;
    for (std::size_t i = 0; i < wMc.size(); ++i) {
      const Eigen::Vector3d p = seenFrom(i);
      const Eigen::Isometry3d thereMnow = wMc[i].inverse() * wMc[0];
      WindowImage image;
      image.point = {p.x() / p.z(), p.y() / p.z(), sigma};
      if (random) {
        image.point.x += random->normal(sigma);
        image.point.y += random->normal(sigma);
      }
      image.toThere.R = thereMnow.linear();
      image.toThere.t = thereMnow.translation();
      result.push_back(image);
    }
    return result;
  }

  /// A camera that walks, with turns, by `step` [m] between images; the point is ahead of it.
  static Scene walk(Random& random, std::size_t images, double Z, double step) {
    Scene scene;
    scene.wP = Eigen::Vector3d(random.uniform(-.3, .3) * Z, random.uniform(-.3, .3) * Z, Z);
    const Eigen::Vector3d direction = random.direction(), axis = random.direction();
    for (std::size_t i = 0; i < images; ++i) {
      const auto k = static_cast<double>(i);
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = Eigen::AngleAxisd(0.01 * k, axis).matrix();
      pose.translation() = -k * step * direction + random.vector(0.1 * step);
      if (i == 0) pose.setIdentity();
      scene.wMc.push_back(pose);
    }
    return scene;
  }
};

using Fit = WindowFit (*)(const WindowImages&);

WindowFit fitted(const std::vector<WindowImage>& images, Fit fit) {
  return fit({images.front(), images.data() + 1, images.size() - 1});
}

struct NamedFit {
  const char* name;
  Fit fit;
};
class EveryWindowFit : public ::testing::TestWithParam<NamedFit> {};
INSTANTIATE_TEST_SUITE_P(Methods, EveryWindowFit,
                         ::testing::Values(NamedFit{"LeastSquares", fitLeastSquares},
                                           NamedFit{"MaximumLikelihood", fitMaximumLikelihood},
                                           NamedFit{"Robust", fitRobustly}),
                         [](const auto& method) { return method.param.name; });

TEST_P(EveryWindowFit, perfectDataAreExactFromOneEarlierImageOn) {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    for (std::size_t images : {2u, 3u, 21u}) {
      const Scene scene = Scene::walk(random, images, random.uniform(2, 4), 0.06);
      const WindowFit fit = fitted(scene.images(), GetParam().fit);
      // Rounding of the images (1e-16) over the parallax of two of them (|B|, mostly 0.06 m).
      double S = 0;
      for (std::size_t j = 1; j < images; ++j) {
        const Eigen::Vector3d c = scene.wMc[0].inverse() * scene.wMc[j].translation();
        const Eigen::Vector3d u = scene.seenFrom(0) * scene.chi();
        S += (c.head<2>() - u.head<2>() * c.z()).squaredNorm();
      }
      if (S < 0.03 * 0.03) continue;  // hardly any parallax
      ASSERT_EQ(fit.degeneracy, WindowDegeneracy::none);
      ASSERT_NEAR(1 / fit.chi(), 1 / scene.chi(), 1e-12) << images << " images";
    }
  }
}

TEST_P(EveryWindowFit, oneImageHasNoBaseline) {
  const Scene scene{{.1, .2, 2}, {Eigen::Isometry3d::Identity()}};
  EXPECT_EQ(fitted(scene.images(kSigma), GetParam().fit).degeneracy, WindowDegeneracy::noBaseline);
}

TEST_P(EveryWindowFit, rotationAboutTheOpticalCentreHasNoBaseline) {
  Scene scene{{.1, .2, 2}, {}};
  for (int i = 0; i < 10; ++i) {
    scene.wMc.emplace_back(Eigen::AngleAxisd(0.03 * i, Eigen::Vector3d(1, 2, 1).normalized()));
  }
  const WindowFit fit = fitted(scene.images(kSigma), GetParam().fit);
  EXPECT_EQ(fit.degeneracy, WindowDegeneracy::noBaseline);
}

TEST_P(EveryWindowFit, pointOnTheLineOfTranslationHasNoBaseline) {
  Scene scene{{.2, -.1, 2}, {}};
  for (int i = 0; i < 10; ++i) {
    scene.wMc.emplace_back(Eigen::Translation3d(-0.05 * i * scene.wP.normalized()));
  }
  EXPECT_EQ(fitted(scene.images(kSigma), GetParam().fit).degeneracy, WindowDegeneracy::noBaseline);
}

TEST_P(EveryWindowFit, identicalPosesHaveNoBaseline) {
  const Scene scene{{.1, .2, 2}, std::vector<Eigen::Isometry3d>(10, Eigen::Isometry3d::Identity())};
  Random random(1);
  EXPECT_EQ(fitted(scene.images(kSigma, &random), GetParam().fit).degeneracy,
            WindowDegeneracy::noBaseline);
}

TEST_P(EveryWindowFit, imageBehindTheCameraIsAContradiction) {
  Scene scene{{.1, .2, 2}, {Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()}};
  scene.wMc[1].translation() << .1, 0, 0;
  std::vector<WindowImage> images = scene.images(kSigma);
  images[1].toThere.R = Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY()).matrix();
  const WindowFit fit = fitted(images, GetParam().fit);
  EXPECT_EQ(fit.degeneracy, WindowDegeneracy::behind);
  EXPECT_TRUE(fit.point.allFinite());
}

TEST_P(EveryWindowFit, parallaxTheWrongWayIsBeyondInfinity) {
  Scene scene{{.1, .2, 2}, {Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()}};
  scene.wMc[1].translation() << .1, 0, 0;
  std::vector<WindowImage> images = scene.images(kSigma);
  images[1].point.x += 0.1;  // true parallax: -0.05
  const WindowFit fit = fitted(images, GetParam().fit);
  EXPECT_EQ(fit.degeneracy, WindowDegeneracy::infinity);
  EXPECT_LT(fit.chi(), 0);
}

TEST_P(EveryWindowFit, longerTranslationMakesTheDepthLongerByAsMuch) {
  Random random(2);
  const Scene scene = Scene::walk(random, 11, 2, 0.05);
  std::vector<WindowImage> images = scene.images();
  for (WindowImage& image : images) image.toThere.t *= 1.02;
  EXPECT_NEAR(1 / fitted(images, GetParam().fit).chi(), 1.02 / scene.chi(), 1e-10);
}

TEST_P(EveryWindowFit, valuesThatAreNotNumbersAreADegeneracy) {
  Random random(3);
  const Scene scene = Scene::walk(random, 5, 2, 0.05);
  for (double bad : {std::nan(""), double(INFINITY), 1e300}) {
    std::vector<WindowImage> images = scene.images(kSigma);
    images[2].toThere.t.x() = bad;
    EXPECT_NE(fitted(images, GetParam().fit).degeneracy, WindowDegeneracy::none) << bad;
    images = scene.images(kSigma);
    images[2].toThere.R(2, 2) = bad;
    const WindowFit fit = fitted(images, GetParam().fit);
    if (fit.degeneracy == WindowDegeneracy::none) {
      EXPECT_TRUE(fit.point.allFinite() && fit.covariance.allFinite()) << bad;
    }
  }
}

TEST(WindowLeastSquares, isTheSolutionOfTheStackedLinearSystem) {
  // m_0 (q3 chi-free form): (R u + t chi_j Z_j...) eliminated numerically: rows (m - A, B) by
  // finite chi, solved by QR.
  Random random(4);
  for (int run = 0; run < 50; ++run) {
    const Scene scene = Scene::walk(random, 12, 2, 0.05);
    const std::vector<WindowImage> images = scene.images(kSigma, &random);
    // The newest image of a point at depth Z of an earlier one is affine in its own inverse depth.
    Eigen::VectorXd B(22), r(22);
    for (std::size_t j = 1; j < images.size(); ++j) {
      const Eigen::Isometry3d nowMthere = scene.wMc[0].inverse() * scene.wMc[j];
      const auto at = [&](double Z) {
        return Eigen::Vector3d(nowMthere *
                               Eigen::Vector3d(images[j].point.x * Z, images[j].point.y * Z, Z));
      };
      const Eigen::Vector3d a = at(1.5), b = at(4);
      const Eigen::Vector2d slope =
          (a.head<2>() / a.z() - b.head<2>() / b.z()) / (1 / a.z() - 1 / b.z());
      const Eigen::Vector2d atInfinity = a.head<2>() / a.z() - slope / a.z();
      const auto row = static_cast<Eigen::Index>(2 * (j - 1));
      B.segment<2>(row) = slope;
      r.segment<2>(row) = Eigen::Vector2d(images[0].point.x, images[0].point.y) - atInfinity;
    }
    const Eigen::VectorXd chi = Eigen::MatrixXd(B).colPivHouseholderQr().solve(r);
    EXPECT_NEAR(fitted(images, fitLeastSquares).chi(), chi[0], 1e-11);
  }
}

TEST(WindowMaximumLikelihood, isTheMinimumOfTheDistancesToAllImages) {
  Random random(5);
  for (int run = 0; run < 20; ++run) {
    const Scene scene = Scene::walk(random, 21, 2, 0.03);
    const std::vector<WindowImage> images = scene.images(kSigma, &random);
    const auto cost = [&](const Eigen::Vector3d& p) {
      double sum = 0;
      for (const WindowImage& image : images) {
        const Eigen::Vector3d q =
            image.toThere.R * Eigen::Vector3d(p.x(), p.y(), 1) / p.z() + image.toThere.t;
        sum +=
            std::pow(image.point.x - q.x() / q.z(), 2) + std::pow(image.point.y - q.y() / q.z(), 2);
      }
      return sum / (kSigma * kSigma);
    };
    const WindowFit fit = fitted(images, fitMaximumLikelihood);
    EXPECT_NEAR(fit.cost, cost(fit.point), 1e-9 * fit.cost);
    for (int axis = 0; axis < 3; ++axis) {
      // Distance to the minimum along each axis in sigmas, by the parabola through three costs.
      const Eigen::Vector3d step =
          std::sqrt(fit.covariance(axis, axis)) * Eigen::Vector3d::Unit(axis);
      const double before = cost(fit.point - step), after = cost(fit.point + step);
      EXPECT_LT(std::abs(before - after) / (2 * (before + after - 2 * fit.cost)), 0.02);
    }
  }
}

struct Spread {
  double measured = 0, reported = 0;  // sigma of chi
  double nees = 0;                    // mean over the draws, of the whole point
  double cost = 0, cost2 = 0;
  int dof = 0;
};

Spread spread(const Scene& scene, Fit fit, int draws) {
  Random random(7);
  Spread result;
  double sum = 0, sum2 = 0;
  const Eigen::Vector3d now = scene.seenFrom(0);
  const Eigen::Vector3d truth(now.x() / now.z(), now.y() / now.z(), scene.chi());
  for (int i = 0; i < draws; ++i) {
    const WindowFit f = fitted(scene.images(kSigma, &random), fit);
    const Eigen::Vector3d error = f.point - truth;
    sum += error.z();
    sum2 += error.z() * error.z();
    result.reported += f.sigma_chi() / draws;
    result.nees += error.dot(f.covariance.inverse() * error) / draws;
    result.cost += f.cost / draws;
    result.cost2 += f.cost * f.cost / draws;
    result.dof = f.dof;
  }
  result.measured = std::sqrt(sum2 / draws - std::pow(sum / draws, 2));
  return result;
}

TEST(WindowFitNoise, reportedSigmaIsTheMeasuredOne) {
  for (unsigned seed : {1u, 2u, 3u}) {
    for (std::size_t images : {6u, 21u, 51u}) {
      Random random(seed);
      const Scene scene = Scene::walk(random, images, 2, 0.6 / static_cast<double>(images));
      for (const auto& [name, fit] :
           {NamedFit{"LS", fitLeastSquares}, NamedFit{"ML", fitMaximumLikelihood}}) {
        const Spread s = spread(scene, fit, 2000);
        EXPECT_GT(s.reported / s.measured, 0.93) << name << ", " << images << ", seed " << seed;
        EXPECT_LT(s.reported / s.measured, 1.07) << name << ", " << images << ", seed " << seed;
        // 3 degrees of freedom: mean 3, its standard deviation over the draws sqrt(6 / 2000).
        EXPECT_NEAR(s.nees, 3, 0.25) << name << ", " << images << ", seed " << seed;
      }
    }
  }
}

TEST(WindowFitNoise, costOfTheMaximumLikelihoodIsChiSquare) {
  Random random(1);
  const Scene scene = Scene::walk(random, 21, 2, 0.03);
  const Spread s = spread(scene, fitMaximumLikelihood, 2000);
  EXPECT_EQ(s.dof, 39);
  EXPECT_NEAR(s.cost, 39, 4 * std::sqrt(78.0 / 2000));
  EXPECT_NEAR(s.cost2 - s.cost * s.cost, 78, 10);
}

TEST(WindowFitNoise, newestImageIsNotAveragedOutByLeastSquares) {
  Random random(1);
  const Scene scene = Scene::walk(random, 21, 2, 0.03);
  const WindowFit fit = fitted(scene.images(kSigma), fitLeastSquares);
  double S = 0;
  for (std::size_t j = 1; j < scene.wMc.size(); ++j) {
    const Eigen::Vector3d c = scene.wMc[j].translation();
    const Eigen::Vector3d u = scene.seenFrom(0) * scene.chi();
    S += (c.head<2>() - u.head<2>() * c.z()).squaredNorm();
  }
  EXPECT_GT(fit.sigma_chi(), 3 * kSigma / std::sqrt(S)) << "sigma/sqrt(S) is far too small";
}

TEST(WindowFitNoise, maximumLikelihoodHalvesTheError) {
  Random random(1);
  const Scene scene = Scene::walk(random, 21, 2, 0.03);
  const double ratio = spread(scene, fitMaximumLikelihood, 1000).measured /
                       spread(scene, fitLeastSquares, 1000).measured;
  EXPECT_GT(ratio, 0.4);
  EXPECT_LT(ratio, 0.7);
}

TEST(WindowRobust, withstandsOutliersInThePastAndInTheNewestImage) {
  Random random(1);
  const Scene scene = Scene::walk(random, 21, 2, 0.03);
  const double clean = spread(scene, fitRobustly, 500).measured;
  for (bool newest : {false, true}) {
    double robust2 = 0, plain2 = 0;
    for (int i = 0; i < 500; ++i) {
      std::vector<WindowImage> images = scene.images(kSigma, &random);
      for (std::size_t j = 0; j < images.size(); ++j) {
        if (newest ? j != 0 : j % 10 != 5) continue;
        const double angle = random.uniform(0, 6.283);
        images[j].point.x += 10.0 / 600 * std::cos(angle);
        images[j].point.y += 10.0 / 600 * std::sin(angle);
      }
      robust2 += std::pow(fitted(images, fitRobustly).chi() - scene.chi(), 2) / 500;
      plain2 += std::pow(fitted(images, fitMaximumLikelihood).chi() - scene.chi(), 2) / 500;
    }
    EXPECT_LT(std::sqrt(robust2), 1.3 * clean) << (newest ? "newest" : "past");
    EXPECT_GT(std::sqrt(plain2), 1.8 * clean) << (newest ? "newest" : "past");
  }
}

TEST_P(EveryWindowFit, depthMeasuredDirectlyIsKnownWithoutBaseline) {
  const Scene scene{{.1, .2, 2}, {Eigen::Isometry3d::Identity()}};
  std::vector<WindowImage> images = scene.images(kSigma);
  images[0].depth = {0.4, 0.01};
  const WindowFit fit = fitted(images, GetParam().fit);
  EXPECT_EQ(fit.degeneracy, WindowDegeneracy::none);
  EXPECT_NEAR(fit.chi(), 0.4, 1e-12);
  EXPECT_NEAR(fit.sigma_chi(), 0.01, 1e-12);
}

TEST_P(EveryWindowFit, depthMeasuredInAnEarlierImageIsTransferred) {
  Random random(6);
  Scene scene = Scene::walk(random, 2, 2, 0);
  scene.wMc[1].translation() = -0.5 * scene.wP.normalized();  // no parallax, another distance
  std::vector<WindowImage> images = scene.images(kSigma);
  images[1].depth = {1 / scene.seenFrom(1).z(), 0.01};
  const WindowFit fit = fitted(images, GetParam().fit);
  EXPECT_EQ(fit.degeneracy, WindowDegeneracy::none);
  EXPECT_NEAR(fit.chi(), scene.chi(), 1e-9);
  // chi^-2 dchi is the same length error in both.
  EXPECT_NEAR(fit.sigma_chi() / std::pow(scene.chi(), 2), 0.01 * std::pow(scene.seenFrom(1).z(), 2),
              0.02 * fit.sigma_chi() / std::pow(scene.chi(), 2));
}

TEST_P(EveryWindowFit, depthMeasuredDirectlyIsWeighedIn) {
  Random random(1);
  const Scene scene = Scene::walk(random, 21, 2, 0.03);
  std::vector<WindowImage> images = scene.images(kSigma);
  const WindowFit before = fitted(images, GetParam().fit);
  images[0].depth = {scene.chi() + 0.01, before.sigma_chi()};  // as good as all images together
  const WindowFit after = fitted(images, GetParam().fit);
  EXPECT_NEAR(after.chi(), scene.chi() + 0.005, 2e-4);
  EXPECT_NEAR(after.sigma_chi(), before.sigma_chi() / std::sqrt(2), 0.02 * before.sigma_chi());
}

}  // namespace
}  // namespace depthservo
