#include "tracking/PatchAligner.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace depthservo::detail {
namespace {

constexpr int kIterations = 8;
constexpr double kConverged_px = 0.01;
constexpr double kLeastContrast = 2;  // rms gray levels of a patch
constexpr int kParameters = 6;        // translation, zoom, roll, gain, offset
constexpr double kCorrelated = 2;     // pixels of a bilinear patch that share noise
constexpr double kChanged = 8;        // pixels that share a change of the look: 3 x 3
constexpr double kSteadiness = 0.01;
constexpr double kLeastInformation = 1e-5;  // of any motion: 0.02 px for 1 % of noise

/// Bilinear samples on a grid of `side` x `side` about a point, which must keep the margin.
template <int side>
Eigen::Matrix<float, side * side, 1> sample(const cv::Mat& image, const Eigen::Vector2d& point) {
  constexpr int kMiddle = side / 2;
  const double u = point.x() - kMiddle, v = point.y() - kMiddle;
  const int u0 = static_cast<int>(std::floor(u)), v0 = static_cast<int>(std::floor(v));
  const auto a = static_cast<float>(u - u0), b = static_cast<float>(v - v0);
  const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
  Eigen::Matrix<float, side * side, 1> values;
  float* value = values.data();
  for (int j = 0; j < side; ++j, value += side) {
    const unsigned char* top = image.ptr<unsigned char>(v0 + j) + u0;
    const unsigned char* bottom = image.ptr<unsigned char>(v0 + j + 1) + u0;
    for (int i = 0; i < side; ++i) {
      value[i] = w00 * static_cast<float>(top[i]) + w01 * static_cast<float>(top[i + 1]) +
                 w10 * static_cast<float>(bottom[i]) + w11 * static_cast<float>(bottom[i + 1]);
    }
  }
  return values;
}

bool keepsMargin(const cv::Mat& image, const Eigen::Vector2d& p, double margin_px) {
  return p.x() >= margin_px && p.y() >= margin_px && p.x() <= image.cols - 1 - margin_px &&
         p.y() <= image.rows - 1 - margin_px;
}

/// To mean 0 and norm 1; the norm before.
template <class Values>
float normalise(Values& values) {
  values.array() -= values.mean();
  const float norm = values.norm();
  values /= std::max(norm, 1e-6f);
  return norm;
}

}  // namespace

std::optional<ReferencePatch> ReferencePatch::at(const cv::Mat& image,
                                                 const Eigen::Vector2d& point) {
  if (!keepsMargin(image, point, kMargin_px)) return std::nullopt;
  constexpr int kWide = kSide + 2;
  const auto wide = sample<kWide>(image, point);
  ReferencePatch patch;
  const auto at = [&](int i, int j) { return wide[(j + 1) * kWide + i + 1]; };
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const int k = j * kSide + i;
      const auto x = static_cast<float>(i - kHalf), y = static_cast<float>(j - kHalf);
      const float gu = 0.5f * (at(i + 1, j) - at(i - 1, j));
      const float gv = 0.5f * (at(i, j + 1) - at(i, j - 1));
      patch.gray_[k] = at(i, j);
      patch.derivative_(k, 0) = gu;
      patch.derivative_(k, 1) = gv;
      patch.derivative_(k, 2) = (gu * x + gv * y) / kHalf;
      patch.derivative_(k, 3) = (gv * x - gu * y) / kHalf;
    }
  }
  const Eigen::Matrix2f G =
      patch.derivative_.leftCols<2>().transpose() * patch.derivative_.leftCols<2>();
  patch.leastGradient2_ =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f>(G, Eigen::EigenvaluesOnly).eigenvalues()(0) /
      kSize;
  const float norm = normalise(patch.gray_);
  if (!(norm > kLeastContrast * kSide)) return std::nullopt;
  patch.derivative_ /= norm;
  patch.derivative_.rowwise() -= patch.derivative_.colwise().mean();
  patch.derivative_ -= patch.gray_ * (patch.gray_.transpose() * patch.derivative_);
  Eigen::Matrix4d H = (patch.derivative_.transpose() * patch.derivative_).cast<double>();
  H(2, 2) += kSteadiness;
  H(3, 3) += kSteadiness;
  const Eigen::LDLT<Eigen::Matrix4d> solver(H);
  if (!(solver.vectorD().minCoeff() > kLeastInformation)) return std::nullopt;
  patch.covariance_ = solver.solve(Eigen::Matrix4d::Identity());
  return patch;
}

Eigen::Vector2d ReferencePatch::corner() const {
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  Eigen::Vector2d Hx = Eigen::Vector2d::Zero();
  for (int j = -kHalf; j <= kHalf; ++j) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      const int k = (j + kHalf) * kSide + i + kHalf;
      const Eigen::Vector2d g(derivative_(k, 0), derivative_(k, 1));
      H += g * g.transpose();
      Hx += g * g.dot(Eigen::Vector2d(i, j));
    }
  }
  return H.ldlt().solve(Hx);
}

std::optional<ReferencePatch::Alignment> ReferencePatch::align(const cv::Mat& image,
                                                               const Eigen::Vector2d& start,
                                                               double reach_px,
                                                               double noise) const {
  Eigen::Vector2d point = start;
  Values values;
  for (int k = 0; k < kIterations; ++k) {
    if (!keepsMargin(image, point, kMargin_px)) return std::nullopt;
    values = sample<kSide>(image, point);
    const double norm = normalise(values);
    if (!(norm > kLeastContrast * kSide / 2)) return std::nullopt;
    const Eigen::Vector4d slope = (derivative_.transpose() * values).cast<double>();
    const Eigen::Vector4d motion = covariance_ * slope;
    point -= motion.head<2>();
    if (!((point - start).norm() <= reach_px)) return std::nullopt;
    if (motion.head<2>().norm() > kConverged_px) continue;
    const double similarity = gray_.dot(values);
    const double left = std::max(0.0, 2 * (1 - similarity) - slope.dot(motion));
    const double all = left / (kSize - kParameters);
    const double byNoise = std::min(all, 2 * noise * noise / (norm * norm));  // of both images
    const double variance = kCorrelated * byNoise + kChanged * (all - byNoise);
    return Alignment{point, similarity,
                     std::sqrt(0.5 * variance * covariance_.topLeftCorner<2, 2>().trace()),
                     motion.tail<2>().norm()};
  }
  return std::nullopt;
}

}  // namespace depthservo::detail
