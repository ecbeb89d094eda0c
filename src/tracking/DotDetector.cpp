#include "tracking/DotDetector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <set>

#include "depthservo/visp/using.h"

namespace depthservo::detail {
namespace {

using Image = vpImage<unsigned char>;

/// Where between dark and light an image is cut in search of dots, and the least difference worth a
/// search.
constexpr std::array kCuts{0.2, 0.35, 0.5, 0.65, 0.8};
constexpr int kLeastRange = 20;

/// So many pixels may be as dark or as light as they like; the dots of a far plate have few more.
constexpr int kMostTail = 16;

/// Around what is looked at in search of a blob nearer than a dot.
constexpr double kRoom_px = 16;

/// More connected parts than this are noise; more dots than this are not considered for the
/// pattern.
constexpr int kMostParts = 5000;
constexpr std::size_t kMostDots = 24;

/// Worst mean of the log ratio between the expected and the measured extent of the dots, and what
/// counts as a tie.
constexpr double kWorstFit = 0.4;
constexpr double kTie = 0.05;

/// Connected pixels on one side of a gray level.
struct Parts {
  Parts(const cv::Mat& pixels, double level, Side side) {
    cv::Mat cut, centroids;
    cv::threshold(pixels, cut, std::floor(level), 255,
                  side == Side::darker ? cv::THRESH_BINARY_INV : cv::THRESH_BINARY);
    count = cv::connectedComponentsWithStats(cut, labels, stats, centroids, 4, CV_32S);
  }
  /// In the coordinates of `pixels`.
  Box box(int part) const {
    const int* s = stats.ptr<int>(part);
    const int u = s[cv::CC_STAT_LEFT], v = s[cv::CC_STAT_TOP];
    return {u, v, u + s[cv::CC_STAT_WIDTH] - 1, v + s[cv::CC_STAT_HEIGHT] - 1};
  }
  /// The part at a point; 0 when there is none.
  int at(const Eigen::Vector2d& point) const {
    const cv::Point pixel(static_cast<int>(std::lround(point.x())),
                          static_cast<int>(std::lround(point.y())));
    return cv::Rect({0, 0}, labels.size()).contains(pixel) ? labels.at<int>(pixel) : 0;
  }
  int area(int part) const { return stats.at<int>(part, cv::CC_STAT_AREA); }

