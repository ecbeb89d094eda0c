#include "depthservo/tracking/DotTracker.h"

#include <visp3/blob/vpDot2.h>

#include <algorithm>
#include <string>

#include "depthservo/visp/using.h"
#include "text/require.h"
#include "tracking/DotDetector.h"
#include "tracking/DotMeasurement.h"

namespace depthservo {
namespace {

using detail::Box;
using detail::DotMeasurement;
using Image = vpImage<unsigned char>;

/// How far a dot may be from its place [diameters], and standard deviations of the place.
constexpr double kJumpDiameters = 1.5;
constexpr double kGateSigmas = 4;

/// Factor by which the semi-axes may change between images, its growth per image while hidden, and
/// the most.
constexpr double kScaleChange = 1.35, kScaleChangeHidden = 0.05, kScaleChangeMost = 5;

/// Factor by which the contrast may change, likewise: the light may have been switched.
constexpr double kContrastChange = 2, kContrastChangeHidden = 0.1, kContrastChangeMost = 5;

/// As many dots may look like one; factor by which the size of a dot's double may differ.
constexpr double kDotsThatTouch = 3, kDoubleSize = 1.6;

/// Where a dot should be, and how far from it to look.
struct Place {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double gate_px = 0;
};

struct Dot {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  DotMeasurement last;
  bool wasEverSeen = false;
  bool isSeen = false;
  int hiddenFor = 0;  // images

  double diameter() const { return 2 * last.ellipse.semiAxes().x(); }
  double threshold() const { return last.background + 0.5 * last.contrast; }
};

/// vpDot2's box takes in every pixel that it counts to the dot.
Box boxOf(const vpDot2& finder) {
  const vpRect box = finder.getBBox();
  return {static_cast<int>(box.getLeft()), static_cast<int>(box.getTop()),
          static_cast<int>(box.getRight()), static_cast<int>(box.getBottom())};
}

bool contains(const Image& image, const Eigen::Vector2d& p) {
  return p.x() >= 0 && p.y() >= 0 && p.x() <= image.getWidth() - 1.0 &&
         p.y() <= image.getHeight() - 1.0;
}

}  // namespace

class DotTracker::Impl {
 public:
  Impl(std::size_t count, const DotTrackerOptions& options) : options_(options), dots_(count) {
    detail::require("DotTracker",
                    options.least_radius_px > 0 &&
                        options.least_radius_px < options.most_radius_px &&
                        options.most_radius_px <= 200,
                    "radii are 0 < least < most <= 200 px");
    detail::require("DotTracker", options.start_radius_px >= 0 && options.start_radius_px <= 1e4,
                    "start_radius_px is 0..10000");
    limits_.dark = options.polarity != DotPolarity::lightOnDark;
    limits_.light = options.polarity != DotPolarity::darkOnLight;
    limits_.least_radius_px = options.least_radius_px;
    limits_.most_radius_px = options.most_radius_px;
    finder_.setGraphics(false);
    points_.reserve(count);
  }

  void setStarts(const std::vector<Eigen::Vector2d>& starts) {
    for (std::size_t i = 0; i < starts.size(); ++i) dots_[i].start = starts[i];
  }
  void setTarget(const DotTarget& target) { target_ = target; }

  const std::vector<TrackedPoint>& track(const Image& image,
                                         const std::vector<ExpectedPoint>& expected) {
    try {
      findAll(image, expected);
    } catch (...) {  // of ViSP or OpenCV, for this image only
      for (Dot& dot : dots_) dot.isSeen = false;
    }
    points_.clear();
    for (std::size_t i = 0; i < dots_.size(); ++i) {
      Dot& dot = dots_[i];
      dot.hiddenFor = dot.isSeen ? 0 : dot.hiddenFor + 1;
      const DotMeasurement& m = dot.last;
      if (!dot.isSeen) continue;
      points_.push_back(
          {static_cast<int>(i), m.ellipse.centre.x(), m.ellipse.centre.y(), m.sigma_px});
    }
    return points_;
  }

  std::optional<Ellipse> ellipse(int id) const {
    if (id < 0 || static_cast<std::size_t>(id) >= dots_.size()) return std::nullopt;
    const Dot& dot = dots_[static_cast<std::size_t>(id)];
    return dot.isSeen ? std::optional(dot.last.ellipse) : std::nullopt;
  }

