#include "depthservo/depth/NoiseLearner.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "depthservo/motion/Flow.h"
#include "motion/median.h"
#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

constexpr double kTau_s = 0.5;      // of what lasts, where the profile says nothing
constexpr int kProfile = 3;         // the more, the longer the profile counts
constexpr int kMemory = 200;        // comparisons that are averaged, the latest most
constexpr int kLeast = 8;           // comparisons with the image before to have learnt
constexpr std::size_t kFewest = 6;  // points of a comparison
constexpr std::size_t kMostPairs = 64;
constexpr int kIterations = 4;
constexpr double kHuber = 1.5;              // in sigma of both axes
constexpr double kMostGrowth = 9;           // of a level by one image: a wrong one is no noise
constexpr double kMedianOfSquares = 1.386;  // of two axes, of variance 1
constexpr double kMedianToSigma = 1.4826;

using Matrix6d = Eigen::Matrix<double, 6, 6>;

}  // namespace

NoiseLearner::NoiseLearner(std::size_t capacity, const SharedErrorFilterOptions& options,
                           double white_px)
    : profile_(MeasurementNoise::of(options.errors)),
      focal_px_(options.focal_px),
      rowScale_s_(options.errors.readout_s * options.rowScale),
      rowOffset_s_(options.errors.readout_s * options.rowOffset) {
  profile_.pixel_px.white = white_px;
  for (Snapshot& snapshot : snapshots_) snapshot.points.reserve(capacity);
  now_.reserve(capacity);
  both_.reserve(capacity);
  pairs_.reserve(kMostPairs);
  sizes_.reserve(capacity);
  const auto twice = [](double sigma) { return 2 * sigma * sigma; };
  for (Level& level : levels_) {
    level.position = twice(profile_.position_m.sigma());
    level.angle = twice(profile_.angle_rad.sigma());
    level.pixel = twice(profile_.pixel_px.sigma() / focal_px_);
  }
}

void NoiseLearner::observe(const Motion& motion, const std::vector<PointObservation>& observations,
                           const PointSetEstimator& estimator) {
  now_.clear();
  sizes_.clear();
  const Vector6d twist = motion.isUsable() ? motion.twist().vector() : Vector6d::Zero().eval();
  for (const PointObservation& o : observations) {
    if (!o.measurement.isUsable() || now_.size() == now_.capacity()) continue;
    const DepthEstimate e = estimator.estimate(o.id);
    const double late_s = rowScale_s_ * o.measurement.y + rowOffset_s_;
    const Eigen::Vector3d by =
        late_s * rateByTwist({o.measurement.x, o.measurement.y, e.chi}) * twist;
    now_.push_back({o.id, o.measurement.x - by.x(), o.measurement.y - by.y(), e.chi,
                    e.sigma_chi * e.sigma_chi});
    sizes_.push_back(o.measurement.sigma);
  }
  const double sigma = sizes_.empty() ? 0 : detail::medianOf(sizes_);
  const bool isKnown = motion.isUsable() && !motion.unknown.exists();
  if (!isKnown) kept_ = 0;
  for (std::size_t n = 0; n < kept_; ++n) {
    Motion& since = snapshots_[(latest_ + n) % kKept].since;
    since = since.then(motion);
  }
  for (std::size_t lag = 0; lag < kLags; ++lag) {
    const std::size_t back = std::size_t{1} << lag;
    if (back > kept_) continue;
    Level& level = levels_[lag];
    if (lag > 0 && level.images == 0) {  // what is known of a shorter time is better than nothing
      const Level& shorter = levels_[lag - 1];
      level = {0, shorter.position, shorter.angle, shorter.pixel, 0};
    }
    compare(snapshots_[(latest_ + back - 1) % kKept], level);
  }
  latest_ = (latest_ + kKept - 1) % kKept;
  kept_ = std::min(kept_ + 1, kKept);
  snapshots_[latest_].since = {};
  snapshots_[latest_].points = now_;
  ++images_;
  renewFactor(sigma);
}

/// Points of now that were seen then, with what they tell.
void NoiseLearner::match(const Snapshot& then) {
  both_.clear();
  auto before = then.points.begin();
  for (const Seen& now : now_) {
    while (before != then.points.end() && before->id < now.id) ++before;
    if (before == then.points.end()) break;
    if (before->id == now.id) both_.emplace_back(&*before, &now);
  }
  pairs_.clear();
  const std::size_t step = (both_.size() + kMostPairs - 1) / kMostPairs;
  for (std::size_t i = step > 0 ? images_ % step : 0; i < both_.size(); i += step) {
    const auto& [seen, now] = both_[i];
    const PointState state{seen->x, seen->y, seen->chi};
    const auto [after, isAhead] = flow(then.since, state);
    if (!isAhead) continue;
    const Eigen::Vector2d nu(now->x - after.x, now->y - after.y);
    if (!(nu.squaredNorm() < 1)) continue;
    pairs_.push_back({nu, rateByTwist(after).topRows<2>(),
                      flowJacobian(then.since, state, after).topRightCorner<2, 1>(),
                      seen->variance_chi, 1});
  }
}