  int count = 0;  // with 0, what is on the other side
  cv::Mat labels, stats;
};

/// Whether the part may be a dot that is not the one with this core: large enough, smaller than the
/// background, and not around that dot.
bool isOther(const Parts& parts, int part, const Box& core, const DotLimits& limits) {
  const Box b = parts.box(part);
  const bool isThrough = (b.left == 0 && b.right == parts.labels.cols - 1) ||
                         (b.top == 0 && b.bottom == parts.labels.rows - 1);
  const bool isAround =
      b.left <= core.left && b.right >= core.right && b.top <= core.top && b.bottom >= core.bottom;
  const bool isSized = std::max(b.width(), b.height()) <= 2 * limits.most_radius_px &&
                       parts.area(part) >= M_PI * limits.least_radius_px * limits.least_radius_px;
  return isSized && !isThrough && !isAround;
}

/// Whether a part that may be another dot, and is none of those to be left out, has a pixel within
/// `reach` of the position.
bool hasOtherWithin(const Parts& parts, const std::set<int>& leftOut, const Box& core,
                    const Eigen::Vector2d& position, double reach, const DotLimits& limits) {
  for (int v = 0; v < parts.labels.rows; ++v) {
    const int* label = parts.labels.ptr<int>(v);
    for (int u = 0; u < parts.labels.cols; ++u) {
      if (label[u] == 0 || !((Eigen::Vector2d(u, v) - position).norm() < reach)) continue;
      if (leftOut.count(label[u]) == 0 && isOther(parts, label[u], core, limits)) return true;
    }
  }
  return false;
}

cv::Mat view(const Image& image, const Box& region) {
  const cv::Mat whole(static_cast<int>(image.getHeight()), static_cast<int>(image.getWidth()),
                      CV_8U, image.bitmap);
  return whole(cv::Rect(region.left, region.top, region.width(), region.height()));
}

/// Gray levels with 1 per mille of the region, and no more than a few pixels, below and above.
std::pair<int, int> range(const cv::Mat& pixels) {
  std::array<int, 256> count{};
  for (int v = 0; v < pixels.rows; ++v) {
    const auto* row = pixels.ptr<unsigned char>(v);
    for (int u = 0; u < pixels.cols; ++u) ++count[row[u]];
  }
  const int tail = std::min(kMostTail, static_cast<int>(pixels.total() / 1000));
  int low = 0, high = 255;
  for (int n = count[low]; n <= tail && low < 255; n += count[low]) ++low;
  for (int n = count[high]; n <= tail && high > 0; n += count[high]) --high;
  return {low, high};
}

/// Homography from the unit square (0,0) (1,0) (1,1) (0,1) to four points (Heckbert, "Fundamentals
/// of texture mapping and image warping", 1989, eq. 2.18-2.19).
Eigen::Matrix3d squareTo(const std::array<Eigen::Vector2d, 4>& p) {
  const Eigen::Vector2d d1 = p[1] - p[2], d2 = p[3] - p[2], s = p[0] - p[1] + p[2] - p[3];
  const double det = d1.x() * d2.y() - d2.x() * d1.y();
  const double g = (s.x() * d2.y() - d2.x() * s.y()) / det;
  const double h = (d1.x() * s.y() - s.x() * d1.y()) / det;
  Eigen::Matrix3d H;
  H << p[1] - p[0] + g * p[1], p[3] - p[0] + h * p[3], p[0], g, h, 1;
  return H;
}

/// A plate point in the image by a homography, and the derivative.
struct Projected {
  double w;  // > 0: in front, when the homography is signed so
  Eigen::Vector2d point;
  Eigen::Matrix2d J_image_plate;
};
Projected project(const Eigen::Matrix3d& H, const Eigen::Vector2d& p) {
  const Eigen::Vector3d q = H * p.homogeneous();
  Projected r;
  r.w = q.z();
  r.point = q.hnormalized();
  r.J_image_plate = (H.topLeftCorner<2, 2>() - r.point * H.block<1, 2>(2, 0)) / q.z();
  return r;
}

std::vector<Eigen::Vector2d> onPlate(const DotTarget& target) {
  std::vector<Eigen::Vector2d> points;
  for (const Eigen::Vector3d& p : target.points) points.push_back(p.head<2>());
  return points;
}

/// Four points of the plate that span it best: the largest least triangle.
std::optional<std::array<std::size_t, 4>> basis(const std::vector<Eigen::Vector2d>& points) {
  const auto area = [&](std::size_t a, std::size_t b, std::size_t c) {
    const Eigen::Vector2d e = points[b] - points[a], f = points[c] - points[a];
    return std::abs(e.x() * f.y() - e.y() * f.x());
  };
  std::optional<std::array<std::size_t, 4>> best;
  double bestArea = 1e-12;  // m^2: collinear
  const std::size_t n = points.size();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b)
      for (std::size_t c = b + 1; c < n; ++c)
        for (std::size_t d = c + 1; d < n; ++d) {
          const double least =
              std::min({area(a, b, c), area(a, b, d), area(a, c, d), area(b, c, d)});
          if (least > bestArea) bestArea = least, best = {a, b, c, d};
        }
  return best;
}

class Assignment {
 public:
  Assignment(const DotTarget& target, const std::vector<DotMeasurement>& dots)
      : dots_(dots), radius_(target.radius), plate_(onPlate(target)) {
    for (const Eigen::Vector2d& p : plate_) middle_ += p / static_cast<double>(plate_.size());
  }

  std::optional<std::vector<std::size_t>> best() {
    const auto four = basis(plate_);
    if (!four || dots_.size() < plate_.size()) return std::nullopt;
    const auto& b = *four;
    const Eigen::Matrix3d fromPlate =
        squareTo({plate_[b[0]], plate_[b[1]], plate_[b[2]], plate_[b[3]]}).inverse();
    const std::size_t n = dots_.size();
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        for (std::size_t k = 0; k < n; ++k)
          for (std::size_t l = 0; l < n; ++l) {
            if (i == j || i == k || i == l || j == k || j == l || k == l) continue;
            const Eigen::Matrix3d H = squareTo({at(i), at(j), at(k), at(l)}) * fromPlate;
            if (H.allFinite()) consider(H, b, {i, j, k, l});
          }
    return std::move(chosen_);
  }

 private:
  const Eigen::Vector2d& at(std::size_t i) const { return dots_[i].ellipse.centre; }

