#include "depthservo/simulation/SyntheticCamera.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "depthservo/visp/using.h"
#include "simulation/PatchPainter.h"
#include "simulation/drawing.h"
#include "simulation/sensorNoise.h"
#include "text/require.h"

namespace depthservo {
namespace {

using detail::PixelBox;

/// Semi-axis [px] below which a disc is not drawn, and below which its pixels are sampled.
constexpr double kThinnest = 1e-3;
constexpr double kThin = 1;
constexpr int kSamples = 8;

/// Adds `weight` times the covered part of every pixel of the box.
class EllipseCoverage {
 public:
  explicit EllipseCoverage(const Ellipse& ellipse)
      : centre_(ellipse.centre.cast<float>()),
        inverse_(ellipse.shape.inverse().cast<float>()),
        isThin_(!(ellipse.semiAxes().y() > kThin)) {}

  void addTo(float* coverage, const PixelBox& box, float weight) const {
    for (int v = box.top; v < box.bottom; ++v, coverage += box.width()) {
      isThin_ ? addSampledRow(coverage, box, v, weight) : addRow(coverage, box, v, weight);
    }
  }

 private:
  void addRow(float* row, const PixelBox& box, int v, float weight) const {
    const float y = static_cast<float>(v) - centre_.y();
    const float a = inverse_(0, 0), b = inverse_(0, 1), c = inverse_(1, 1);
    const int n = box.width();
    const float left = static_cast<float>(box.left) - centre_.x();
    for (int k = 0; k < n; ++k) {
      const float x = left + static_cast<float>(k);
      const float gx = a * x + b * y, gy = b * x + c * y;
      const float q = std::sqrt(x * gx + y * gy);
      const float slope = std::sqrt(gx * gx + gy * gy) + 1e-12f;
      const float covered = 0.5f - q * (q - 1) / slope;
      // At the very centre the slope vanishes with q; there the pixel is inside.
      row[k] += weight * (q < 1e-6f ? 1.0f : std::min(1.0f, std::max(0.0f, covered)));
    }
  }

  void addSampledRow(float* row, const PixelBox& box, int v, float weight) const {
    for (int k = 0; k < box.width(); ++k) {
      int inside = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const auto offset = [](int j) { return (static_cast<float>(j) + 0.5f) / kSamples - 0.5f; };
        const Eigen::Vector2f p(static_cast<float>(box.left + k) + offset(i % kSamples),
                                static_cast<float>(v) + offset(i / kSamples));
        inside += (p - centre_).dot(inverse_ * (p - centre_)) < 1;
      }
      row[k] += weight * static_cast<float>(inside) / (kSamples * kSamples);
    }
  }

  Eigen::Vector2f centre_;
  Eigen::Matrix2f inverse_;
  bool isThin_;
};

template <typename Pixel>
Pixel toPixel(float gray) {
  if constexpr (std::is_same_v<Pixel, unsigned char>) {
    return static_cast<unsigned char>(std::clamp(gray, 0.0f, 255.0f) + 0.5f);
  } else {
    return gray;
  }
}

}  // namespace

SyntheticCamera::SyntheticCamera(SyntheticCamera&&) noexcept = default;
SyntheticCamera::~SyntheticCamera() = default;

SyntheticCamera::SyntheticCamera(const PinholeCamera& camera, const DotTarget& target,
                                 const SyntheticCameraOptions& options)
    : camera_(camera), target_(target), options_(options) {
  detail::require("SyntheticCamera", std::isfinite(target.radius) && target.radius > 0,
                  "the dots need a radius > 0 m");
  prepare();
}

SyntheticCamera::SyntheticCamera(const PinholeCamera& camera, std::vector<GrayPatch> patches,
                                 const SyntheticCameraOptions& options)
    : camera_(camera),
      patches_(std::move(patches)),
      options_(options),
      painter_(std::make_unique<detail::PatchPainter>(camera)) {
  for (const GrayPatch& patch : patches_) {
    detail::require("SyntheticCamera",
                    std::isfinite(patch.width) && patch.width > 0 && std::isfinite(patch.height) &&
                        patch.height > 0,
                    "a patch needs a width and a height > 0 m");
    detail::require("SyntheticCamera",
                    patch.columns >= 1 && patch.rows >= 1 &&
                        patch.gray.size() == static_cast<std::size_t>(patch.columns) *
                                                 static_cast<std::size_t>(patch.rows),
                    "a patch needs columns x rows gray levels");
  }
  prepare();
}

