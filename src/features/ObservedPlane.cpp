#include "depthservo/features/ObservedPlane.h"

#include <visp3/visual_features/vpFeatureMoment.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "depthservo/visp/using.h"
#include "features/planeFlow.h"

namespace depthservo {
namespace {

/// Points whose rms width is below this part of their rms length are a line: the noise of their
/// depths would decide how the plane is tilted about it.
constexpr double kThinnest = 0.02;

/// Of the largest distance from the barycentre [-]: below, the points coincide.
constexpr double kSmallestSize = 1e-9;

/// Sigma of an inverse depth [1/m] below which one point does not count more than another.
constexpr double kSmallestSigma_chi = 1e-12;

/// The weights depend on the plane: of so many fits the last counts.
constexpr int kFits = 2;

/// Weighted sums over the points, about their weighted barycentre.
struct Sums {
  double weight = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();     // x, y, chi
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // mean of the products
};

/// \param tilt (A, B) by which errors of x and y count
template <typename SampleAt>
Sums sumsOf(std::size_t count, const SampleAt& sampleAt, const Eigen::Vector2d& tilt) {
  const auto weightOf = [&](const auto& p) {
    const double sigma = std::max(p.sigma_chi, kSmallestSigma_chi);
    return 1 / (sigma * sigma + tilt.squaredNorm() * p.sigma_xy * p.sigma_xy);
  };
  Sums sums;
  for (std::size_t i = 0; i < count; ++i) {
    const auto p = sampleAt(i);
    sums.weight += weightOf(p);
    sums.mean += weightOf(p) * Eigen::Vector3d(p.x, p.y, p.chi);
  }
  sums.mean /= sums.weight;
  for (std::size_t i = 0; i < count; ++i) {
    const auto p = sampleAt(i);
    const Eigen::Vector3d d = Eigen::Vector3d(p.x, p.y, p.chi) - sums.mean;
    sums.scatter += weightOf(p) / sums.weight * d * d.transpose();
  }
  return sums;
}

/// Whether the points span a plane and not only a line.
bool areWide(const Sums& sums) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen;
  eigen.computeDirect(sums.scatter.topLeftCorner<2, 2>(), Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] > kThinnest * kThinnest * eigen.eigenvalues()[1];
}

/// Covariance of (A, B, C) from that of (A, B) and of the chi at the barycentre.
Eigen::Matrix3d aboutOrigin(const Eigen::Matrix2d& tilt, double chi, const Sums& sums) {
  Eigen::Matrix<double, 3, 2> byTilt;
  byTilt << Eigen::Matrix2d::Identity(), -sums.mean.head<2>().transpose();
  Eigen::Matrix3d covariance = byTilt * tilt * byTilt.transpose();
  covariance(2, 2) += chi;
  return covariance;
}

}  // namespace

const char* toString(PlaneStatus status) {
  switch (status) {
    case PlaneStatus::unset:
      return "unset";
    case PlaneStatus::fitted:
      return "fitted";
    case PlaneStatus::frontoParallel:
      return "fronto-parallel";
    case PlaneStatus::unusable:
      return "unusable";
  }
  return "";
}

ObservedPlane::Sample ObservedPlane::sampleOf(const FeaturePoint& p) {
  return {p.get_x(), p.get_y(), 1 / p.get_Z(), p.estimate().sigma_chi, p.estimate().sigma_xy};
}

ObservedPlane::Sample ObservedPlane::sampleOf(const DepthEstimate& p) {
  return {p.x, p.y, p.chi, p.sigma_chi, p.sigma_xy};
}

ObservedPlane::Sample ObservedPlane::sampleOf(const PointState& p) {
  return {p.x, p.y, p.chi, 1, 0};
}

template <typename SampleAt>
void ObservedPlane::fit(std::size_t count, const SampleAt& sampleAt) {
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  Sums sums;
  bool isPlane = false;
  for (int i = 0; i < kFits; ++i) {
    sums = sumsOf(count, sampleAt, tilt);
    isPlane = areWide(sums);
    if (!isPlane) break;
    const Eigen::Matrix2d S = sums.scatter.topLeftCorner<2, 2>();
    tilt = S.inverse() * sums.scatter.topRightCorner<2, 1>();
  }
  double size = 0;  // largest squared distance from the barycentre
  for (std::size_t i = 0; i < count; ++i) {
    const auto p = sampleAt(i);
    size = std::max(size, (Eigen::Vector2d(p.x, p.y) - sums.mean.head<2>()).squaredNorm());
  }
  const bool isUsable = size > kSmallestSize * kSmallestSize && sums.mean.allFinite() &&
                        sums.scatter.allFinite() && tilt.allFinite();
  if (!isUsable) {
    if (status_ != PlaneStatus::unset) status_ = PlaneStatus::unusable;
    return;
  }
  const Eigen::Vector3d fitted(tilt.x(), tilt.y(), sums.mean.z() - tilt.dot(sums.mean.head<2>()));
  for (std::size_t i = 0; isPlane && i < count; ++i) {
    const auto p = sampleAt(i);
    isPlane = fitted.dot(Eigen::Vector3d(p.x, p.y, 1)) > 0;
  }
  status_ = isPlane ? PlaneStatus::fitted : PlaneStatus::frontoParallel;
  abc_ = isPlane ? fitted : Eigen::Vector3d(0, 0, sums.mean.z());
  const Eigen::Matrix2d ofTilt =
      isPlane ? Eigen::Matrix2d(sums.scatter.topLeftCorner<2, 2>().inverse() / sums.weight)
              : Eigen::Matrix2d(sums.mean.z() * sums.mean.z() * Eigen::Matrix2d::Identity());
  covariance_ = aboutOrigin(ofTilt, 1 / sums.weight, sums);
}

void ObservedPlane::update(const PointFeatures& points) {
  fit(points.size(), [&](std::size_t i) { return sampleOf(points[i]); });
}

void ObservedPlane::update(const std::vector<DepthEstimate>& points) {
  fit(points.size(), [&](std::size_t i) { return sampleOf(points[i]); });
}

void ObservedPlane::buildFrom(const std::vector<PointState>& points) {
  fit(points.size(), [&](std::size_t i) { return sampleOf(points[i]); });
}

void ObservedPlane::predict(const Motion& motion) {
  if (!motion.isUsable()) return;
  const PlaneFlow next = planeFlow(motion, abc_);
  if (!next.isAhead) return;
  abc_ = next.abc;
  covariance_ = (next.J * covariance_ * next.J.transpose()).eval();
}

double ObservedPlane::sigma_chiAt(double x, double y) const {
  const Eigen::Vector3d at(x, y, 1);
  return std::sqrt(std::max(0., at.dot(covariance_ * at)));
}

int ObservedPlane::applyTo(vpFeatureMomentDatabase& features) const {
  int count = 0;
  for (const char* name :
       {"vpFeatureMomentBasic", "vpFeatureMomentGravityCenter", "vpFeatureMomentCentered",
        "vpFeatureMomentArea", "vpFeatureMomentAreaNormalized",
        "vpFeatureMomentGravityCenterNormalized", "vpFeatureMomentCInvariant",
        "vpFeatureMomentAlpha"}) {
    bool isThere = false;
    vpFeatureMoment& feature = features.get(name, isThere);
    if (!isThere) continue;
    feature.update(abc_[0], abc_[1], abc_[2]);
    ++count;
  }
  return count;
}

}  // namespace depthservo