  void consider(Eigen::Matrix3d H, const std::array<std::size_t, 4>& ids,
                const std::array<std::size_t, 4>& found) {
    if (project(H, middle_).w < 0) H = -H;
    std::vector<std::size_t>& dotOf = scratch_;
    dotOf.assign(plate_.size(), dots_.size());
    for (std::size_t i = 0; i < 4; ++i) dotOf[ids[i]] = found[i];
    double sumLog = 0, sumLog2 = 0;
    for (std::size_t i = 0; i < plate_.size(); ++i) {
      const Projected p = project(H, plate_[i]);
      const bool isFront = p.w > 0 && p.J_image_plate.determinant() > 0;
      if (!isFront) return;
      if (dotOf[i] == dots_.size()) dotOf[i] = nearest(p.point);
      if (dotOf[i] == dots_.size()) return;
      const Eigen::Vector2d logs = logRatio(p.J_image_plate, dots_[dotOf[i]].ellipse.shape);
      sumLog += logs.sum();
      sumLog2 += logs.squaredNorm();
    }
    const double n = 2 * static_cast<double>(plate_.size());
    const double mean = radius_ > 0 ? 0 : sumLog / n;  // without a radius any common scale will do
    const double fit = std::sqrt(std::max(0.0, sumLog2 / n - mean * mean));
    if (!(fit < kWorstFit)) return;
    const Eigen::Vector2d x = project(H, middle_).J_image_plate.col(0).normalized();
    const bool isTie = std::abs(fit - fit_) < kTie;
    if (isTie ? x.x() > upright_ : fit < fit_) {
      fit_ = isTie ? std::min(fit, fit_) : fit;
      upright_ = x.x();
      chosen_ = dotOf;
    }
  }

  /// The dot that contains the point; dots_.size() when there is none.
  std::size_t nearest(const Eigen::Vector2d& point) const {
    const auto hit = std::find_if(dots_.begin(), dots_.end(), [&](const DotMeasurement& dot) {
      return (dot.ellipse.centre - point).norm() < 0.5 * dot.ellipse.semiAxes().y();
    });
    return static_cast<std::size_t>(hit - dots_.begin());
  }

  /// Half the logarithms of the eigenvalues of measured over expected shape: relative errors of
  /// extent.
  Eigen::Vector2d logRatio(const Eigen::Matrix2d& J_image_plate,
                           const Eigen::Matrix2d& shape) const {
    const double r = radius_ > 0 ? radius_ : 1;
    const Eigen::Matrix2d inverse = (r * J_image_plate).inverse();
    const Eigen::Matrix2d ratio = inverse * shape * inverse.transpose();
    const double half = 0.5 * ratio.trace(), det = ratio.determinant();
    const double root = std::sqrt(std::max(0.0, half * half - det));
    return {0.5 * std::log(half + root), 0.5 * std::log(det / (half + root))};
  }

  const std::vector<DotMeasurement>& dots_;
  double radius_;
  std::vector<Eigen::Vector2d> plate_;
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
  std::vector<std::size_t> scratch_;
  std::optional<std::vector<std::size_t>> chosen_;
  double fit_ = kWorstFit, upright_ = -2;
};

}  // namespace

Box boxAround(const Eigen::Vector2d& centre, double reach, const Image& image) {
  const auto cut = [](double x, unsigned size) {
    return static_cast<int>(std::clamp(x, 0.0, static_cast<double>(size) - 1));
  };
  return {cut(centre.x() - reach, image.getWidth()), cut(centre.y() - reach, image.getHeight()),
          cut(centre.x() + reach, image.getWidth()), cut(centre.y() + reach, image.getHeight())};
}

double distanceTo(const Ellipse& ellipse, const Eigen::Vector2d& point) {
  const Eigen::Vector2d way = point - ellipse.centre;
  const double radii = std::sqrt(way.dot(ellipse.shape.inverse() * way));
  return radii <= 1 ? 0 : way.norm() * (1 - 1 / radii);
}

bool isSame(const DotMeasurement& a, const DotMeasurement& b) {
  const double reach = 0.5 * std::min(a.ellipse.semiAxes().y(), b.ellipse.semiAxes().y());
  return (a.ellipse.centre - b.ellipse.centre).norm() < reach;
}

bool hasFourInGeneralPosition(const DotTarget& target) {
  return basis(onPlate(target)).has_value();
}