void SyntheticCamera::prepare() {
  const PinholeCamera& camera = camera_;
  const SyntheticCameraOptions& options = options_;
  const auto isGray = [](double gray) { return gray >= 0 && gray <= 255; };
  detail::require("SyntheticCamera", camera.width > 0 && camera.height > 0,
                  "the image has no size");
  detail::require("SyntheticCamera", std::isnormal(camera.fx) && std::isnormal(camera.fy),
                  "the focal length must not be 0");
  detail::require("SyntheticCamera", camera.distortion.isNone(),
                  "images are drawn without lens distortion");
  detail::require("SyntheticCamera", std::isfinite(camera.cx) && std::isfinite(camera.cy),
                  "cx, cy must be finite");
  detail::require("SyntheticCamera", isGray(options.background) && isGray(options.dot),
                  "gray levels are 0..255");
  detail::require("SyntheticCamera", options.gray_noise >= 0 && options.gray_noise <= 255,
                  "gray_noise is 0..255");
  detail::require("SyntheticCamera", options.exposure_s >= 0 && std::isfinite(options.exposure_s),
                  "exposure_s is >= 0 s");
  detail::require("SyntheticCamera", options.vignetting >= 0 && options.vignetting <= 1,
                  "vignetting is 0..1");

  exposed_.reserve(detail::kMostInstants);
  if (options.vignetting > 0) gain_ = detail::vignette(camera, options.vignetting);
  if (options.gray_noise > 0) noiseQuantiles_ = detail::normalQuantiles(options.gray_noise);
  if (!gain_.empty() || !noiseQuantiles_.empty()) {
    light_.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  }
}

std::optional<Eigen::Vector2d> SyntheticCamera::centre(const Eigen::Isometry3d& cMo,
                                                       std::size_t i) const {
  const Eigen::Vector3d p = cMo * target_.points.at(i);
  if (!(p.z() > 0) || !p.allFinite()) return std::nullopt;
  return camera_.toPixel(p.x() / p.z(), p.y() / p.z());
}

std::optional<Ellipse> SyntheticCamera::ellipse(const Eigen::Isometry3d& cMo, std::size_t i) const {
  Eigen::Matrix3d K;
  K << camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1;
  Eigen::Matrix3d H;
  H << target_.radius * cMo.linear().leftCols<2>(), cMo * target_.points.at(i);
  H = K * H;
  const Eigen::Matrix3d dual = H * Eigen::Vector3d(1, 1, -1).asDiagonal() * H.transpose();
  // The whole disc lies before the camera when its centre does and the ellipse is bounded.
  const double w = -dual(2, 2);
  if (!(H(2, 2) > 0 && w > 0)) return std::nullopt;
  Ellipse ellipse;
  ellipse.centre = -dual.block<2, 1>(0, 2) / w;
  ellipse.shape = dual.topLeftCorner<2, 2>() / w + ellipse.centre * ellipse.centre.transpose();
  if (!(ellipse.semiAxes().y() > kThinnest) || !ellipse.shape.allFinite()) return std::nullopt;
  return ellipse;
}

std::optional<Occluder> SyntheticCamera::occluderOf(const Eigen::Isometry3d& cMo, std::size_t i,
                                                    int margin_px) const {
  const auto outline = ellipse(cMo, i);
  if (!outline) return std::nullopt;
  // Larger squares, and centres far off the image, are alike and would not fit in an int.
  static constexpr double kFar = 1e6;
  const double half = std::min(kFar, std::ceil(outline->semiAxes().x()) + margin_px);
  const auto low = [half](double x) {
    return static_cast<int>(std::round(std::clamp(x, -kFar, kFar) - half));
  };
  const int size = 2 * static_cast<int>(half) + 1;
  return Occluder{low(outline->centre.x()), low(outline->centre.y()), size, size};
}

void SyntheticCamera::render(const SyntheticView& view, vpImage<unsigned char>& image) {
  const auto width = static_cast<unsigned>(camera_.width);
  const auto height = static_cast<unsigned>(camera_.height);
  if (image.getWidth() != width || image.getHeight() != height) image.resize(height, width);
  if (light_.empty()) return draw(view, image.bitmap);

  draw(view, light_.data());
  if (!gain_.empty()) {
    std::transform(light_.begin(), light_.end(), gain_.begin(), light_.begin(),
                   [](float light, float gain) { return light * gain; });
  }
  if (!noiseQuantiles_.empty()) {
    detail::addNoise(noiseQuantiles_, options_.seed, view.frame, light_);
  }
  std::transform(light_.begin(), light_.end(), image.bitmap, toPixel<unsigned char>);
}

template <typename Pixel>
void SyntheticCamera::draw(const SyntheticView& view, Pixel* pixels) {
  const auto width = static_cast<std::size_t>(camera_.width);
  std::fill_n(pixels, width * static_cast<std::size_t>(camera_.height),
              toPixel<Pixel>(static_cast<float>(options_.background)));
  for (const std::size_t i : farthestFirst(view)) drawPatch(view, i, pixels);
  for (std::size_t i = 0; i < target_.points.size(); ++i) drawDot(view, i, pixels);
  for (const Occluder& o : view.occluders) {
    const PixelBox box = detail::intersect(o.left, o.top, static_cast<double>(o.left) + o.width,
                                           static_cast<double>(o.top) + o.height, camera_);
    if (box.isEmpty()) continue;
    for (int v = box.top; v < box.bottom; ++v) {
      std::fill_n(pixels + static_cast<std::size_t>(v) * width + box.left, box.width(),
                  toPixel<Pixel>(static_cast<float>(o.gray)));
    }
  }
}

