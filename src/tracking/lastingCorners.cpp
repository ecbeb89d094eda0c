#include "tracking/lastingCorners.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "depthservo/tracking/KltTracker.h"

namespace depthservo::detail {

std::vector<TrackedPoint> lastingCorners(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                         std::size_t count) {
  constexpr std::size_t kChoice = 4;  // candidates for each corner
  const cv::Mat whole(static_cast<int>(image.getHeight()), static_cast<int>(image.getWidth()),
                      CV_8U, image.bitmap);
  DEPTHSERVO_VISP vpImage<unsigned char> half((image.getHeight() + 1) / 2,
                                              (image.getWidth() + 1) / 2);
  cv::Mat halved(static_cast<int>(half.getHeight()), static_cast<int>(half.getWidth()), CV_8U,
                 half.bitmap);
  cv::pyrDown(whole, halved, halved.size());
  KltTrackerOptions options;
  options.points = static_cast<int>(std::min<std::size_t>(2000, kChoice * count));
  std::vector<TrackedPoint> corners = spread(KltTracker(options).track(half, {}), count);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    TrackedPoint& corner = corners[i];
    corner.id = static_cast<int>(i);
    corner.u *= 2;
    corner.v *= 2;
  }
  return corners;
}

std::vector<TrackedPoint> spread(std::vector<TrackedPoint> points, std::size_t count) {
  if (points.size() <= count || count == 0) return points;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const TrackedPoint& p : points) centre += Eigen::Vector2d(p.u, p.v);
  centre /= static_cast<double>(points.size());
  std::vector<double> distance(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    distance[i] = -std::hypot(points[i].u - centre.x(), points[i].v - centre.y());
  }
  std::vector<TrackedPoint> taken;
  auto next = std::max_element(distance.begin(), distance.end());
  std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
  while (taken.size() < count) {
    const TrackedPoint& p = points[static_cast<std::size_t>(next - distance.begin())];
    taken.push_back(p);
    for (std::size_t i = 0; i < points.size(); ++i) {
      distance[i] = std::min(distance[i], std::hypot(points[i].u - p.u, points[i].v - p.v));
    }
    next = std::max_element(distance.begin(), distance.end());
  }
  return taken;
}

}  // namespace depthservo::detail
