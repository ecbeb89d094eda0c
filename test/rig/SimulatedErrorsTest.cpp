#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <vector>

#include "depthservo/motion/Motion.h"
#include "depthservo/rig/SimulatedRig.h"

namespace depthservo {
namespace {

/// A free camera before four points; every row of odometry begins at an image.
SimulatedRigOptions options(double duration, unsigned seed = 1) {
  SimulatedRigOptions rig;
  rig.seed = seed;
  rig.duration = duration;
  rig.camera.rate = {50};
  rig.odometry.rate = 50;
  rig.target.points = {{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}};
  rig.target.pose = {{0, 0, 2}, {0, 0, 0}};
  rig.robot.type = RobotKind::free;
  rig.sensing.source = SensingSource::geometry;
  return rig;
}

struct Recording {
  std::deque<Exposure> exposures;  // never moved
  std::vector<OdometryRow> rows;

  /// The true twist during row k, from the true poses at its ends; they tell nothing of odometry.
  Twist trueTwist(std::size_t k) const {
    const double dt = rows[k + 1].time_s - rows[k].time_s;
    return Motion::fromPoses(*exposures[k].wMc, *exposures[k + 1].wMc, dt).twist();
  }
  std::size_t size() const { return std::min(rows.size(), exposures.size()) - 1; }
};

Recording recorded(const SimulatedRigOptions& options, const Twist& twist = {}) {
  SimulatedRig rig(options);
  Velocities command(6);
  command << twist.linear, twist.angular;
  rig.command(command);
  Recording recording;
  while (auto exposure = rig.next(nullptr)) recording.exposures.push_back(std::move(*exposure));
  recording.rows = rig.odometry();
  return recording;
}

double mean(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value;
  return sum / static_cast<double>(x.size());
}

/// Mean of x_k x_(k + lag); the mean of x is known to be 0.
double covariance(const std::vector<double>& x, std::size_t lag = 0) {
  double sum = 0;
  for (std::size_t k = 0; k + lag < x.size(); ++k) sum += x[k] * x[k + lag];
  return sum / static_cast<double>(x.size() - lag);
}

/// One value for each seed.
std::vector<double> overSeeds(unsigned seeds, const std::function<double(unsigned)>& value) {
  std::vector<double> values;
  for (unsigned seed = 1; seed <= seeds; ++seed) values.push_back(value(seed));
  return values;
}

/// A sample of n has its mean within 4 sigma of 0, and its deviation within 4 sigma of this one.
void expectDeviation(const std::vector<double>& x, double sigma) {
  const double n = static_cast<double>(x.size());
  EXPECT_NEAR(mean(x), 0, 4 * sigma / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(covariance(x)), sigma, 4 * sigma / std::sqrt(2 * n));
}

const Twist kTwist{{0.05, -0.03, 0.02}, {0.02, 0.01, -0.03}};

Eigen::Matrix3d rotation(const Eigen::Vector3d& rpy) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return (AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

TEST(SimulatedErrors, scale_is_true_over_measured_less_one_and_drawn_once_by_the_seed) {
  const auto S = [](unsigned seed) {
    SimulatedRigOptions rig = options(0.5, seed);
    rig.odometry.scale_drawn = 0.01;
    const Recording r = recorded(rig, kTwist);
    const auto ratio = [&](std::size_t k) {
      EXPECT_LT((r.rows[k].twist.angular - kTwist.angular).norm(), 1e-9);
      return r.trueTwist(k).linear.norm() / r.rows[k].twist.linear.norm() - 1;
    };
    EXPECT_NEAR(ratio(0), ratio(20), 1e-9);
    return ratio(0);
  };
  expectDeviation(overSeeds(400, S), 0.01);
}

TEST(SimulatedErrors, scale_that_is_given_and_scale_that_is_drawn_add_up) {
  SimulatedRigOptions rig = options(0.5);
  rig.odometry.scale_drawn = 0.01;
  const auto S = [&] {
    const Recording r = recorded(rig, kTwist);
    return r.trueTwist(3).linear.norm() / r.rows[3].twist.linear.norm() - 1;
  };
  const double drawn = S();
  rig.odometry.scale = 1 / 1.05;
  EXPECT_NEAR(S(), 0.05 + drawn, 1e-9);
}

TEST(SimulatedErrors, slip_lasts_and_is_a_factor_of_the_true_translation) {
  SimulatedRigOptions rig = options(600);
  rig.odometry.slip = {0.02, 0.5};
  const Recording r = recorded(rig, kTwist);
  std::vector<double> slip;
  for (std::size_t k = 0; k < r.size(); ++k) {
    const Twist truth = r.trueTwist(k);
    slip.push_back(truth.linear.norm() / r.rows[k].twist.linear.norm() - 1);
    ASSERT_LT(truth.linear.cross(r.rows[k].twist.linear).norm(), 1e-9);
  }
  // 600 s hold 600 independent values.
  EXPECT_NEAR(mean(slip), 0, 4 * 0.02 / std::sqrt(600.));
  EXPECT_NEAR(std::sqrt(covariance(slip)), 0.02, 0.1 * 0.02);
  EXPECT_NEAR(covariance(slip, 25) / covariance(slip), std::exp(-1), 0.12);
  EXPECT_NEAR(covariance(slip, 75) / covariance(slip), std::exp(-3), 0.12);
}

TEST(SimulatedErrors, gyro_bias_is_added_and_drawn_once_by_the_seed) {
  std::array<std::vector<double>, 3> biases;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SimulatedRigOptions rig = options(0.3, seed);
    rig.odometry.gyro_bias_drawn = 0.004;
    const Recording r = recorded(rig, kTwist);
    const Eigen::Vector3d bias = r.rows[0].twist.angular - r.trueTwist(0).angular;
    EXPECT_LT((r.rows[10].twist.angular - r.trueTwist(10).angular - bias).norm(), 1e-9);
    for (int i = 0; i < 3; ++i) biases[static_cast<std::size_t>(i)].push_back(bias[i]);
  }
  for (const auto& bias : biases) expectDeviation(bias, 0.004);
}

TEST(SimulatedErrors, gyro_noise_is_white) {
  SimulatedRigOptions rig = options(40);
  rig.odometry.gyro_noise = 0.002;
  const Recording r = recorded(rig, kTwist);
  std::vector<double> noise;
  for (int i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < r.size(); ++k) {
      noise.push_back(r.rows[k].twist.angular[i] - r.trueTwist(k).angular[i]);
      ASSERT_LT((r.rows[k].twist.linear - kTwist.linear).norm(), 1e-9);
    }
  }
  expectDeviation(noise, 0.002);
  EXPECT_NEAR(covariance(noise, 1) / covariance(noise), 0, 0.06);
}

TEST(SimulatedErrors, the_true_camera_is_turned_against_the_one_assumed) {
  SimulatedRigOptions rig = options(1);
  const Eigen::Vector3d rpy(0.1, -0.05, 0.2);
  rig.robot.mount_error = rpy;
  const Recording r = recorded(rig, kTwist);
  const Twist truth = r.trueTwist(7);
  EXPECT_LT((r.rows[7].twist.linear - rotation(rpy) * truth.linear).norm(), 1e-9);
  EXPECT_LT((r.rows[7].twist.angular - rotation(rpy) * truth.angular).norm(), 1e-9);
  // The points are seen by the true camera: its pose is that of the initial one, turned.
  const Exposure& first = r.exposures.front();
  EXPECT_LT((first.wMc->linear() - rotation(rpy)).norm(), 1e-12);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d wP = rig.target.points[i] + Eigen::Vector3d(0, 0, 2);
    const Eigen::Vector3d cP = rotation(rpy).transpose() * wP;
    EXPECT_NEAR(first.points[i].u, 319.5 + 600 * cP.x() / cP.z(), 1e-9);
    EXPECT_NEAR(first.points[i].v, 239.5 + 600 * cP.y() / cP.z(), 1e-9);
    EXPECT_NEAR(first.truth[i].Z, cP.z(), 1e-12);
  }
}