template <typename Pixel>
void SyntheticCamera::drawDot(const SyntheticView& view, std::size_t i, Pixel* pixels) {
  const auto at = [&](double part) {
    return ellipse(detail::during(view, options_.exposure_s, part) * view.cMo, i);
  };
  const auto middle = ellipse(view.cMo, i);
  if (!middle) return;

  exposed_.clear();
  const auto first = options_.exposure_s > 0 ? at(-0.5) : middle;
  const auto last = options_.exposure_s > 0 ? at(0.5) : middle;
  if (!first || !last) return;
  const double path_px = (last->centre - first->centre).norm() +
                         std::abs(last->semiAxes().x() - first->semiAxes().x());
  const int instants = detail::instantsOver(path_px);
  for (int k = 0; k < instants; ++k) {
    const auto outline = path_px > 0 ? at((k + 0.5) / instants - 0.5) : middle;
    if (outline) exposed_.push_back(*outline);
    if (!(path_px > 0)) break;
  }
  if (exposed_.empty()) return;

  Eigen::Vector2d low = Eigen::Vector2d::Constant(HUGE_VAL), high = -low;
  for (Ellipse& outline : exposed_) {
    if (i < view.displacement.size() && view.displacement[i].allFinite()) {
      outline.centre += view.displacement[i];
    }
    const Eigen::Vector2d half = outline.shape.diagonal().cwiseSqrt().array() + 1;
    low = low.cwiseMin(outline.centre - half);
    high = high.cwiseMax(outline.centre + half);
  }
  const PixelBox box = detail::touched(low, high, camera_);
  if (box.isEmpty()) return;

  const auto pixelsPerRow = static_cast<std::size_t>(box.width());
  coverage_.assign(pixelsPerRow * static_cast<std::size_t>(box.height()), 0.0f);
  const float weight = 1 / static_cast<float>(exposed_.size());
  for (const Ellipse& outline : exposed_)
    EllipseCoverage(outline).addTo(coverage_.data(), box, weight);

  const float dot = static_cast<float>(options_.dot);
  const float* covered = coverage_.data();
  for (int v = box.top; v < box.bottom; ++v) {
    Pixel* row = pixels + static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width);
    for (int u = box.left; u < box.right; ++u, ++covered) {
      const float behind = static_cast<float>(row[u]);
      row[u] = toPixel<Pixel>(behind + *covered * (dot - behind));
    }
  }
}

Eigen::Isometry3d SyntheticCamera::patchInCamera(const SyntheticView& view, std::size_t i) const {
  return view.cMo * (i < view.patchPoses.size() ? view.patchPoses[i] : patches_[i].oMp);
}

std::vector<std::size_t> SyntheticCamera::farthestFirst(const SyntheticView& view) const {
  std::vector<std::size_t> order(patches_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return patchInCamera(view, a).translation().z() > patchInCamera(view, b).translation().z();
  });
  return order;
}

std::optional<double> SyntheticCamera::depthAt(const SyntheticView& view, double u,
                                               double v) const {
  const Eigen::Vector2d s = camera_.normalise(u, v);
  const std::vector<std::size_t> order = farthestFirst(view);
  for (auto i = order.rbegin(); i != order.rend(); ++i) {
    const Eigen::Isometry3d cMp = patchInCamera(view, *i);
    if (!detail::isSeenFromTheFront(cMp)) continue;
    const Eigen::Vector3d sight(s.x(), s.y(), 1), normal = cMp.linear().col(2);
    const double Z = normal.dot(cMp.translation()) / normal.dot(sight);
    const Eigen::Vector3d hit = cMp.inverse() * (Z * sight).eval();
    if (Z > detail::kNear && std::abs(hit.x()) <= 0.5 * patches_[*i].width &&
        std::abs(hit.y()) <= 0.5 * patches_[*i].height) {
      return Z;
    }
  }
  return std::nullopt;
}

template <typename Pixel>
void SyntheticCamera::drawPatch(const SyntheticView& view, std::size_t i, Pixel* pixels) {
  Eigen::Matrix3d warp = Eigen::Matrix3d::Identity();
  if (i < view.patchWarps.size() && view.patchWarps[i].allFinite()) warp = view.patchWarps[i];
  const PixelBox box =
      painter_->paint({patches_[i], patchInCamera(view, i), warp, view, options_.exposure_s});
  for (int v = box.top; v < box.bottom; ++v) {
    Pixel* row = pixels + static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width);
    const float* covered = painter_->covered().row(v - box.top);
    const float* light = painter_->light().row(v - box.top);
    float share = 0, gray = 0;
    for (int u = box.left; u < box.right; ++u) {
      share += *covered++;
      gray += *light++;
      const float behind = static_cast<float>(row[u]);
      row[u] = toPixel<Pixel>(gray + (1 - share) * behind);
    }
  }
}

}  // namespace depthservo
