#include "tracking/DotMeasurement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "depthservo/visp/using.h"

namespace depthservo::detail {
namespace {

using Image = vpImage<unsigned char>;

/// Pixels around the core that are looked at, one more for every so many pixels of its extent; how
/// far the sums reach beyond the dot, and where the background begins.
constexpr int kMargin_px = 4, kExtentPerMargin = 20;
constexpr double kMaskMargin_px = 1.5, kBackgroundMargin_px = 2;

/// Least gray level difference of a dot from its background, most noise as a fraction of it, and
/// least semi-axis [px].
constexpr double kLeastContrast = 12, kMostNoise = 0.1;
constexpr double kThinnest_px = 0.8;

/// Widest core [px]: the integer sums over a row hold that much.
constexpr int kWidest_px = 420;

/// Around the dot, pixels farther than this fraction of the contrast from the background are
/// something else; at least this fraction must be background.
constexpr double kBackgroundSpread = 0.25;
constexpr double kLeastBackground = 0.4;

/// Area by weight over area of the ellipse with the same second moments: 1 for an ellipse.
constexpr double kLeastFill = 0.85, kMostFill = 1.15;

/// Half of the rays along which the outline is located, and how far about it [px].
constexpr int kRayPairs = 8;
constexpr double kRayReach_px = 2.5;
constexpr double kRayStep_px = 0.5;

/// Opposite ends of the outline may differ by this much, [px] and as a fraction of the semi-minor
/// axis; and what is left of the outline's distance from the ellipse without its second harmonic
/// (that of motion blur) may be so large.
constexpr double kAsymmetry_px = 0.45, kAsymmetry = 0.01;
constexpr double kDeviation_px = 0.5, kDeviation = 0.05;

/// Standard deviation of rounding to a gray level, and of the centre without any noise: floor +
/// part/minor [px].
constexpr double kRoundingNoise = 0.29;
constexpr double kSigmaFloor_px = 0.003, kSigmaSmall_px2 = 0.03;

/// Share of the background's slope that the dot itself may have: its centre of light moves by slope
/// r^2/(4 contrast).
constexpr double kUnevenLight = 0.5;

/// b(u, v) = level + slope.(p - origin), and what it stands on.
struct Background {
  double level = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  double noise = 0;                                         ///< standard deviation of a pixel
  Eigen::Vector2d slopeVariance = Eigen::Vector2d::Zero();  ///< over noise^2
  double at(double u, double v) const {
    return level + slope.x() * (u - origin.x()) + slope.y() * (v - origin.y());
  }
};

struct Moments {
  double weight = 0;
  Ellipse ellipse;
};

/// Sums of w, w x, w y, w x^2, w x y, w y^2 with (x, y) relative to an origin near the dot.
class MomentSums {
 public:
  explicit MomentSums(const Eigen::Vector2d& origin) : origin_(origin) {}
  void addRow(double y, double s0, double s1, double s2) {
    weight_ += s0, x_ += s1, y_ += y * s0, xx_ += s2, xy_ += y * s1, yy_ += y * y * s0;
  }
  std::optional<Moments> moments() const {
    if (!(weight_ > 0)) return std::nullopt;
    const Eigen::Vector2d mean(x_ / weight_, y_ / weight_);
    Eigen::Matrix2d square;
    square << xx_, xy_, xy_, yy_;
    constexpr double kPixel = 1.0 / 12;
    const Eigen::Matrix2d covariance = square / weight_ - mean * mean.transpose();
    Moments m{weight_, {origin_ + mean, 4 * (covariance - kPixel * Eigen::Matrix2d::Identity())}};
    // Also refuses NaN.
    if (!(m.ellipse.shape.determinant() > 0 && m.ellipse.shape(0, 0) > 0)) return std::nullopt;
    if (!(m.ellipse.semiAxes().y() > kThinnest_px)) return std::nullopt;
    return m;
  }

