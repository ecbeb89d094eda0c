#include "depthservo/tracking/KnownTargetEstimator.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <stdexcept>
#include <utility>

namespace depthservo {
namespace {

constexpr std::size_t kFewestPoints = 4;

/// Extent across a line or a plane, relative to the extent of the target, that is none.
constexpr double kLeastExtent = 1e-3;

/// Twice the log likelihood ratio at which the worse of two poses is given up.
constexpr double kEnoughEvidence = 25;

/// Residuals below this (normalised) are no evidence: the tracker's and the lens model's own.
constexpr double kLeastSigma = 1e-4;

/// Poses nearer to each other than this [rad] have become one.
constexpr double kSamePose_rad = 1e-3;

/// Extents of the points along their principal axes, descending.
Eigen::Vector3d extents(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix3Xd centred(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    centred.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  centred.colwise() -= centred.rowwise().mean().eval();
  Eigen::JacobiSVD<Eigen::Matrix3Xd> svd(centred);
  return svd.singularValues();
}

std::vector<Eigen::Vector3d> checked(std::vector<Eigen::Vector3d> points) {
  if (const auto why = whyNoTarget(points)) throw std::invalid_argument(*why);
  return points;
}

Eigen::Isometry3d pose(const cv::Mat& rotationVector, const cv::Mat& translation) {
  cv::Mat rotation;
  cv::Rodrigues(rotationVector, rotation);
  Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) cMo(i, j) = rotation.at<double>(i, j);
    cMo(i, 3) = translation.at<double>(i);
  }
  return cMo;
}

/// The poses that these images of points show, the best first.
std::vector<Eigen::Isometry3d> posesIn(const std::vector<PointObservation>& observations,
                                       const std::vector<Eigen::Vector3d>& points, bool isFlat) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (const PointObservation& observation : observations) {
    const auto i = static_cast<std::size_t>(observation.id);
    if (observation.id < 0 || i >= points.size() || !observation.measurement.isUsable()) continue;
    object.emplace_back(points[i].x(), points[i].y(), points[i].z());
    image.emplace_back(observation.measurement.x, observation.measurement.y);
  }
  std::vector<Eigen::Isometry3d> poses;
  if (object.size() < kFewestPoints) return poses;
  try {
    std::vector<cv::Mat> rotations, translations;
    cv::solvePnPGeneric(object, image, cv::Matx33d::eye(), cv::noArray(), rotations, translations,
                        false, isFlat ? cv::SOLVEPNP_IPPE : cv::SOLVEPNP_SQPNP);
    for (std::size_t i = 0; i < rotations.size(); ++i) {
      poses.push_back(pose(rotations[i], translations[i]));
    }
  } catch (const cv::Exception&) {
    poses.clear();  // these points show no pose
  }
  return poses;
}

double angleBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

/// Sum of the squared image errors that the pose leaves, in units of their variance.
double misfit(const VisualMotionObserver& observer,
              const std::vector<PointObservation>& observations) {
  double sigma = kLeastSigma;
  for (const PointObservation& o : observations) sigma = std::max(sigma, o.measurement.sigma);
  const double relative = observer.residual() / sigma;
  return static_cast<double>(observations.size()) * relative * relative;
}

}  // namespace

std::optional<const char*> whyNoTarget(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < kFewestPoints) return "a known target has at least four points";
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) return "a point of the target is not finite";
  }
  const Eigen::Vector3d extent = extents(points);
  if (!(extent[1] > kLeastExtent * extent[0])) return "the points of the target lie on one line";
  return {};
}

KnownTargetEstimator::KnownTargetEstimator(const std::vector<Eigen::Vector3d>& points,
                                           const Options& options, const DepthRange& range)
    : points_(checked(points)), observer_(points_, options, range) {
  const Eigen::Vector3d extent = extents(points_);
  isFlat_ = extent[2] <= kLeastExtent * extent[0];
}

std::unique_ptr<PointSetEstimator> KnownTargetEstimator::clone() const {
  return std::make_unique<KnownTargetEstimator>(*this);
}

void KnownTargetEstimator::reset() {
  observer_.reset();
  rival_.reset();
  evidence_ = 0;
  starts_ = 0;
}

