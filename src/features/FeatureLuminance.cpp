#include "depthservo/features/FeatureLuminance.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "depthservo/visp/using.h"
#include "features/planeFlow.h"

namespace depthservo {
namespace {

constexpr int kIterations = 3;  // of Gauss-Newton per image, at most

/// A step shorter than this [sigma] is the last.
constexpr double kShortStep = 0.1;

/// That the fit looks at, at most.
constexpr double kMostPixels = 2000;

/// Neighbouring pixels err alike, by their interpolation: those of so large an area count as one.
constexpr double kAlike = 16;

/// Least standard deviation of a gray level.
constexpr double kLeastGray = 0.5;

/// Less than this part of the pixels in common, and two images say nothing.
constexpr double kLeastShare = 0.25;

}  // namespace

/// The image before and the present one on the feature's grid of pixels.
class FeatureLuminance::Images {
 public:
  /// Normal equations of the plane's change, and what is left unexplained.
  struct Fit {
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double squares = 0;
    std::size_t count = 0;
  };

  void resize(std::size_t width, std::size_t height) {
    width_ = width;
    height_ = height;
    before_.assign(width * height, 0);
    hasBefore_ = false;
    step_ = static_cast<std::size_t>(
        std::max(1., std::ceil(std::sqrt(double(width * height) / kMostPixels))));
  }
  void forget() { hasBefore_ = false; }
  bool hasBefore() const { return hasBefore_; }
  bool fits(std::size_t size) const { return size > 0 && size == before_.size() && width_ > 1; }
  std::size_t width() const { return width_; }

  bool isAsBefore(const vpLuminance* now) const {
    for (std::size_t i = 0; i < before_.size(); ++i) {
      if (now[i].I != double(before_[i])) return false;
    }
    return true;
  }

  void keep(const vpLuminance* now) {
    for (std::size_t i = 0; i < before_.size(); ++i) before_[i] = static_cast<float>(now[i].I);
    hasBefore_ = true;
  }

  /// How many pixels of the fit count as one.
  double alike() const { return std::max(1., kAlike / double(step_ * step_)); }

  std::size_t looked() const { return ((width_ - 1) / step_ + 1) * ((height_ - 1) / step_ + 1); }

  /// Of the change of `abc` after the motion, from where it brings each pixel of now from.
  Fit compare(const vpLuminance* now, const Motion& motion, const Eigen::Vector3d& abc) const {
    const Eigen::Matrix3d back = motion.R.transpose();
    const vpLuminance& first = now[0];
    const double perX = 1 / (now[1].x - first.x), perY = 1 / (now[width_].y - first.y);
    const Eigen::Vector3d& t = motion.t;
    Fit fit;
    for (std::size_t i = 0; i < height_; i += step_) {
      for (std::size_t j = 0; j < width_; j += step_) {
        const vpLuminance& p = now[i * width_ + j];
        const Eigen::Vector3d m(p.x, p.y, 1);
        const Eigen::Vector3d from = back * (m - t * abc.dot(m));
        if (!(from.z() > 0)) continue;
        double gray;
        const double u = (from.x() / from.z() - first.x) * perX;
        const double v = (from.y() / from.z() - first.y) * perY;
        if (!sample(u, v, gray)) continue;
        const double r = p.I - gray;
        const double g = p.Ix * (t.x() - p.x * t.z()) + p.Iy * (t.y() - p.y * t.z());
        fit.N += g * g * m * m.transpose();
        fit.b -= g * r * m;
        fit.squares += r * r;
        ++fit.count;
      }
    }
    return fit;
  }

 private:
  bool sample(double u, double v, double& gray) const {
    if (!(u >= 0 && v >= 0 && u < double(width_ - 1) && v < double(height_ - 1))) return false;
    const auto j = static_cast<std::size_t>(u), i = static_cast<std::size_t>(v);
    const double a = u - double(j), b = v - double(i);
    const float* const p = &before_[i * width_ + j];
    gray = (1 - b) * ((1 - a) * double(p[0]) + a * double(p[1])) +
           b * ((1 - a) * double(p[width_]) + a * double(p[width_ + 1]));
    return true;
  }