std::vector<DotMeasurement> dotsAtLevel(const Image& image, const Box& region, double level,
                                        Side side, const DotLimits& limits) {
  const Parts parts(view(image, region), level, side);
  std::vector<DotMeasurement> dots;
  if (parts.count > kMostParts) return dots;
  const double most = 2 * limits.most_radius_px, least = 2 * limits.least_radius_px;
  for (int i = 1; i < parts.count; ++i) {
    const Box b = parts.box(i);
    const int w = b.width(), h = b.height();
    const bool isCut = b.left == 0 || b.top == 0 || b.right == region.width() - 1 ||
                       b.bottom == region.height() - 1;
    if (isCut || w > most || h > most || w + 2 < least || h + 2 < least) continue;
    const Box core{region.left + b.left, region.top + b.top, region.left + b.right,
                   region.top + b.bottom};
    const auto dot = measureDot(image, core);
    if (dot && (dot->contrast < 0) == (side == Side::darker)) dots.push_back(*dot);
  }
  return dots;
}

std::vector<DotMeasurement> dotsAtAnyLevel(const Image& image, const Box& region,
                                           const DotLimits& limits) {
  std::vector<DotMeasurement> dots;
  const auto [low, high] = range(view(image, region));
  if (high - low < kLeastRange) return dots;
  for (const Side side : {Side::darker, Side::lighter}) {
    if (!(side == Side::darker ? limits.dark : limits.light)) continue;
    for (const double cut : kCuts) {
      for (const auto& dot : dotsAtLevel(image, region, low + cut * (high - low), side, limits)) {
        const auto same = std::find_if(dots.begin(), dots.end(),
                                       [&](const auto& other) { return isSame(dot, other); });
        if (same == dots.end()) {
          dots.push_back(dot);
        } else if (std::abs(dot.contrast) > std::abs(same->contrast)) {
          *same = dot;
        }
      }
    }
  }
  return dots;
}

bool isAnotherWithin(const Image& image, const Eigen::Vector2d& position, double reach,
                     const DotMeasurement& dot,
                     const std::vector<std::optional<DotMeasurement>>& known,
                     const DotLimits& limits) {
  if (reach <= 0) return false;
  const double all =
      (dot.ellipse.centre - position).norm() + 3 * dot.ellipse.semiAxes().x() + kRoom_px;
  const Box region = boxAround(position, std::max(reach, all), image);
  const Eigen::Vector2d corner(region.left, region.top);
  const Eigen::Vector2d centre = dot.ellipse.centre - corner;
  const Eigen::Vector2d half = dot.ellipse.shape.diagonal().cwiseSqrt();
  const Box core{static_cast<int>(std::ceil(centre.x() - half.x())),
                 static_cast<int>(std::ceil(centre.y() - half.y())),
                 static_cast<int>(centre.x() + half.x()), static_cast<int>(centre.y() + half.y())};
  const Side side = dot.contrast < 0 ? Side::darker : Side::lighter;
  return std::any_of(kCuts.begin(), kCuts.end(), [&](double cut) {
    const Parts parts(view(image, region), dot.background + cut * dot.contrast, side);
    std::set<int> leftOut{parts.at(centre)};
    for (const auto& other : known) {
      if (other) leftOut.insert(parts.at(other->ellipse.centre - corner));
    }
    return hasOtherWithin(parts, leftOut, core, position - corner, reach, limits);
  });
}

std::optional<std::vector<std::size_t>> assignDots(const DotTarget& target,
                                                   const std::vector<DotMeasurement>& dots) {
  // All of one polarity, the clearest first when there are too many.
  std::optional<std::vector<std::size_t>> chosen;
  for (const bool dark : {true, false}) {
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < dots.size(); ++i) {
      if ((dots[i].contrast < 0) == dark) index.push_back(i);
    }
    std::sort(index.begin(), index.end(), [&](std::size_t a, std::size_t b) {
      return std::abs(dots[a].contrast) > std::abs(dots[b].contrast);
    });
    index.resize(std::min(index.size(), kMostDots));
    std::vector<DotMeasurement> some;
    for (const std::size_t i : index) some.push_back(dots[i]);
    chosen = Assignment(target, some).best();
    if (!chosen) continue;
    for (std::size_t& i : *chosen) i = index[i];
    return chosen;
  }
  return chosen;
}

}  // namespace depthservo::detail
