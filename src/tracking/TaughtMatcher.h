#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <optional>
#include <vector>

namespace depthservo::detail {

/// Where a point of the taught image should be in another, and how its surroundings look there.
struct TaughtPlace {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();     // [px]
  Eigen::Matrix2d warp = Eigen::Matrix2d::Identity();  // from the taught image, about the point
};

/// The motion of the surroundings of a point, by least squares from the nearest of given pairs.
/// Empty: fewer than 4, or all on a line.
std::optional<TaughtPlace> affineAt(const Eigen::Vector2d& point,
                                    const std::vector<Eigen::Vector2d>& from,
                                    const std::vector<Eigen::Vector2d>& to, std::size_t nearest);

/// Matches ORB features of a taught image with those of others.
class TaughtMatcher {
 public:
  TaughtMatcher(const cv::Mat& taught, int features, double ratio);

  struct Result {
    /// Of every motion that explains enough matches (of a plane each; of the nearest matches where
    /// there is none) the places of all points; none: the taught image is not there.
    std::vector<std::vector<TaughtPlace>> hypotheses;
    int matches = 0, inliers = 0, planes = 0;
  };
  Result find(const cv::Mat& image, const std::vector<Eigen::Vector2d>& points,
              int leastInliers) const;

 private:
  struct Pairs {
    std::vector<cv::Point2f> from, to;
  };
  Pairs match(const cv::Mat& image) const;

  cv::Ptr<cv::ORB> orb_;
  double ratio_;
  std::vector<cv::KeyPoint> keypoints_;
  cv::Mat descriptors_;
};

}  // namespace depthservo::detail
