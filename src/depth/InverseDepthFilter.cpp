#include "depthservo/depth/InverseDepthFilter.h"

#include <Eigen/Geometry>
#include <cmath>

#include "depth/FilterPointSteps.h"
#include "depth/byLastingErrors.h"
#include "motion/rateByTwist.h"

namespace depthservo {
namespace {

using detail::ConsideredVariances;
using detail::LastingErrors;
using Phase = detail::FilterPoint::Phase;

/// What lasting errors add to the variances.
ConsideredVariances variancesOf(const LastingErrors& errors) {
  if (!errors.exist) return {};
  const auto of = [&](int i, int j) {
    return errors.A.row(i).cwiseProduct(errors.variance).dot(errors.A.row(j));
  };
  return {of(0, 0), of(0, 1), of(1, 1), of(2, 2)};
}

}  // namespace

namespace detail {

LastingErrors::LastingErrors(const ErrorProfile& profile) {
  variance(LastingErrors::kLatency) = profile.latency_s * profile.latency_s;
  for (int axis = 0; axis < 3; ++axis) {
    const double bias = profile.gyroBiasSigma(axis), mount = profile.mountSigma(axis);
    variance(LastingErrors::kBias + axis) = bias * bias;
    variance(LastingErrors::kMount + axis) = mount * mount;
  }
  exist = !variance.isZero(0);
}

}  // namespace detail

InverseDepthFilterOptions InverseDepthFilterOptions::considering(const ErrorProfile& errors,
                                                                 double focal_px) {
  InverseDepthFilterOptions options;
  options.odometry = errors.odometry;
  options.odometryScaleSigma = errors.scale;
  options.focalSigma = errors.focal;
  options.lasting = errors;
  options.focal_px = focal_px;
  return options;
}

std::unique_ptr<DepthEstimator> InverseDepthFilter::clone() const {
  return std::make_unique<InverseDepthFilter>(*this);
}

void InverseDepthFilter::reset(const PointMeasurement& measurement, const DepthPrior& prior) {
  if (!measurement.isUsable()) return;
  step_ = {};
  dt_ = 0;
  detail::resetPoint(point_, asWhite(measurement), prior.sanitised(range_));
  lasting_.A.setZero();
}

void InverseDepthFilter::predict(const Motion& motion) {
  if (!motion.isUsable()) return;
  step_ = options_.odometry.over(motion);
  dt_ = motion.dt;
  const GaussMarkov& slip = options_.lasting.slip;
  if (slip.sigma > 0) {
    step_.variance_t += slip.sigma * slip.sigma * motion.t.squaredNorm() * slip.asWhite(dt_);
  }
  const PointState before{point_.x, point_.y, point_.chi};
  detail::predictPoint(point_, detail::FilterStep(motion, step_), options_);
  if (lasting_.exist) followLasting(motion, before);
}

/// \param before the point before the motion; now it is after it
void InverseDepthFilter::followLasting(const Motion& motion, const PointState& before) {
  const Twist twist = motion.twist();
  const Vector6d change = twist.vector() - (lasting_.hasTwist ? lasting_.twist : twist).vector();
  lasting_.hasTwist = !motion.unknown.exists();
  lasting_.twist = twist;
  if (point_.phase != Phase::coasting) {  // there is no error to carry along
    lasting_.A.setZero();
    return;
  }
  const PointState after{point_.x, point_.y, point_.chi};
  const Eigen::Matrix<double, 3, 6> L = rateByTwist(after);
  lasting_.A = flowJacobian(motion, before, after) * lasting_.A;
  lasting_.A.col(LastingErrors::kLatency) -= L * change;
  lasting_.A.middleCols<3>(LastingErrors::kBias) -= motion.dt * L.rightCols<3>();
  lasting_.A.middleCols<3>(LastingErrors::kMount) += motion.dt * detail::byMount(L, twist);
}

/// The measurement with those errors as white noise that are not considered.
PointMeasurement InverseDepthFilter::asWhite(const PointMeasurement& measurement) const {
  const ErrorProfile& e = options_.lasting;
  const double wander = e.wander_px.sigma / options_.focal_px;
  const bool isPose = e.position_m > 0 || e.angle_rad > 0;
  if (!(wander > 0 || e.jitter_s > 0 || isPose)) return measurement;
  const auto inflated = [&](const GaussMarkov& error) { return dt_ > 0 ? error.asWhite(dt_) : 1; };
  double variance = measurement.sigma * measurement.sigma;
  variance += wander * wander * inflated(e.wander_px);
  const PointState at{measurement.x, measurement.y, point_.chi};
  const Eigen::Matrix<double, 2, 6> L = rateByTwist(at).topRows<2>();
  if (e.jitter_s > 0 && lasting_.hasTwist) {
    variance += e.jitter_s * e.jitter_s * (L * lasting_.twist.vector()).squaredNorm();
  }
  if (isPose) {  // the mean over both axes
    variance += inflated({1, e.poseTau_s}) / 2 *
                (e.position_m * e.position_m * L.leftCols<3>().squaredNorm() +
                 e.angle_rad * e.angle_rad * L.rightCols<3>().squaredNorm());
  }
  return {measurement.x, measurement.y, std::sqrt(variance)};
}

void InverseDepthFilter::correct(const PointMeasurement& measurement) {
  const detail::PointCorrection done =
      detail::correctPoint(point_, asWhite(measurement), options_, range_, variancesOf(lasting_));
  if (!lasting_.exist) return;
  if (done.verdict == detail::Verdict::restart) lasting_.A.setZero();
  if (done.verdict != detail::Verdict::use) return;
  const detail::FilterGain<double>& g = done.gain;
  Eigen::Matrix<double, 3, 2> K;
  K << g.xx, g.xy, g.yx, g.yy, g.cx, g.cy;
  const Eigen::Matrix<double, 2, 7> seen = lasting_.A.topRows<2>();
  lasting_.A -= K * seen;
}

void InverseDepthFilter::correctDepth(const DepthPrior& measured) {
  if (!measured.isUsable()) return;
  const double chi = range_.clampChi(1 / measured.Z);
  const double sum = point_.cc + detail::depthVariance(chi, measured.sigma_chi);
  const LastingErrors::Row seen = lasting_.A.row(2);
  const Eigen::Vector3d K = covariance().col(2) / sum;
  detail::correctPointDepth(point_, measured, range_);
  if (lasting_.exist && sum > 0) lasting_.A -= K * seen;
}

DepthEstimate InverseDepthFilter::estimate() const {
  return detail::describePoint(point_, step_, dt_, options_, range_, variancesOf(lasting_));
}

Eigen::Matrix3d InverseDepthFilter::covariance() const { return detail::covariance(point_); }

}  // namespace depthservo