 private:
  void findAll(const Image& image, const std::vector<ExpectedPoint>& expected) {
    if (!isOfOneSize(image)) return forgetImage();
    if (target_) {
      if (findPattern(image)) target_.reset();
      return;
    }
    places_.clear();
    for (std::size_t i = 0; i < dots_.size(); ++i) places_.push_back(placeOf(i, expected));
    // Dots in view first: a hidden one must not take the place of a neighbour that has moved.
    found_.assign(dots_.size(), std::nullopt);
    for (const bool wasSeen : {true, false}) {
      for (std::size_t i = 0; i < dots_.size(); ++i) {
        if (dots_[i].isSeen == wasSeen) found_[i] = find(image, i);
      }
    }
    for (std::size_t i = 0; i < dots_.size(); ++i) {
      Dot& dot = dots_[i];
      dot.isSeen = found_[i].has_value();
      if (!dot.isSeen) continue;
      dot.last = *found_[i];
      dot.wasEverSeen = true;
    }
  }

  bool isOfOneSize(const Image& image) {
    if (image.getSize() == 0 || image.bitmap == nullptr) return false;
    if (width_ == 0) width_ = image.getWidth(), height_ = image.getHeight();
    return image.getWidth() == width_ && image.getHeight() == height_;
  }

  void forgetImage() {
    for (Dot& dot : dots_) dot.isSeen = false;
  }

  bool findPattern(const Image& image) {
    const auto blobs =
        detail::dotsAtAnyLevel(image, detail::boxAround({0, 0}, HUGE_VAL, image), limits_);
    const auto dotOf = detail::assignDots(*target_, blobs);
    if (!dotOf) return false;
    found_.clear();
    for (const std::size_t k : *dotOf) found_.emplace_back(blobs[k]);
    for (const auto& dot : found_) {
      if (hasDouble(image, *dot)) return false;
    }
    for (std::size_t i = 0; i < dots_.size(); ++i) {
      dots_[i].last = blobs[(*dotOf)[i]];
      dots_[i].isSeen = dots_[i].wasEverSeen = true;
    }
    return true;
  }

  /// Whether a blob of about the dot's size stands so close to it that either may be the plate's.
  bool hasDouble(const Image& image, const DotMeasurement& dot) const {
    const Eigen::Vector2d axes = dot.ellipse.semiAxes();
    detail::DotLimits limits = limits_;
    limits.least_radius_px = axes.y() / kDoubleSize;
    limits.most_radius_px = axes.x() * kDoubleSize;
    return detail::isAnotherWithin(image, dot.ellipse.centre, kJumpDiameters * 2 * axes.x(), dot,
                                   found_, limits);
  }

  /// As expected; without an expectation, where the dot was last seen, or where it shall start.
  Place placeOf(std::size_t i, const std::vector<ExpectedPoint>& expected) const {
    const Dot& dot = dots_[i];
    if (!dot.wasEverSeen) return {dot.start, options_.start_radius_px};
    const double jump = kJumpDiameters * dot.diameter();
    for (const ExpectedPoint& e : expected) {
      const bool isUsable =
          std::isfinite(e.u) && std::isfinite(e.v) && e.sigma_px >= 0 && std::isfinite(e.sigma_px);
      if (e.id == static_cast<int>(i) && isUsable) {
        return {{e.u, e.v}, std::max(jump, kGateSigmas * e.sigma_px)};
      }
    }
    return {dot.last.ellipse.centre, jump};
  }

  std::optional<DotMeasurement> find(const Image& image, std::size_t i) {
    Dot& dot = dots_[i];
    if (!dot.wasEverSeen) return findFirst(image, i);
    const Place& place = places_[i];
    const Place before{dot.last.ellipse.centre, kJumpDiameters * dot.diameter()};
    if (dot.isSeen) {
      for (const Place& p : {place, before}) {
        if (auto followed = follow(image, i, p)) return followed;
      }
    }
    if (auto again = findAgain(image, i, place)) return again;
    // An expectation may be wrong about a dot that was there a moment ago.
    return dot.isSeen && place.position != before.position ? findAgain(image, i, before)
                                                           : std::nullopt;
  }