TEST(SimulatedErrors, mount_and_focal_length_are_drawn_by_the_seed) {
  std::vector<double> angles, focals;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SimulatedRigOptions rig = options(0.1, seed);
    rig.robot.mount_drawn = 0.007;
    const Eigen::AngleAxisd turn(recorded(rig).exposures.front().wMc->linear());
    const Eigen::Vector3d vector = turn.angle() * turn.axis();  // of small angles: their vector
    angles.insert(angles.end(), vector.begin(), vector.end());
    rig.robot.mount_drawn = 0;
    rig.camera.focal_drawn = 0.003;
    const auto points = recorded(rig).exposures.front().points;
    focals.push_back((points[1].u - points[0].u) / (600 * 0.2 / 2) - 1);
  }
  expectDeviation(angles, 0.007);
  expectDeviation(focals, 0.003);
}

TEST(SimulatedErrors, stamps_jitter_and_stay_in_order) {
  SimulatedRigOptions rig = options(60);
  rig.sensing.latency = 0.1;
  rig.sensing.stamp_jitter = 0.002;
  std::vector<double> jitter;
  const auto& stamped = recorded(rig).exposures;
  for (std::size_t k = 0; k < stamped.size(); ++k) {
    jitter.push_back(stamped[k].time_s - 0.1 - 0.02 * static_cast<double>(k));
  }
  expectDeviation(jitter, 0.002);
  EXPECT_NEAR(covariance(jitter, 1) / covariance(jitter), 0, 0.08);
  rig.sensing.latency = 0;
  rig.sensing.stamp_jitter = 1;
  double last = -1;
  for (const Exposure& exposure : recorded(rig).exposures) {
    EXPECT_GE(exposure.time_s, 0);
    EXPECT_GT(exposure.time_s, last);
    last = exposure.time_s;
  }
}

