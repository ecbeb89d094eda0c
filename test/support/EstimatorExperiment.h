#pragma once

#include <algorithm>
#include <vector>

#include "depthservo/depth/CramerRaoBound.h"
#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "support/Random.h"
#include "support/Trajectories.h"

/// Monte Carlo runs of the estimators on the benchmark's trajectories.
namespace depthservo::test {

/// Images of interest: RMSE and the like are taken there.
constexpr int kCheckpoints[] = {15, 30, 60, 150, 299};
constexpr std::size_t kCheckpointCount = 5;

/// What is wrong with the data.
struct Conditions {
  OdometryNoise odometry = OdometryNoise::none();
  double outliers = 0;          // share of measurements 5..50 px off
  int latency = 0;              // images late, in frames
  double kappa = 1;             // true / given focal length
  double translationScale = 1;  // given / true translation
  double guessFactor = 4;       // initial guesses within this factor of the truth, log-uniform
};

/// One draw: what an estimator gets, and the truth.
struct SimulatedRun {
  std::vector<Twist> twists;                            // [k]: odometry from frame k - 2 to k - 1
  std::vector<std::vector<PointMeasurement>> measured;  // [frame][point]
  std::vector<std::vector<double>> chi;                 // true [1/m]
  std::vector<double> guesses;                          // Z [m]

  /// Odometry from frame k - 1 to k.
  const Twist& twist(int k) const { return twists[static_cast<std::size_t>(k + 1)]; }

  MotionBuffer odometry() const {
    MotionBuffer buffer(512, Trajectory::kPeriod_s);
    for (std::size_t k = 0; k < twists.size(); ++k) {
      buffer.push((static_cast<double>(k) - 2) * Trajectory::kPeriod_s, twists[k]);
    }
    return buffer;
  }
};

inline SimulatedRun simulate(const Trajectory& trajectory, std::vector<Eigen::Vector3d> points,
                             const Conditions& conditions, unsigned seed,
                             int frames = Trajectory::kFrames) {
  Random random(seed);
  SimulatedRun run;
  std::vector<Twist> real;
  const OdometryNoise& odometry = conditions.odometry;
  for (int k = -2; k < frames; ++k) {
    Twist exact = trajectory.twist(k), noisy = exact;
    for (int i = 0; i < 3; ++i) {
      if (odometry.sigma_v > 0) noisy.linear[i] += random.normal(odometry.sigma_v);
      if (odometry.sigma_w > 0) noisy.angular[i] += random.normal(odometry.sigma_w);
    }
    const bool isCommanded = odometry.mode == OdometryMode::commanded;
    real.push_back(isCommanded ? noisy : exact);
    run.twists.push_back(isCommanded ? exact : noisy);
    run.twists.back().linear *= conditions.translationScale;
  }
  const double sigma = trajectory.sigma(), px = 1 / trajectory.focal_px;
  for (const Eigen::Vector3d& p : points) {
    const double factor = std::log(conditions.guessFactor);
    run.guesses.push_back(p.z() * std::exp(random.uniform(-factor, factor)));
  }
  for (int k = 0; k < frames; ++k) {
    run.measured.emplace_back();
    run.chi.emplace_back();
    for (Eigen::Vector3d& p : points) {
      if (k > 0) {
        p = moved(p, real[static_cast<std::size_t>(k + 1 - conditions.latency)],
                  Trajectory::kPeriod_s);
      }
      PointMeasurement z{conditions.kappa * p.x() / p.z() + random.normal(sigma),
                         conditions.kappa * p.y() / p.z() + random.normal(sigma), sigma};
      if (conditions.outliers > 0 && random.uniform(0, 1) < conditions.outliers) {
        const double angle = random.uniform(0, 6.283185307179586),
                     size = random.uniform(5, 50) * px;
        z.x += size * std::cos(angle);
        z.y += size * std::sin(angle);
      }
      run.measured.back().push_back(z);
      run.chi.back().push_back(1 / p.z());
    }
  }
  return run;
}

/// Noise of the odometry when it is `level` times the declared; its size follows the twist.
inline OdometryNoise trueNoise(const OdometryNoise& declared, const Twist& twist, double level) {
  return OdometryNoise::white(
      level * std::max(declared.sigma_v, declared.relative_v * twist.linear.norm()),
      level * std::max(declared.sigma_w, declared.relative_w * twist.angular.norm()),
      declared.mode);
}

/// A robot drives straight at the four corners of a tag, 0.5 m/s from 3.2 m to 1 m, and slows down;
/// the images are exact to 0.02 px.
struct TagSequence {
  static constexpr int kFrames = 151;
  static constexpr double kSigma = 0.02 / 600, kGuess = 6;

  static Twist twist(int k) { return {{0, 0, k < 120 ? .5 : .2}, {0, .02, 0}}; }
  static std::vector<Eigen::Vector3d> points() {
    constexpr double Z = 3.2;
    return {{-.0375 * Z, -.0312 * Z, Z},
            {.0249 * Z, -.0080 * Z, Z},
            {.0249 * Z, .0313 * Z, Z},
            {-.0375 * Z, .0313 * Z, Z}};
  }

