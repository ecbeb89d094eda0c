#include "tracking/spreadPoints.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace depthservo::detail {

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