bool KnownTargetEstimator::setPrior(int id, const DepthPrior& prior) {
  return observer_.setPrior(id, prior);
}

Coverage KnownTargetEstimator::advance(const MotionBuffer& odometry, double time_s) {
  if (rival_) rival_->advance(odometry, time_s);
  return observer_.advance(odometry, time_s);
}

void KnownTargetEstimator::correct(const std::vector<PointObservation>& observations) {
  if (starts_ > 0) {
    observer_.correct(observations);
    if (rival_) compare(observations);
    if (observer_.isStarted()) return;
  }
  start(observations);
}

/// Takes the pose from this image alone.
void KnownTargetEstimator::start(const std::vector<PointObservation>& observations) {
  const std::vector<Eigen::Isometry3d> poses = posesIn(observations, points_, isFlat_);
  std::optional<VisualMotionObserver> best;
  rival_.reset();
  for (const Eigen::Isometry3d& cMo : poses) {
    VisualMotionObserver candidate = observer_;
    if (!candidate.reset(cMo)) continue;
    candidate.correct(observations);
    if (!candidate.isStarted()) continue;
    if (!best) {
      best = std::move(candidate);
    } else if (angleBetween(best->cMo(), candidate.cMo()) > kSamePose_rad) {
      rival_ = std::move(candidate);
    }
  }
  if (!best) {
    if (starts_ == 0) observer_.correct(observations);  // says what is wrong with the image
    return;
  }
  observer_ = *std::move(best);
  ++starts_;
  evidence_ = 0;
  if (rival_) {
    evidence_ = misfit(*rival_, observations) - misfit(observer_, observations);
    if (evidence_ < 0) {
      std::swap(observer_, *rival_);
      evidence_ = -evidence_;
    }
    if (evidence_ > kEnoughEvidence) rival_.reset();
  }
}

/// Weighs the two poses after the observer was corrected.
void KnownTargetEstimator::compare(const std::vector<PointObservation>& observations) {
  rival_->correct(observations);
  if (rival_->isStarted() && observer_.isStarted()) {
    const bool areFitting = rival_->verdict() == ImageVerdict::accepted &&
                            observer_.verdict() == ImageVerdict::accepted;
    if (areFitting) evidence_ += misfit(*rival_, observations) - misfit(observer_, observations);
  } else if (rival_->isStarted()) {
    evidence_ = -std::numeric_limits<double>::infinity();
  }
  if (evidence_ < 0) {
    std::swap(observer_, *rival_);
    evidence_ = -evidence_;
  }
  const bool areOne = angleBetween(observer_.cMo(), rival_->cMo()) < kSamePose_rad;
  if (evidence_ > kEnoughEvidence || areOne || !rival_->isStarted()) rival_.reset();
}

void KnownTargetEstimator::correctDepth(int id, const DepthPrior& measured) {
  observer_.correctDepth(id, measured);
}

/// The estimate with the other pose's as a second possibility.
DepthEstimate KnownTargetEstimator::covering(DepthEstimate likelier,
                                             const DepthEstimate& other) const {
  const double probability = 1 / (1 + std::exp(0.5 * evidence_));
  const double apart = std::sqrt(probability) * (likelier.chi - other.chi);
  likelier.sigma_chi =
      std::min(std::hypot(likelier.sigma_chi, apart), DepthPrior::kLargestSigma_chi);
  const bool isVague = likelier.sigma_chi >= kValidRelativeSigma * likelier.chi;
  if (likelier.status == DepthStatus::valid && isVague) likelier.status = DepthStatus::converging;
  return likelier;
}

DepthEstimate KnownTargetEstimator::estimate(int id) const {
  const DepthEstimate estimate = observer_.estimate(id);
  return rival_ ? covering(estimate, rival_->estimate(id)) : estimate;
}

DepthEstimate KnownTargetEstimator::estimate(int id, const MotionBuffer& odometry,
                                             double time_s) const {
  const DepthEstimate estimate = observer_.estimate(id, odometry, time_s);
  return rival_ ? covering(estimate, rival_->estimate(id, odometry, time_s)) : estimate;
}

}  // namespace depthservo