 private:
  Eigen::Vector2d origin_;
  double weight_ = 0, x_ = 0, y_ = 0, xx_ = 0, xy_ = 0, yy_ = 0;
};

/// The columns of a row that lie in an ellipse widened by m [px], within a window.
class Mask {
 public:
  Mask(const Ellipse& ellipse, const Box& window, double m)
      : window_(window), centre_(ellipse.centre) {
    const Eigen::Vector2d axes = ellipse.semiAxes();
    // Semi-axes (a, b) become (a + m, b + m), along the same directions.
    const double sum = axes.x() + axes.y();
    shape_ = (1 + 2 * m / sum) * ellipse.shape;
    shape_.diagonal().array() += m * m + 2 * m * axes.x() * axes.y() / sum;
  }
  struct Span {
    int begin, end;  // half-open
  };
  Span row(int v) const {
    const double y = v - centre_.y();
    const double d = shape_(1, 1) - y * y;
    if (d <= 0) return {window_.right + 1, window_.right + 1};
    const double half = std::sqrt(d * shape_.determinant()) / shape_(1, 1);
    const double middle = centre_.x() + shape_(0, 1) / shape_(1, 1) * y;
    const int begin = std::max(window_.left, static_cast<int>(std::ceil(middle - half)));
    const int end = std::min(window_.right, static_cast<int>(std::floor(middle + half))) + 1;
    return {begin, std::max(begin, end)};
  }