void NoiseLearner::compare(const Snapshot& then, Level& level) {
  match(then);
  if (pairs_.size() < kFewest) return;
  Vector6d prior;
  prior << Eigen::Vector3d::Constant(1 / level.position),
      Eigen::Vector3d::Constant(1 / level.angle);
  Vector6d d = Vector6d::Zero();
  Matrix6d spread = Matrix6d::Zero();
  const auto informationOf = [&](const Pair& pair) -> Eigen::Matrix2d {
    const Eigen::Matrix2d S = level.pixel * Eigen::Matrix2d::Identity() +
                              pair.variance_chi * pair.byDepth * pair.byDepth.transpose();
    return S.inverse();
  };
  double scale = 1;  // of the squares against what was expected
  for (int k = 0; k < kIterations; ++k) {
    Matrix6d A = prior.asDiagonal();
    Vector6d b = Vector6d::Zero();
    for (const Pair& pair : pairs_) {
      const Eigen::Matrix<double, 6, 2> LW =
          pair.weight / scale * pair.L.transpose() * informationOf(pair);
      A += LW * pair.L;
      b += LW * pair.nu;
    }
    const Eigen::LDLT<Matrix6d> solver(A);
    d = solver.solve(b);
    spread = solver.solve(Matrix6d::Identity());
    sizes_.clear();
    for (Pair& pair : pairs_) {
      const Eigen::Vector2d left = pair.nu - pair.L * d;
      pair.weight = left.dot(informationOf(pair) * left);
      sizes_.push_back(pair.weight);
    }
    scale = detail::medianOf(sizes_) / kMedianOfSquares;
    for (Pair& pair : pairs_) {
      const double size = std::sqrt(pair.weight / scale);
      pair.weight = size > kHuber ? kHuber / size : 1;
    }
  }
  if (!d.allFinite() || !spread.allFinite()) return;
  sizes_.clear();
  for (const Pair& pair : pairs_) {
    const Eigen::Vector2d left = pair.nu - pair.L * d;
    const Eigen::Vector2d across(-pair.byDepth.y(), pair.byDepth.x());
    const double length = across.norm();
    sizes_.push_back(length > 0 ? std::abs(across.dot(left)) / length : std::abs(left.x()));
  }
  const double n = static_cast<double>(pairs_.size());
  const double sigma = kMedianToSigma * detail::medianOf(sizes_) * std::sqrt(n / (n - 3));
  level.images = std::min(level.images + 1, kMemory);
  const double gain = 2. / (level.images + kProfile);
  const auto learn = [&](double& square, double seen) {
    square += gain * (std::min(seen, kMostGrowth * square) - square);
  };
  learn(level.position, (d.head<3>().squaredNorm() + spread.topLeftCorner<3, 3>().trace()) / 3);
  learn(level.angle, (d.tail<3>().squaredNorm() + spread.bottomRightCorner<3, 3>().trace()) / 3);
  learn(level.pixel, sigma * sigma);
  level.lag_s += (then.since.dt - level.lag_s) / level.images;
}

bool NoiseLearner::isLearnt() const { return levels_.front().images >= kLeast; }

/// By least squares weighted as the means scatter, neither part below zero.
NoiseLevel NoiseLearner::fitted(double Level::*square, const NoiseLevel& profile) const {
  const double tau_s = profile.lasting.tau_s > 0 ? profile.lasting.tau_s : kTau_s;
  double ww = 0, wl = 0, ll = 0, wd = 0, ld = 0;
  for (const Level& level : levels_) {
    if (level.images == 0) continue;
    const double D = 0.5 * level.*square, share = 1 - std::exp(-level.lag_s / tau_s);
    const double weight = level.images / (D * D);
    ww += weight;
    wl += weight * share;
    ll += weight * share * share;
    wd += weight * D;
    ld += weight * share * D;
  }
  const double det = ww * ll - wl * wl;
  double white = wd / ww, lasting = 0;
  if (det > 1e-9 * ww * ll) {
    white = (ll * wd - wl * ld) / det;
    lasting = (ww * ld - wl * wd) / det;
    if (white < 0) white = 0, lasting = ld / ll;
    if (lasting < 0) white = wd / ww, lasting = 0;
  }
  return {std::sqrt(white), {std::sqrt(lasting), tau_s}};
}

MeasurementNoise NoiseLearner::noise() const {
  if (!isLearnt()) return profile_;
  MeasurementNoise noise{fitted(&Level::pixel, profile_.pixel_px),
                         fitted(&Level::position, profile_.position_m),
                         fitted(&Level::angle, profile_.angle_rad)};
  noise.pixel_px.white *= focal_px_;
  noise.pixel_px.lasting.sigma *= focal_px_;
  return noise;
}

/// \param sigma of the measurements at hand
void NoiseLearner::renewFactor(double sigma) {
  constexpr double kMost = 10;
  if (!isLearnt() || !(sigma > 0)) return;
  const double told = sigma / factor_, white = fitted(&Level::pixel, profile_.pixel_px).white;
  factor_ = std::clamp(white / told, 1 / kMost, kMost);
}

}  // namespace depthservo