  std::vector<float> before_;
  std::size_t width_ = 0, height_ = 0, step_ = 1;
  bool hasBefore_ = false;
};

FeatureLuminance::FeatureLuminance() : images_(std::make_unique<Images>()) {}
FeatureLuminance::FeatureLuminance(const FeatureLuminance& other) : FeatureLuminance() {
  *this = other;
}
FeatureLuminance::~FeatureLuminance() = default;

FeatureLuminance& FeatureLuminance::operator=(const FeatureLuminance& other) {
  if (this == &other) return *this;
  ObservingShapeFeature::operator=(other);
  *images_ = *other.images_;
  errors_ = other.errors_;
  abc_ = other.abc_;
  P_ = other.P_;
  return *this;
}

void FeatureLuminance::init(unsigned rows, unsigned columns, double guess) {
  vpFeatureLuminance::init(rows, columns, guess);
  images_->resize(columns - 2 * bord, rows - 2 * bord);
  forget();
}

void FeatureLuminance::forget() {
  if (images_) images_->forget();
  estimate_ = {};
  abc_ = Eigen::Vector3d::UnitZ();
}

void FeatureLuminance::follow(const Motion& motion) {
  if (!images_->fits(dim_s) || firstTimeIn == 0) return;
  if (!images_->hasBefore()) {
    const DepthPrior prior = DepthPrior{Z}.sanitised(blend_.range());
    abc_ << 0, 0, 1 / prior.Z;
    P_ = prior.sigma_chi * prior.sigma_chi * Eigen::Matrix3d::Identity();
    images_->keep(pixInfo);
    describePlane(motion, true);
  } else if (motion.dt > 0) {
    const bool isAhead = predict(motion);
    const bool isNew = !images_->isAsBefore(pixInfo);
    const bool isAligned = isAhead && isNew && !motion.unknown.exists() && align(motion);
    if (isNew) images_->keep(pixInfo);
    describePlane(motion, isAligned);
    if (!isAhead) estimate_.status = DepthStatus::lost;
  }
  const double chi = 1 / blend_.of(estimate_), known = estimate_.chi * estimate_.chi;
  const double share = known / (known + (P_(0, 0) + P_(1, 1)) / 2) * chi / estimate_.chi;
  const Eigen::Vector3d shown(share * abc_[0], share * abc_[1], chi);
  show(isAhead(shown) ? shown : Eigen::Vector3d(0, 0, chi));
}

/// \return false where the camera has passed through the plane
bool FeatureLuminance::predict(const Motion& motion) {
  const PlaneFlow next = planeFlow(motion, abc_);
  if (!next.isAhead) return false;
  abc_ = next.abc;
  P_ = (next.J * P_ * next.J.transpose()).eval();
  if (!motion.unknown.exists()) return true;
  const double sigma = std::sqrt(std::max(P_(2, 2), 1e-18));
  const PointSigmas wide = widened({0, sigma}, {0, 0, estimate_.chi}, motion.unknown);
  P_ *= (wide.chi / sigma) * (wide.chi / sigma);
  return true;
}

/// \return whether the images told something of the plane
bool FeatureLuminance::align(const Motion& motion) {
  const OdometryNoise::Step noise = errors_.odometry.over(motion);
  const double t2 = motion.t.squaredNorm();
  if (!(noise.rho > 0 && t2 > 0)) return false;
  const Eigen::Matrix3d prior = P_.inverse();
  const Eigen::Vector3d predicted = abc_;
  Eigen::Vector3d abc = abc_;
  Eigen::Matrix3d information = prior;
  for (int i = 0; i < kIterations; ++i) {
    const Images::Fit fit = images_->compare(pixInfo, motion, abc);
    if (!(double(fit.count) > kLeastShare * double(images_->looked()))) return false;
    const double chi = abc.z();
    const double gray2 = std::max(kLeastGray * kLeastGray, fit.squares / double(fit.count));
    // What the odometry's noise leaves open is common to all pixels.
    const double variance = images_->alike() * gray2;
    const Eigen::Matrix3d N = fit.N / variance;
    const double open = (noise.variance_t * chi * chi + noise.variance_theta) / t2;
    const Eigen::Matrix3d share = (Eigen::Matrix3d::Identity() + open * N).inverse();
    information = prior + share * N;
    const Eigen::Vector3d change =
        information.inverse() * (share * fit.b / variance - prior * (abc - predicted));
    if (!change.allFinite()) return false;
    abc += change;
    abc.z() = blend_.range().clampChi(abc.z());
    if (!isAhead(abc)) abc.head<2>().setZero();
    if (change.dot(information * change) < kShortStep * kShortStep) break;
  }
  abc_ = abc;
  const Eigen::Matrix3d P = information.inverse();
  P_ = .5 * (P + P.transpose());
  return true;
}

/// Whether the plane is in front of the camera in the whole image.
bool FeatureLuminance::isAhead(const Eigen::Vector3d& abc) const {
  const std::size_t last = dim_s - 1, width = images_->width();
  for (const std::size_t i : {std::size_t{0}, width - 1, last - (width - 1), last}) {
    if (!(abc.dot(Eigen::Vector3d(pixInfo[i].x, pixInfo[i].y, 1)) > 0)) return false;
  }
  return true;
}

void FeatureLuminance::describePlane(const Motion& motion, bool isAligned) {
  DepthEstimate& e = estimate_;
  e.chi = blend_.range().clampChi(abc_.z());
  const double common = errors_.scale * errors_.scale + errors_.focal * errors_.focal;
  e.sigma_chi = std::sqrt(std::max(P_(2, 2), 0.) + common * e.chi * e.chi);
  const Eigen::Vector3d v = motion.twist().linear;
  e.excitation = std::hypot(v.x(), v.y());
  const bool isFound = blend_.range().isFound(abc_.z(), e.sigma_chi);
  e.status = !isAligned ? (motion.unknown.exists() ? DepthStatus::coasting : DepthStatus::unexcited)
             : isFound  ? DepthStatus::valid
                        : DepthStatus::converging;
}

void FeatureLuminance::show(const Eigen::Vector3d& abc) {
  for (unsigned i = 0; i < dim_s; ++i) {
    const double chi = abc.dot(Eigen::Vector3d(pixInfo[i].x, pixInfo[i].y, 1));
    pixInfo[i].Z = 1 / blend_.range().clampChi(chi);
  }
  Z = 1 / blend_.range().clampChi(abc.z());
}

void FeatureLuminance::update(const ObservedPlane& plane) {
  if (!plane.isKnown()) return;
  if (images_->fits(dim_s)) show(plane.abc());
}

}  // namespace depthservo