 private:
  Box window_;
  Eigen::Vector2d centre_;
  Eigen::Matrix2d shape_;
};

Eigen::Vector2d middle(const Box& box) {
  return {0.5 * (box.left + box.right), 0.5 * (box.top + box.bottom)};
}

/// Median gray level on the outline of the window.
double medianOnOutline(const Image& image, const Box& w) {
  std::array<int, 256> count{};
  for (int u = w.left; u <= w.right; ++u) ++count[image[w.top][u]], ++count[image[w.bottom][u]];
  for (int v = w.top; v <= w.bottom; ++v) ++count[image[v][w.left]], ++count[image[v][w.right]];
  int half = w.width() + w.height();
  int level = 0;
  while ((half -= count[level]) > 0) ++level;
  return level;
}

/// Mean gray level of the middle of the core.
double meanInCore(const Image& image, const Box& core) {
  const Eigen::Vector2d c = middle(core);
  const int reach = std::min(core.width(), core.height()) / 6;
  double sum = 0;
  int n = 0;
  for (int v = static_cast<int>(c.y()) - reach; v <= static_cast<int>(c.y()) + reach; ++v) {
    for (int u = static_cast<int>(c.x()) - reach; u <= static_cast<int>(c.x()) + reach; ++u) {
      sum += image[v][u];
      ++n;
    }
  }
  return sum / n;
}

/// First guess of the ellipse: of the pixels that are more like the dot than like the background,
/// all alike.
std::optional<Moments> roughMoments(const Image& image, const Box& box, double background,
                                    double contrast) {
  const Eigen::Vector2d origin = middle(box);
  MomentSums sums(origin);
  const int cut = static_cast<int>(std::floor(background + 0.5 * contrast));
  const bool isDark = contrast < 0;
  const double shift = box.left - origin.x();
  for (int v = box.top; v <= box.bottom; ++v) {
    const unsigned char* row = image[v] + box.left;
    int n = 0, x1 = 0, x2 = 0;
    for (int x = 0; x < box.width(); ++x) {
      const int kept = (row[x] <= cut) == isDark ? 1 : 0;
      n += kept, x1 += kept * x, x2 += kept * x * x;
    }
    sums.addRow(v - origin.y(), n, x1 + shift * n, x2 + shift * (2.0 * x1 + shift * n));
  }
  return sums.moments();
}

/// The plane through the pixels of the window outside the mask that are within `spread` of `level`.
std::optional<Background> fitBackground(const Image& image, const Box& window, const Mask& mask,
                                        double level, double spread) {
  const Eigen::Vector2d origin = middle(window);
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double square = 0, seen = 0;
  const int flat = static_cast<int>(level);
  const int most = static_cast<int>(spread);
  const auto add = [&](int begin, int end, int v) {
    const unsigned char* row = image[v] + begin;
    int n = 0, x1 = 0, x2 = 0, i1 = 0, ix = 0, ii = 0;
    for (int x = 0; x < end - begin; ++x) {
      const int I = row[x] - flat;
      const int kept = std::abs(I) <= most ? 1 : 0;
      const int i = kept * I;
      n += kept, x1 += kept * x, x2 += kept * x * x;
      i1 += i, ix += i * x, ii += i * i;
    }
    seen += end - begin;
    const double shift = begin - origin.x(), y = v - origin.y();
    const double X = x1 + shift * n;
    A(0, 0) += n, A(0, 1) += X, A(0, 2) += y * n;
    A(1, 1) += x2 + shift * (2.0 * x1 + shift * n), A(1, 2) += y * X, A(2, 2) += y * y * n;
    b += Eigen::Vector3d(i1, ix + shift * i1, y * i1);
    square += ii;
  };
  for (int v = window.top; v <= window.bottom; ++v) {
    const Mask::Span span = mask.row(v);
    add(window.left, std::min(span.begin, window.right + 1), v);
    add(span.end, window.right + 1, v);
  }
  const double n = A(0, 0);
  if (!(n >= 8 && n >= kLeastBackground * seen)) return std::nullopt;
  const Eigen::Matrix3d inverse =
      A.selfadjointView<Eigen::Upper>().ldlt().solve(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d fit = inverse * b;
  if (!fit.allFinite()) return std::nullopt;
  const double residual2 = std::max(0.0, square - fit.dot(b)) / (n - 3);
  return Background{flat + fit(0), fit.tail<2>(), origin,
                    std::max(kRoundingNoise, std::sqrt(residual2)), inverse.diagonal().tail<2>()};
}

/// The measuring sums, and how the noise of a pixel, and of the background's slope, enters the
/// centre.
struct FineSums {
  std::optional<Moments> moments;
  Eigen::Vector2d lever2 = Eigen::Vector2d::Zero();  ///< sum of (p - centre)^2 over the mask
};

FineSums fineMoments(const Image& image, const Box& window, const Mask& mask,
                     const Background& background, double contrast) {
  const Eigen::Vector2d origin = middle(window);
  MomentSums sums(origin);
  FineSums fine;
  const double scale = 1 / contrast, slope = background.slope.x();
  for (int v = window.top; v <= window.bottom; ++v) {
    const Mask::Span span = mask.row(v);
    const int n = span.end - span.begin;
    if (n <= 0) continue;
    // Raw sums about the middle of the row; the background's are closed forms.
    const int half = n / 2;
    const unsigned char* row = image[v] + span.begin;
    int i0 = 0, i1 = 0, i2 = 0;
    for (int k = 0; k < n; ++k) {
      const int x = k - half;
      const int I = row[k];
      i0 += I, i1 += I * x, i2 += I * x * x;
    }
    // Sums of x, x^2 and x^3 over the row: about its exact centre c the odd ones vanish.
    const double c = 0.5 * (n - 1) - half, spread = n * (static_cast<double>(n) * n - 1) / 12;
    const double x1 = n * c, x2 = spread + n * c * c, x3 = c * (3 * spread + n * c * c);
    const double first = background.at(span.begin + half, v);
    const double s0 = scale * (i0 - first * n - slope * x1);
    const double s1 = scale * (i1 - first * x1 - slope * x2);
    const double s2 = scale * (i2 - first * x2 - slope * x3);
    const double shift = span.begin + half - origin.x(), y = v - origin.y();
    sums.addRow(y, s0, s1 + shift * s0, s2 + shift * (2 * s1 + shift * s0));
    fine.lever2 += Eigen::Vector2d(x2 + shift * (2 * x1 + shift * n), n * y * y);
  }
  fine.moments = sums.moments();
  return fine;
}

/// Bilinear gray level; (u, v) must lie inside the image.
float interpolate(const Image& image, float u, float v) {
  const int i = static_cast<int>(v), j = static_cast<int>(u);
  const float y = v - static_cast<float>(i), x = u - static_cast<float>(j);
  const unsigned char* above = image[i] + j;
  const unsigned char* below = image[i + 1] + j;
  const float top = static_cast<float>(above[0]) + x * static_cast<float>(above[1] - above[0]);
  const float bottom = static_cast<float>(below[0]) + x * static_cast<float>(below[1] - below[0]);
  return top + y * (bottom - top);
}

/// The directions of half of the rays.
struct Rays {
  std::array<Eigen::Vector2d, kRayPairs> direction,
      doubled;  // at the angle, and at twice the angle
  Rays() {
    for (int k = 0; k < kRayPairs; ++k) {
      const double angle = M_PI * k / kRayPairs;
      direction[k] = {std::cos(angle), std::sin(angle)};
      doubled[k] = {std::cos(2 * angle), std::sin(2 * angle)};
    }
  }
};

/// Where the outline is along rays from the centre, relative to the ellipse, must be alike at
/// opposite ends.
bool isWhole(const Image& image, const Ellipse& ellipse, const Background& background,
             double contrast) {
  const Eigen::Matrix2d root =
      ellipse.shape.llt().matrixL();  // maps the unit circle to the ellipse
  const double minor = ellipse.semiAxes().y();
  const double reach = std::min(0.9, kRayReach_px / minor);
  const int steps = std::max(4, static_cast<int>(std::ceil(2 * reach * minor / kRayStep_px)));
  const Eigen::Vector2d outermost = (1 + reach) * ellipse.shape.diagonal().cwiseSqrt();
  const Eigen::Vector2d low = ellipse.centre - outermost, high = ellipse.centre + outermost;
  if (!(low.minCoeff() >= 0 && high.x() < image.getWidth() - 1.0 &&
        high.y() < image.getHeight() - 1.0)) {
    return false;
  }
  const auto centre = ellipse.centre.cast<float>().eval();
  const auto extent = [&](const Eigen::Vector2d& ray) {
    // The coverage w = (I - b)/contrast along p = centre + q ray is offset + a q by the plane, and
    // I.
    const double level = background.at(ellipse.centre.x(), ellipse.centre.y());
    const auto scale = static_cast<float>(1 / contrast);
    const auto offset = static_cast<float>(level / contrast);
    const auto perQ = static_cast<float>(background.slope.dot(ray) / contrast);
    const auto u = static_cast<float>(ray.x()), v = static_cast<float>(ray.y());
    const auto firstQ = static_cast<float>(1 - reach + reach / steps);
    const auto stepQ = static_cast<float>(2 * reach / steps);
    float covered = 0;
    for (int k = 0; k < steps; ++k) {
      const float q = firstQ + static_cast<float>(k) * stepQ;
      const float I = interpolate(image, centre.x() + q * u, centre.y() + q * v);
      covered += std::min(1.0f, std::max(0.0f, I * scale - offset - perQ * q));
    }
    return (2 * static_cast<double>(covered) / steps - 1) * reach * minor;
  };
  static const Rays rays;
  const double noise = 4 * background.noise / std::abs(contrast);
  Eigen::Array<double, kRayPairs, 1> deviation;  // mean of opposite ends
  double mean = 0;
  Eigen::Vector2d second(0, 0);  // its mean and second harmonic over the angle
  for (int k = 0; k < kRayPairs; ++k) {
    const Eigen::Vector2d ray = root * rays.direction[k];
    const double one = extent(ray), other = extent(-ray);
    if (std::abs(one - other) > kAsymmetry_px + kAsymmetry * minor + noise) return false;
    deviation(k) = 0.5 * (one + other);
    mean += deviation(k) / kRayPairs;
    second += 2 * deviation(k) / kRayPairs * rays.doubled[k];
  }
  for (int k = 0; k < kRayPairs; ++k) deviation(k) -= mean + second.dot(rays.doubled[k]);
  return deviation.abs().maxCoeff() <= kDeviation_px + kDeviation * minor + noise;
}

}  // namespace

std::optional<DotMeasurement> measureDot(const Image& image, const Box& core) {
  const int margin = kMargin_px + std::min(core.width(), core.height()) / kExtentPerMargin;
  const Box window{core.left - margin, core.top - margin, core.right + margin,
                   core.bottom + margin};
  if (core.width() < 1 || core.height() < 1 || core.width() > kWidest_px || window.left < 0 ||
      window.top < 0 || window.right >= static_cast<int>(image.getWidth()) ||
      window.bottom >= static_cast<int>(image.getHeight())) {
    return std::nullopt;
  }
  const double level = medianOnOutline(image, window);
  const double contrast = meanInCore(image, core) - level;
  if (!(std::abs(contrast) >= kLeastContrast)) return std::nullopt;

  const Box near{core.left - 2, core.top - 2, core.right + 2, core.bottom + 2};
  const auto rough = roughMoments(image, near, level, contrast);
  if (!rough) return std::nullopt;
  const Mask mask(rough->ellipse, window, kMaskMargin_px);
  const Mask widerMask(rough->ellipse, window, kBackgroundMargin_px);
  const auto background =
      fitBackground(image, window, widerMask, level, kBackgroundSpread * std::abs(contrast));
  if (!background) return std::nullopt;

  const Eigen::Vector2d c = rough->ellipse.centre;
  const double fineContrast = contrast + level - background->at(c.x(), c.y());
  if (!(std::abs(fineContrast) >= kLeastContrast)) return std::nullopt;
  if (background->noise > kMostNoise * std::abs(fineContrast)) return std::nullopt;
  const FineSums fine = fineMoments(image, window, mask, *background, fineContrast);
  if (!fine.moments) return std::nullopt;

  const Ellipse& ellipse = fine.moments->ellipse;
  const double weight = fine.moments->weight;
  const double fill = weight / ellipse.area();
  if (!(fill > kLeastFill && fill < kMostFill)) return std::nullopt;
  if (!isWhole(image, ellipse, *background, fineContrast)) return std::nullopt;

  const Eigen::Vector2d variance =
      (fine.lever2.array() + fine.lever2.array().square() * background->slopeVariance.array()) *
      std::pow(background->noise / (weight * fineContrast), 2);
  const Eigen::Vector2d axes = ellipse.semiAxes();
  const double unevenLight =
      kUnevenLight * background->slope.norm() * axes.x() * axes.x() / (4 * std::abs(fineContrast));
  const double floor = kSigmaFloor_px + kSigmaSmall_px2 / axes.y() + unevenLight;
  DotMeasurement dot;
  dot.ellipse = ellipse;
  dot.background = background->at(ellipse.centre.x(), ellipse.centre.y());
  dot.contrast = fineContrast;
  dot.sigma_px = std::sqrt(0.5 * variance.sum() + floor * floor);
  return dot;
}

std::optional<Box> coreNear(const Image& image, const DotMeasurement& last,
                            const Eigen::Vector2d& position) {
  constexpr int kTries = 3;
  const Eigen::Vector2d half = last.ellipse.shape.diagonal().cwiseSqrt();
  const Eigen::Vector2d reach = half.array() + kMargin_px;
  const auto inside = [&](const Eigen::Vector2d& p) {
    return (p - reach).minCoeff() >= 0 && p.x() + reach.x() <= image.getWidth() - 1.0 &&
           p.y() + reach.y() <= image.getHeight() - 1.0;
  };
  const auto around = [](const Eigen::Vector2d& p, const Eigen::Vector2d& h) {
    return Box{
        static_cast<int>(std::lround(p.x() - h.x())), static_cast<int>(std::lround(p.y() - h.y())),
        static_cast<int>(std::lround(p.x() + h.x())), static_cast<int>(std::lround(p.y() + h.y()))};
  };
  Eigen::Vector2d centre = position;
  for (int k = 0; k < kTries; ++k) {
    if (!inside(centre)) return std::nullopt;
    const auto rough = roughMoments(image, around(centre, reach), last.background, last.contrast);
    if (!rough) return std::nullopt;
    const Eigen::Vector2d step = rough->ellipse.centre - centre;
    centre = rough->ellipse.centre;
    if (step.norm() < 1) {
      const Eigen::Vector2d now = rough->ellipse.shape.diagonal().cwiseSqrt();
      return around(centre, (now.array() - 0.5).max(1));
    }
  }
  return std::nullopt;
}

}  // namespace depthservo::detail
