#include "tracking/TaughtMatcher.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace depthservo::detail {
namespace {

constexpr double kHomography_px = 4, kEpipolar_px = 2;  // greatest distance of an inlier
constexpr double kSure = 0.995;
constexpr int kMostPlanes = 4, kLeastOnPlane = 10;
constexpr std::size_t kNeighbours = 10;  // that tell how the surroundings of a point move

Eigen::Vector2d toEigen(const cv::Point2f& p) { return {p.x, p.y}; }

std::vector<Eigen::Vector2d> chosen(const std::vector<cv::Point2f>& points, const cv::Mat& mask) {
  std::vector<Eigen::Vector2d> inliers;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (mask.at<unsigned char>(static_cast<int>(i))) inliers.push_back(toEigen(points[i]));
  }
  return inliers;
}

std::vector<cv::Point2f> withoutThose(const std::vector<cv::Point2f>& points, const cv::Mat& mask) {
  std::vector<cv::Point2f> others;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!mask.at<unsigned char>(static_cast<int>(i))) others.push_back(points[i]);
  }
  return others;
}

TaughtPlace byHomography(const cv::Mat& H, const Eigen::Vector2d& p) {
  Eigen::Matrix3d h;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) h(r, c) = H.at<double>(r, c);
  }
  const Eigen::Vector3d q = h * p.homogeneous();
  TaughtPlace place;
  place.point = q.hnormalized();
  place.warp = (h.topLeftCorner<2, 2>() - place.point * h.block<1, 2>(2, 0)) / q.z();
  return place;
}

}  // namespace

std::optional<TaughtPlace> affineAt(const Eigen::Vector2d& point,
                                    const std::vector<Eigen::Vector2d>& from,
                                    const std::vector<Eigen::Vector2d>& to, std::size_t nearest) {
  constexpr std::size_t kLeast = 4;
  if (from.size() < kLeast) return std::nullopt;
  std::vector<std::size_t> order(from.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto count = static_cast<std::ptrdiff_t>(std::min(nearest, order.size()));
  std::partial_sort(order.begin(), order.begin() + count, order.end(),
                    [&](std::size_t a, std::size_t b) {
                      return (from[a] - point).squaredNorm() < (from[b] - point).squaredNorm();
                    });
  Eigen::Matrix<double, Eigen::Dynamic, 3> A(count, 3);
  Eigen::Matrix<double, Eigen::Dynamic, 2> b(count, 2);
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const std::size_t k = order[static_cast<std::size_t>(i)];
    A.row(i) << (from[k] - point).transpose(), 1;
    b.row(i) = to[k].transpose();
  }
  Eigen::ColPivHouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, 3>> qr(A);
  qr.setThreshold(1e-3);
  if (qr.rank() < 3) return std::nullopt;
  const Eigen::Matrix<double, 3, 2> x = qr.solve(b);
  return TaughtPlace{x.row(2).transpose(), x.topRows<2>().transpose()};
}

TaughtMatcher::TaughtMatcher(const cv::Mat& taught, int features, double ratio)
    : orb_(cv::ORB::create(features)), ratio_(ratio) {
  orb_->detectAndCompute(taught, cv::noArray(), keypoints_, descriptors_);
}

TaughtMatcher::Pairs TaughtMatcher::match(const cv::Mat& image) const {
  Pairs pairs;
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  orb_->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
  if (descriptors_.rows < 2 || descriptors.rows < 2) return pairs;
  std::vector<std::vector<cv::DMatch>> matches;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(descriptors_, descriptors, matches, 2);
  for (const auto& best : matches) {
    if (best.size() < 2 || best[0].distance > ratio_ * best[1].distance) continue;
    pairs.from.push_back(keypoints_[static_cast<std::size_t>(best[0].queryIdx)].pt);
    pairs.to.push_back(keypoints[static_cast<std::size_t>(best[0].trainIdx)].pt);
  }
  return pairs;
}

TaughtMatcher::Result TaughtMatcher::find(const cv::Mat& image,
                                          const std::vector<Eigen::Vector2d>& points,
                                          int leastInliers) const {
  Result result;
  const Pairs pairs = match(image);
  result.matches = static_cast<int>(pairs.from.size());
  Pairs rest = pairs;
  while (result.planes < kMostPlanes && static_cast<int>(rest.from.size()) >= kLeastOnPlane) {
    cv::Mat mask;
    const cv::Mat H = cv::findHomography(rest.from, rest.to, cv::RANSAC, kHomography_px, mask);
    const int inliers = H.empty() ? 0 : cv::countNonZero(mask);
    if (inliers < (result.planes == 0 ? leastInliers : kLeastOnPlane)) break;
    ++result.planes;
    result.inliers += inliers;
    result.hypotheses.emplace_back();
    for (const Eigen::Vector2d& p : points) result.hypotheses.back().push_back(byHomography(H, p));
    rest = {withoutThose(rest.from, mask), withoutThose(rest.to, mask)};
  }
  if (result.planes > 0 || result.matches < leastInliers) return result;
  cv::Mat mask;
  const cv::Mat F =
      cv::findFundamentalMat(pairs.from, pairs.to, cv::FM_RANSAC, kEpipolar_px, kSure, mask);
  result.inliers = F.empty() ? 0 : cv::countNonZero(mask);
  if (result.inliers < leastInliers) return result;
  const auto from = chosen(pairs.from, mask), to = chosen(pairs.to, mask);
  std::vector<TaughtPlace> places;
  for (const Eigen::Vector2d& p : points) {
    const auto place = affineAt(p, from, to, kNeighbours);
    if (!place) return result;
    places.push_back(*place);
  }
  result.hypotheses.push_back(std::move(places));
  return result;
}

}  // namespace depthservo::detail