  /// Where the dot's pixels have gone, for small steps; by vpDot2 for larger ones, from a pixel
  /// that is on the dot.
  std::optional<DotMeasurement> follow(const Image& image, std::size_t i, const Place& place) {
    const Dot& dot = dots_[i];
    const auto measured = [&](const std::optional<Box>& core) {
      auto m = core ? detail::measureDot(image, *core) : std::nullopt;
      const bool isIt = m && isAcceptable(*m, i, place) && !isAnotherNearer(image, *m, i, place);
      return isIt ? m : std::nullopt;
    };
    if (auto m = measured(detail::coreNear(image, dot.last, place.position))) return m;
    return measured(coreByVpDot2(image, dot, place.position));
  }

  std::optional<Box> coreByVpDot2(const Image& image, const Dot& dot, const Eigen::Vector2d& from) {
    if (!contains(image, from)) return std::nullopt;
    const auto v = static_cast<unsigned>(from.y() + 0.5), u = static_cast<unsigned>(from.x() + 0.5);
    const double level = image[std::min(v, height_ - 1)][std::min(u, width_ - 1)];
    if ((level - dot.threshold()) * dot.last.contrast <= 0) return std::nullopt;
    const Eigen::Vector2d size = 2 * dot.last.ellipse.shape.diagonal().cwiseSqrt();
    const auto threshold = static_cast<unsigned>(std::clamp(dot.threshold(), 0.0, 255.0));
    finder_.setGrayLevelMin(dot.last.contrast < 0 ? 0 : threshold);
    finder_.setGrayLevelMax(dot.last.contrast < 0 ? threshold : 255);
    finder_.setWidth(size.x());
    finder_.setHeight(size.y());
    finder_.setArea(dot.last.ellipse.area());
    finder_.setCog(vpImagePoint(v, u));
    try {
      finder_.track(image);
    } catch (const vpException&) {
      return std::nullopt;
    }
    return boxOf(finder_);
  }

  /// By connected pixels in a region, nearest first: of the gray level between the dot and its
  /// background as they were, then, the light may have changed, of any.
  std::optional<DotMeasurement> findAgain(const Image& image, std::size_t i, const Place& place) {
    Dot& dot = dots_[i];
    const double reach = place.gate_px + dot.diameter();
    const Box region = detail::boxAround(place.position, reach, image);
    const auto side = dot.last.contrast < 0 ? detail::Side::darker : detail::Side::lighter;
    auto blobs = detail::dotsAtLevel(image, region, dot.threshold(), side, limits_);
    if (auto again = nearest(image, blobs, i, place)) return again;
    detail::DotLimits limits = limits_;
    limits.dark = side == detail::Side::darker;
    limits.light = !limits.dark;
    blobs = detail::dotsAtAnyLevel(image, region, limits);
    return nearest(image, blobs, i, place);
  }

  std::optional<DotMeasurement> findFirst(const Image& image, std::size_t i) {
    const Place& place = places_[i];
    // Small regions first: what is light or dark is then a matter of the dot's surroundings.
    for (const double reach : {32.0, 96.0, 2 * options_.most_radius_px}) {
      auto blobs =
          detail::dotsAtAnyLevel(image, detail::boxAround(place.position, reach, image), limits_);
      if (auto dot = nearest(image, blobs, i, place)) return dot;
    }
    return std::nullopt;
  }