  /// \param level true noise of the measured odometry / declared
  static SimulatedRun simulate(const OdometryNoise& declared, double level, unsigned seed) {
    Random random(seed);
    SimulatedRun run;
    for (int k = -2; k < kFrames; ++k) {
      Twist noisy = twist(k);
      const OdometryNoise noise = trueNoise(declared, noisy, level);
      for (int i = 0; i < 3; ++i) {
        noisy.linear[i] += noise.sigma_v * random.normal(1);
        noisy.angular[i] += noise.sigma_w * random.normal(1);
      }
      run.twists.push_back(noisy);
    }
    std::vector<Eigen::Vector3d> now = points();
    run.guesses.assign(now.size(), kGuess);
    for (int k = 0; k < kFrames; ++k) {
      run.measured.emplace_back();
      run.chi.emplace_back();
      for (Eigen::Vector3d& p : now) {
        if (k > 0) p = moved(p, twist(k - 1), Trajectory::kPeriod_s);
        run.measured.back().push_back({p.x() / p.z() + random.normal(kSigma),
                                       p.y() / p.z() + random.normal(kSigma), kSigma});
        run.chi.back().push_back(1 / p.z());
      }
    }
    return run;
  }
};

/// Cramer-Rao bound of sigma_Z / Z of the first point, by frame.
inline std::vector<double> boundOf(const Trajectory& trajectory,
                                   const std::vector<Eigen::Vector3d>& points,
                                   const OdometryNoise& odometry, double priorSigma_chi) {
  std::vector<PointState> states;
  for (const Eigen::Vector3d& p : points) {
    states.push_back({p.x() / p.z(), p.y() / p.z(), 1 / p.z()});
  }
  CramerRaoBound bound(states, priorSigma_chi);
  std::vector<double> relative;
  for (int k = 0; k < Trajectory::kFrames; ++k) {
    if (k > 0) {
      bound.advance(Motion::fromTwist(trajectory.twist(k - 1), Trajectory::kPeriod_s), odometry);
    }
    for (std::size_t i = 0; i < points.size(); ++i) bound.measure(i, trajectory.sigma());
    relative.push_back(bound.relativeSigma(0));
  }
  return relative;
}

/// chi and its variance after every frame.
struct Trace {
  std::vector<double> chi, variance;
};

inline Trace filtered(const SimulatedRun& run, const InverseDepthFilterOptions& options,
                      std::size_t point = 0) {
  InverseDepthFilter filter(options, {1e-3, 1e6});
  Trace trace;
  for (std::size_t k = 0; k < run.measured.size(); ++k) {
    if (k == 0) {
      filter.reset(run.measured[0][point], {run.guesses[point]});
    } else {
      filter.predict(Motion::fromTwist(run.twist(static_cast<int>(k)), Trajectory::kPeriod_s));
      filter.correct(run.measured[k][point]);
    }
    const double sigma = filter.estimate().sigma_chi;
    trace.chi.push_back(filter.chi());
    trace.variance.push_back(sigma * sigma);
  }
  return trace;
}

/// The trace of the first point of a set; `estimator` is used up.
inline Trace filtered(const SimulatedRun& run, PointSetEstimator& estimator) {
  const MotionBuffer odometry = run.odometry();
  const std::size_t n = run.guesses.size();
  std::vector<PointObservation> seen(n);
  for (std::size_t i = 0; i < n; ++i) {
    estimator.setPrior(static_cast<int>(i), {run.guesses[i]});
  }
  Trace trace;
  for (std::size_t k = 0; k < run.measured.size(); ++k) {
    for (std::size_t i = 0; i < n; ++i) seen[i] = {static_cast<int>(i), run.measured[k][i]};
    estimator.advance(odometry, static_cast<double>(k) * Trajectory::kPeriod_s);
    estimator.correct(seen);
    const DepthEstimate e = estimator.estimate(0);
    trace.chi.push_back(e.chi);
    trace.variance.push_back(e.sigma_chi * e.sigma_chi);
  }
  return trace;
}

/// Accuracy over many runs.
class Statistics {
 public:
  void add(const SimulatedRun& run, const Trace& trace, std::size_t point = 0) {
    for (std::size_t i = 0; i < kCheckpointCount; ++i) {
      const auto k = static_cast<std::size_t>(kCheckpoints[i]);
      if (k >= trace.chi.size()) continue;
      const double truth = run.chi[k][point], error = trace.chi[k] - truth;
      const double relative = error / truth;
      mean_[i] += error / std::sqrt(trace.variance[k]);
      squared_[i] += relative * relative;
      nees_[i] += error * error / trace.variance[k];
      covered_[i] += error * error <= 4 * trace.variance[k];
      if (i + 1 == kCheckpointCount) worst_ = std::max(worst_, std::abs(relative));
    }
    int settled = 0;  // first frame from which on Z is within 5 %
    for (std::size_t k = 0; k < trace.chi.size(); ++k) {
      const bool isNear = std::abs(run.chi[k][point] / trace.chi[k] - 1) <= 0.05;
      if (!isNear) settled = static_cast<int>(k) + 1;
    }
    settled_.push_back(settled);
    ++runs_;
  }

  double rmse(std::size_t i) const { return std::sqrt(squared_[i] / runs_); }
  double meanOverSigma(std::size_t i) const { return mean_[i] / runs_; }  ///< of the error of chi
  double nees(std::size_t i) const { return nees_[i] / runs_; }
  double coverage(std::size_t i) const { return covered_[i] / runs_; }
  double worst() const { return worst_; }
  int medianFramesTo5Percent() const {
    std::vector<int> sorted = settled_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }

 private:
  double mean_[kCheckpointCount] = {}, squared_[kCheckpointCount] = {}, nees_[kCheckpointCount] = {};
  double covered_[kCheckpointCount] = {}, runs_ = 0, worst_ = 0;
  std::vector<int> settled_;
};

}  // namespace depthservo::test
