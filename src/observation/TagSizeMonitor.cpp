#include "observation/TagSizeMonitor.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "features/pointInteraction.h"

namespace depthservo {
namespace {

/// Images in a row before a disagreement is told: one alone may be an outlier.
constexpr int kPersistent = 10;
constexpr double kPoseSigmas = 2;

DotTarget unitTag() {
  const auto corners = AprilTagTarget::unitCorners();
  return {{corners.begin(), corners.end()}, 0};
}

}  // namespace

TagSizeMonitor::TagSizeMonitor(const AprilTagTarget& target, const PinholeCamera& camera)
    : camera_(camera) {
  for (const AprilTagTarget::Tag& tag : target.tags) {
    tags_.push_back({TargetPose(unitTag(), camera), false, Eigen::Vector4d::Zero()});
    results_.push_back({tag.id, tag.size.value_or(kUnknown)});
  }
}

bool TagSizeMonitor::findPose(Tag& tag, std::size_t index,
                              const std::vector<TrackedPoint>& points) const {
  const int first = 4 * static_cast<int>(index);
  std::vector<TrackedPoint> corners;
  for (TrackedPoint point : points) {
    if (point.id < first || point.id >= first + 4) continue;
    point.id -= first;
    corners.push_back(point);
  }
  const auto pose = tag.pose.compute(corners);
  if (!pose) return false;

  // Covariance of a small motion of the camera from that of the corners; then that of the mean
  // depth.
  Matrix6d information = Matrix6d::Zero();
  Eigen::Matrix<double, 1, 6> meanDepth = Eigen::Matrix<double, 1, 6>::Zero();
  const auto unit = AprilTagTarget::unitCorners();
  for (int j = 0; j < 4; ++j) {
    const Eigen::Vector3d P = pose->cMo * unit[static_cast<std::size_t>(j)];
    const double Z = P.z(), x = P.x() / Z, y = P.y() / Z;
    tag.depths[j] = Z;
    const Eigen::Matrix<double, 2, 6> L = pointInteraction({x, y, 1 / Z});
    const double sigma = corners[static_cast<std::size_t>(j)].sigma_px / camera_.focal_px();
    information += L.transpose() * L / (sigma * sigma);
    meanDepth += (Eigen::Matrix<double, 1, 6>() << 0, 0, -1, -y * Z, x * Z, 0).finished() / 4;
  }
  const Matrix6d covariance = information.inverse();
  const double variance = (meanDepth * covariance * meanDepth.transpose()).value();
  tag.relativeSigma = std::sqrt(std::max(0.0, variance)) / tag.depths.mean();
  return std::isfinite(tag.relativeSigma);
}

std::vector<std::string> TagSizeMonitor::compare(const std::vector<TrackedPoint>& points,
                                                 const PointSetEstimator& estimator) {
  std::vector<std::string> events;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    Tag& tag = tags_[i];
    tag.isSeen = findPose(tag, i, points);
    if (!tag.isSeen) continue;

    // The corners' errors have common causes: together they are no better than each of them.
    Eigen::Vector4d Z;
    double relativeSigma = 0;
    bool isKnown = true;
    for (int j = 0; j < 4; ++j) {
      const DepthEstimate estimate = estimator.estimate(4 * static_cast<int>(i) + j);
      isKnown = isKnown && (estimate.status == DepthStatus::valid ||
                            estimate.status == DepthStatus::converging ||
                            estimate.status == DepthStatus::unexcited);
      Z[j] = estimate.Z();
      relativeSigma += estimate.sigma_Z() / estimate.Z() / 4;
    }
    if (!isKnown) continue;
    TagRecord& result = results_[i];
    result.observed_size = Z.mean() / tag.depths.mean();
    const double sigma_Z = relativeSigma * Z.mean();
    result.sigma = result.observed_size * std::hypot(relativeSigma, tag.relativeSigma);
    if (std::isnan(result.size)) continue;

    const double byPose = result.size * tag.depths.mean(), sigma_pose = tag.relativeSigma * byPose;
    const bool disagrees = std::abs(Z.mean() - byPose) > kPoseSigmas * (sigma_Z + sigma_pose);
    tag.disagreements = disagrees ? tag.disagreements + 1 : 0;
    if (tag.disagreements != kPersistent || result.disagrees) continue;
    result.disagrees = true;
    events.push_back(fmt::format(
        "tag {}: observed depth {:.3g} +- {:.1g} m, by its size of {:g} m {:.3g} +- {:.1g} m (2 "
        "sigma): they agree for a size of {:.3g} m; check the size, the odometry's scale and the "
        "focal length",
        result.id, Z.mean(), 2 * sigma_Z, result.size, byPose, 2 * sigma_pose,
        result.observed_size));
  }
  return events;
}

std::vector<TagRecord> TagSizeMonitor::results() const {
  std::vector<TagRecord> known;
  std::copy_if(results_.begin(), results_.end(), std::back_inserter(known), [](const TagRecord& r) {
    return !std::isnan(r.size) || !std::isnan(r.observed_size);
  });
  return known;
}

double TagSizeMonitor::depthByPose(int id) const {
  const auto i = static_cast<std::size_t>(id / 4);
  if (id < 0 || i >= tags_.size() || !tags_[i].isSeen) return kUnknown;
  return results_[i].size * tags_[i].depths[id % 4];
}

}  // namespace depthservo
