#include "tracking/TagCorners.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "depthservo/visp/using.h"
#include "motion/median.h"

namespace depthservo::detail {
namespace {

constexpr double kStep_px = 0.25;       // along a profile
constexpr double kReach_px = 4;         // of a profile on either side of the edge, at most
constexpr double kLeastReach_px = 1.5;  // and at least
constexpr double kBlurred_px = 1;       // of either end of a cell belongs to the edges there
constexpr double kEnd_px = 0.5;         // of a profile, taken for the level of ink or paper
constexpr int kSmooth = 4;  // these levels are averaged over so many profiles either way
constexpr double kLeastEdgeContrast = 12;  // [gray levels]
constexpr double kOutlier = 3;             // in robust standard deviations from the line
constexpr std::size_t kLeastPoints = 4;
constexpr double kCorrelated = 2;  // neighbouring profiles, a pixel apart, share pixels
constexpr int kRounds = 3;         // short profiles are exact only about the edge
constexpr double kFloor_px = 0.005;
constexpr double kSmallCell_px = 3,
                 kSmallCellFloor = 0.03;  // more by each pixel that cells are less

using Image = vpImage<unsigned char>;

std::optional<double> grayAt(const Image& image, const Eigen::Vector2d& p) {
  if (!(p.x() >= 0 && p.y() >= 0 && p.x() <= image.getWidth() - 1.0 &&
        p.y() <= image.getHeight() - 1.0)) {
    return std::nullopt;
  }
  const auto u = std::min(static_cast<unsigned>(p.x()), image.getWidth() - 2);
  const auto v = std::min(static_cast<unsigned>(p.y()), image.getHeight() - 2);
  const double a = p.x() - u, b = p.y() - v;
  const unsigned char *top = image[v] + u, *bottom = image[v + 1] + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

/// The gray levels across an edge.
struct Profile {
  double along;            // where on the side [px from its begin]
  double inside, outside;  // levels at its ends
  double area;             // integral over its length [gray levels x px]
};

/// A line n^T p = c with its error across.
struct Line {
  Eigen::Vector2d begin, direction, normal;
  double offset = 0, slope = 0;  // of the edge across the side: offset + slope (t - middle)
  double middle = 0;
  double variance_offset = 0, variance_slope = 0;

  Eigen::Vector2d point(double t) const {
    return begin + t * direction + (offset + slope * (t - middle)) * normal;
  }
  double variance(double t) const {
    return variance_offset + (t - middle) * (t - middle) * variance_slope;
  }
};

class SideFitter {
 public:
  SideFitter(const Image& image, double reach_px) : image_(image), reach_px_(reach_px) {}

  std::optional<Line> fit(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                          const Eigen::Vector2d& outward) {
    Line line;
    const double length = (to - from).norm();
    line.begin = from;
    line.direction = (to - from) / length;
    line.normal = {line.direction.y(), -line.direction.x()};
    if (line.normal.dot(outward) < 0) line.normal = -line.normal;
    // Near its ends a side is blurred into the next.
    const double margin = std::min(0.25 * length, 0.5 * reach_px_ + 1.5);
    profiles_.clear();
    for (double t = margin; t <= length - margin; t += 1) {
      if (const auto profile = sample(line, t)) profiles_.push_back(*profile);
    }
    findEdges();
    return fitLine(line);
  }

 private:
  std::optional<Profile> sample(const Line& line, double t) const {
    Profile profile{t, 0, 0, 0};
    const int steps = static_cast<int>(std::ceil(2 * reach_px_ / kStep_px));
    const double step = 2 * reach_px_ / steps;
    int inside = 0, outside = 0;
    for (int k = 0; k <= steps; ++k) {
      const double s = -reach_px_ + k * step;
      const auto gray = grayAt(image_, line.begin + t * line.direction + s * line.normal);
      if (!gray) return std::nullopt;
      profile.area += (k == 0 || k == steps ? 0.5 : 1.0) * step * *gray;
      if (s <= -reach_px_ + kEnd_px) profile.inside += *gray, ++inside;
      if (s >= reach_px_ - kEnd_px) profile.outside += *gray, ++outside;
    }
    profile.inside /= inside;
    profile.outside /= outside;
    return profile;
  }

  void findEdges() {
    points_.clear();
    const int n = static_cast<int>(profiles_.size());
    for (int i = 0; i < n; ++i) {
      double inside = 0, outside = 0;
      const int first = std::max(0, i - kSmooth), last = std::min(n - 1, i + kSmooth);
      for (int k = first; k <= last; ++k) {
        inside += profiles_[static_cast<std::size_t>(k)].inside;
        outside += profiles_[static_cast<std::size_t>(k)].outside;
      }
      inside /= last - first + 1;
      outside /= last - first + 1;
      const Profile& profile = profiles_[static_cast<std::size_t>(i)];
      if (std::abs(outside - inside) < kLeastEdgeContrast) continue;
      // A step at s has the area (s + reach) inside + (reach - s) outside.
      const double s = (reach_px_ * (inside + outside) - profile.area) / (outside - inside);
      if (std::abs(s) < reach_px_ - 0.5) points_.emplace_back(profile.along, s);
    }
  }

  std::optional<Line> fitLine(Line line) {
    for (int round = 0; round < 3; ++round) {
      if (points_.size() < kLeastPoints) return std::nullopt;
      const auto n = static_cast<double>(points_.size());
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      for (const auto& p : points_) mean += p / n;
      double tt = 0, ts = 0;
      for (const auto& p : points_) {
        tt += (p.x() - mean.x()) * (p.x() - mean.x());
        ts += (p.x() - mean.x()) * (p.y() - mean.y());
      }
      if (!(tt > 0)) return std::nullopt;
      line.middle = mean.x();
      line.offset = mean.y();
      line.slope = ts / tt;
      const auto residual = [&](const Eigen::Vector2d& p) {
        return p.y() - line.offset - line.slope * (p.x() - line.middle);
      };
      double squares = 0;
      for (const auto& p : points_) squares += residual(p) * residual(p);
      const double variance = kCorrelated * squares / std::max(1.0, n - 2);
      line.variance_offset = variance / n;
      line.variance_slope = variance / tt;

      residuals_.clear();
      for (const auto& p : points_) residuals_.push_back(std::abs(residual(p)));
      const double limit = std::max(kFloor_px, kOutlier * 1.4826 * detail::medianOf(residuals_));
      const auto isOff = [&](const Eigen::Vector2d& p) { return std::abs(residual(p)) > limit; };
      const auto kept = std::remove_if(points_.begin(), points_.end(), isOff);
      if (kept == points_.end()) break;
      points_.erase(kept, points_.end());
    }
    return line;
  }

  const Image& image_;
  double reach_px_;
  std::vector<Profile> profiles_;
  std::vector<Eigen::Vector2d> points_;  // (along, across) the side [px]
  std::vector<double> residuals_;
};

struct Crossing {
  Eigen::Vector2d point;
  double sigma_px;
};

std::optional<Crossing> intersect(const Line& a, const Line& b) {
  const Eigen::Vector2d da = a.point(1) - a.point(0), db = b.point(1) - b.point(0);
  Eigen::Matrix2d directions;
  directions << da, -db;
  if (std::abs(directions.determinant()) < 0.05) return std::nullopt;  // all but parallel
  const Eigen::Vector2d t = directions.inverse() * (b.point(0) - a.point(0));
  Eigen::Matrix2d normals;
  normals << a.normal.transpose(), b.normal.transpose();
  const Eigen::Matrix2d inverse = normals.inverse();
  const Eigen::Vector2d across(a.variance(t.x()), b.variance(t.y()));
  const Eigen::Matrix2d covariance = inverse * across.asDiagonal() * inverse.transpose();
  return Crossing{a.point(t.x()), std::sqrt(0.5 * covariance.trace())};
}

}  // namespace

std::optional<TagCorners> refineTagCorners(const Image& image,
                                           const std::array<Eigen::Vector2d, 4>& rough, int cells) {
  if (image.getWidth() < 2 || image.getHeight() < 2) return std::nullopt;
  TagCorners result{rough, {}};
  for (int round = 0; round < kRounds; ++round) {
    const auto& corners = result.corners;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    double area = 0, longest = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      middle += corners[j] / 4;
      const Eigen::Vector2d &a = corners[j], &b = corners[(j + 1) % 4];
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
      longest = std::max(longest, (b - a).norm());
    }
    if (!(longest > 0)) return std::nullopt;
    const double cell = std::abs(area) / longest / cells;
    const double reach = std::clamp(cell - kBlurred_px, kLeastReach_px, kReach_px);
    const double floor_px = kFloor_px + kSmallCellFloor * std::max(0.0, kSmallCell_px - cell);
    SideFitter fitter(image, reach);
    std::array<Line, 4> sides;
    for (std::size_t j = 0; j < 4; ++j) {
      const Eigen::Vector2d &from = corners[j], &to = corners[(j + 1) % 4];
      if (!((to - from).norm() > 2)) return std::nullopt;
      const auto line = fitter.fit(from, to, 0.5 * (from + to) - middle);
      if (!line) return std::nullopt;
      sides[j] = *line;
    }
    for (std::size_t j = 0; j < 4; ++j) {
      const auto crossing = intersect(sides[(j + 3) % 4], sides[j]);
      if (!crossing || (crossing->point - rough[j]).norm() > 2) return std::nullopt;
      result.corners[j] = crossing->point;
      result.sigma_px[j] = std::hypot(crossing->sigma_px, floor_px);
    }
  }
  return result;
}

}  // namespace depthservo::detail