TEST(SimulatedErrors, rows_of_a_rolling_shutter_are_exposed_later_one_by_one) {
  constexpr double kReadout_s = 0.03;
  const Twist twist{{.2, -.1, .1}, {.1, .2, .3}};
  SimulatedRigOptions rig = options(1);
  rig.sensing.readout = kReadout_s;
  const Recording rolling = recorded(rig, twist);
  rig.sensing.readout = 0;
  rig.camera.rate = {2000};
  const Recording global = recorded(rig, twist);
  double largest_px = 0;
  for (std::size_t k = 5; k < 25; ++k) {
    const Exposure& exposure = rolling.exposures[k];
    for (const TrackedPoint& point : exposure.points) {
      const auto at = [&](double time_s) {
        const auto image = static_cast<std::size_t>(std::lround(2000 * time_s));
        return global.exposures.at(image).points.at(static_cast<std::size_t>(point.id));
      };
      const TrackedPoint first = at(exposure.time_s);
      const TrackedPoint then = at(exposure.time_s + kReadout_s * first.v / rig.camera.height);
      EXPECT_NEAR(point.u, then.u, .1);  // 2000 images a second are 0.25 ms from its time at most
      EXPECT_NEAR(point.v, then.v, .1);
      largest_px = std::max(largest_px, std::hypot(then.u - first.u, then.v - first.v));
    }
  }
  EXPECT_GT(largest_px, 1);
}

TEST(SimulatedErrors, a_latency_that_is_drawn_comes_on_top_and_is_never_negative) {
  const std::vector<double> latencies = overSeeds(300, [](unsigned seed) {
    SimulatedRigOptions rig = options(0.2, seed);
    rig.sensing.latency = 0.05;
    rig.sensing.latency_drawn = 0.01;
    const auto& exposures = recorded(rig).exposures;
    EXPECT_NEAR(exposures[3].time_s - exposures[0].time_s, 0.06, 1e-8);
    EXPECT_GE(exposures[0].time_s, 0.05);
    return exposures[0].time_s - 0.05;
  });
  EXPECT_NEAR(std::sqrt(covariance(latencies)), 0.01, 4 * 0.01 / std::sqrt(600.));
}