  /// The acceptable dot that is nearest to the place, unless a blob that is not measurable, which
  /// may be the dot, is nearer.
  std::optional<DotMeasurement> nearest(const Image& image, std::vector<DotMeasurement>& blobs,
                                        std::size_t i, const Place& place) const {
    const auto distance = [&](const DotMeasurement& m) {
      return (m.ellipse.centre - place.position).norm();
    };
    std::sort(blobs.begin(), blobs.end(),
              [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    for (const DotMeasurement& blob : blobs) {
      if (!isAcceptable(blob, i, place)) continue;
      if (isAnotherNearer(image, blob, i, place)) return std::nullopt;
      return blob;
    }
    return std::nullopt;
  }

  bool isAcceptable(const DotMeasurement& m, std::size_t i, const Place& place) const {
    const Dot& dot = dots_[i];
    const double distance = (m.ellipse.centre - place.position).norm();
    const double size = dot.wasEverSeen ? 0 : m.ellipse.semiAxes().x();
    if (!(distance <= place.gate_px + size) || !isAllowed(m)) return false;
    // A dot in view that has hardly moved is itself, even close to where another one got lost.
    const bool isStill = dot.isSeen && distance < m.ellipse.semiAxes().y();
    for (std::size_t j = 0; j < dots_.size(); ++j) {
      if (j == i) continue;
      const double others = (m.ellipse.centre - places_[j].position).norm();
      if (others < distance && (dots_[j].isSeen || !isStill)) return false;
      if (found_[j] && detail::isSame(*found_[j], m)) return false;
    }
    return !dot.wasEverSeen || continues(m, dot);
  }

  /// Whether a blob that may be the dot, though it cannot be measured, is nearer to its place: of
  /// what has been seen, one as large as a few dots that touch.
  bool isAnotherNearer(const Image& image, const DotMeasurement& m, std::size_t i,
                       const Place& place) const {
    detail::DotLimits limits = limits_;
    if (dots_[i].wasEverSeen) {
      limits.most_radius_px =
          std::min(limits.most_radius_px, kDotsThatTouch * m.ellipse.semiAxes().x());
    }
    return detail::isAnotherWithin(
        image, place.position, detail::distanceTo(m.ellipse, place.position), m, found_, limits);
  }

  bool isAllowed(const DotMeasurement& m) const {
    const Eigen::Vector2d axes = m.ellipse.semiAxes();
    return (m.contrast < 0 ? limits_.dark : limits_.light) && axes.y() >= limits_.least_radius_px &&
           axes.x() <= limits_.most_radius_px;
  }

  static bool continues(const DotMeasurement& m, const Dot& dot) {
    const double contrast = m.contrast / dot.last.contrast;
    const double lightChange =
        std::min(kContrastChangeMost, kContrastChange + kContrastChangeHidden * dot.hiddenFor);
    if (!(contrast > 1 / lightChange && contrast < lightChange)) return false;
    const double change =
        std::min(kScaleChangeMost, kScaleChange + kScaleChangeHidden * dot.hiddenFor);
    const Eigen::Array2d ratio = m.ellipse.semiAxes().array() / dot.last.ellipse.semiAxes().array();
    return ratio.maxCoeff() < change && ratio.minCoeff() > 1 / change;
  }

  DotTrackerOptions options_;
  detail::DotLimits limits_;
  std::optional<DotTarget> target_;  // until it has been found
  std::vector<Dot> dots_;
  vpDot2 finder_;
  std::vector<Place> places_;                         // by dot, in the image at hand
  std::vector<std::optional<DotMeasurement>> found_;  // likewise
  std::vector<TrackedPoint> points_;
  unsigned width_ = 0, height_ = 0;
};

DotTracker::DotTracker(const std::vector<Eigen::Vector2d>& starts, const DotTrackerOptions& options)
    : impl_(std::make_unique<Impl>(starts.size(), options)) {
  detail::require("DotTracker", !starts.empty(), "no start position");
  for (const auto& start : starts)
    detail::require("DotTracker", start.allFinite(), "a start position is not finite");
  impl_->setStarts(starts);
}

DotTracker::DotTracker(const DotTarget& target, const DotTrackerOptions& options)
    : impl_(std::make_unique<Impl>(target.points.size(), options)) {
  detail::require("DotTracker", target.points.size() >= 4,
                  "to find a plate it needs at least four dots");
  detail::require("DotTracker", detail::hasFourInGeneralPosition(target),
                  "no four dots without three on a line");
  for (const auto& p : target.points) {
    detail::require("DotTracker", p.allFinite() && p.z() == 0,
                    "the dots must lie in the plane z = 0");
  }
  detail::require("DotTracker", target.radius >= 0 && std::isfinite(target.radius),
                  "the radius is >= 0 m");
  for (auto p = target.points.begin(); p != target.points.end(); ++p) {
    detail::require("DotTracker",
                    std::all_of(p + 1, target.points.end(),
                                [&](const auto& q) { return (*p - q).norm() > 2 * target.radius; }),
                    "dots of the plate overlap: make the radius less than half of their distance");
  }
  impl_->setTarget(target);
}

DotTracker::DotTracker(DotTracker&&) noexcept = default;
DotTracker& DotTracker::operator=(DotTracker&&) noexcept = default;
DotTracker::~DotTracker() = default;

const std::vector<TrackedPoint>& DotTracker::track(const Image& image,
                                                   const std::vector<ExpectedPoint>& expected) {
  return impl_->track(image, expected);
}

std::optional<Ellipse> DotTracker::ellipse(int id) const { return impl_->ellipse(id); }

}  // namespace depthservo