TEST(SimulatedErrors, wander_lasts_and_is_of_each_axis_of_each_point) {
  SimulatedRigOptions rig = options(400);
  rig.sensing.wander = {0.15, 0.7};
  const Recording r = recorded(rig);
  std::vector<std::vector<double>> errors(8);
  for (const Exposure& exposure : r.exposures) {
    for (std::size_t i = 0; i < 4; ++i) {
      errors[2 * i].push_back(exposure.points[i].u - exposure.truth[i].u);
      errors[2 * i + 1].push_back(exposure.points[i].v - exposure.truth[i].v);
    }
  }
  // 400 s hold about 300 independent values of each.
  for (std::size_t i = 0; i < 8; ++i) {
    const double variance = covariance(errors[i]);
    EXPECT_NEAR(std::sqrt(variance), 0.15, 0.15 * 0.15);
    EXPECT_NEAR(covariance(errors[i], 35) / variance, std::exp(-1), 0.2);
    for (std::size_t j = 0; j < i; ++j) {
      double both = 0;
      for (std::size_t k = 0; k < errors[i].size(); ++k) both += errors[i][k] * errors[j][k];
      EXPECT_NEAR(both / static_cast<double>(errors[i].size()) / variance, 0, 0.25);
    }
  }
}

/// Every source by itself, with what it may change.
struct Source {
  const char* name;
  std::function<void(SimulatedRigOptions&)> switchOn;
  bool changesRows, changesPixels, changesStamps;
};

class EverySource : public testing::TestWithParam<Source> {};

/// Draws of the others, measured as differences to a run without them: they do not change when
/// this source is switched on, too.
TEST_P(EverySource, has_random_numbers_of_its_own) {
  const Source& source = GetParam();
  SimulatedRigOptions without = options(2);
  without.odometry.noise = {0.01, 0.01};
  without.sensing.pixel_noise = 0.3;
  without.sensing.outliers = 0.1;
  without.camera.jitter = 0.1;
  SimulatedRigOptions with = without;
  source.switchOn(with);
  const Recording a = recorded(without, kTwist), b = recorded(with, kTwist);
  const auto farthest = [&](const auto& distance, std::size_t size) {
    double most = 0;
    for (std::size_t k = 0; k < size; ++k) most = std::max(most, distance(k));
    return most;
  };
  ASSERT_EQ(a.exposures.size(), b.exposures.size());
  ASSERT_EQ(a.rows.size(), b.rows.size());
  const double rows = farthest(
      [&](std::size_t k) {
        return (a.rows[k].twist.linear - b.rows[k].twist.linear).norm() +
               (a.rows[k].twist.angular - b.rows[k].twist.angular).norm();
      },
      a.rows.size());
  const double stamps = farthest(
      [&](std::size_t k) { return std::abs(a.exposures[k].time_s - b.exposures[k].time_s); },
      a.exposures.size());
  const double pixels = farthest(
      [&](std::size_t k) {
        const auto error = [&](const Recording& r) {
          const Exposure& exposure = r.exposures[k];
          return Eigen::Vector2d(exposure.points[0].u - exposure.truth[0].u,
                                 exposure.points[0].v - exposure.truth[0].v);
        };
        return (error(a) - error(b)).norm();
      },
      a.exposures.size());
  EXPECT_EQ(rows > 1e-9, source.changesRows) << rows;
  EXPECT_EQ(pixels > 1e-9, source.changesPixels) << pixels;
  EXPECT_EQ(stamps > 1e-9, source.changesStamps) << stamps;
}

INSTANTIATE_TEST_SUITE_P(
    SimulatedErrors, EverySource,
    testing::Values(
        Source{"scale", [](auto& o) { o.odometry.scale_drawn = 0.01; }, true, false, false},
        Source{"slip",
               [](auto& o) {
                 o.odometry.slip = {0.02, 0.5};
               },
               true, false, false},
        Source{"bias", [](auto& o) { o.odometry.gyro_bias_drawn = 0.01; }, true, false, false},
        Source{"gyro", [](auto& o) { o.odometry.gyro_noise = 0.01; }, true, false, false},
        Source{"mount", [](auto& o) { o.robot.mount_drawn = 0.007; }, false, false, false},
        Source{"focal", [](auto& o) { o.camera.focal_drawn = 0.003; }, false, false, false},
        Source{"jitter", [](auto& o) { o.sensing.stamp_jitter = 0.002; }, false, false, true},
        Source{"latency", [](auto& o) { o.sensing.latency_drawn = 0.01; }, false, false, true},
        Source{"wander",
               [](auto& o) {
                 o.sensing.wander = {0.15, 0.7};
               },
               false, true, false}),
    [](const auto& source) { return std::string(source.param.name); });

}  // namespace
}  // namespace depthservo
