#include "depthservo/tracking/KltTracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>

#include "depthservo/visp/using.h"
#include "motion/median.h"
#include "text/require.h"
#include "tracking/PatchAligner.h"

namespace depthservo {
namespace {

using detail::ReferencePatch;

constexpr double kReach_px = 1.5;          // from where Lucas-Kanade ends to the aligned patch
constexpr double kSureExpectation_px = 3;  // a vaguer one is no better than the last velocity
constexpr double kNewLook = 0.05;        // loss of similarity, since a look was kept, for a new one
constexpr double kNewLookWarp_px = 0.7;  // zoom and roll that are too much for the old one
constexpr double kStepSimilarity = 0.5;  // from image to image, of what has lost its look
constexpr double kRefound = 0.9;         // similarity it takes to be seen again
constexpr double kCornerShift_px = 3;    // from the pixel with the best gradients to the corner
constexpr double kWarpError = 0.06;      // of zoom and roll, left in the position
constexpr double kFloor_px = 0.015;
constexpr double kChooseBelow = 0.8;  // of the points
constexpr int kStrips = 4;            // of the image, of which one an image is searched for corners
constexpr double kSurplus = 1.5;      // of its share of the points that a strip may have
constexpr double kSamePlace = 0.5;    // of the least distance: two points that are one
constexpr double kGradient2PerNoise2 = 3;  // least gradient of a corner; noise alone has 1/2
constexpr int kSaturated = 254, kBlack = 1;
constexpr double kMostSaturated = 0.75;  // of the pixels of a patch
constexpr int kNoiseStep = 4;            // rows and columns between the pixels that tell the noise
constexpr int kLevelsNear = 1;           // of the pyramid: 20 px about the place
constexpr double kGainStep = 0.02;       // smaller changes of the light are left to the alignment

/// Of the way back, which only has to tell 0.7 px from none.
const cv::TermCriteria kBackwardCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.05);

Eigen::Vector2d toEigen(const cv::Point2f& p) { return {p.x, p.y}; }
cv::Point2f toCv(const Eigen::Vector2d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

struct Track {
  int id;
  Eigen::Vector2d point, velocity;  // in the last image that showed it [px], [px per image]
  ReferencePatch look;
  double variance_px2 = 0;  // of the looks before this one
  double similarity = 0;    // to this look when it was new; 0: it still is
  int unseen = 0;           // images in a row
  double sigma_px = 0;
  bool isGivenUp = false;
};

}  // namespace

class KltTracker::Impl {
 public:
  explicit Impl(const KltTrackerOptions& options)
      : options_(options),
        window_(options.window_px, options.window_px),
        criteria_(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.02) {
    detail::require("KltTracker", options.points >= 1 && options.points <= 2000,
                    "points is 1..2000");
    detail::require("KltTracker",
                    options.least_distance_px >= 3 && options.least_distance_px <= 1000,
                    "least_distance_px is 3..1000");
    detail::require("KltTracker", options.quality > 0 && options.quality < 1, "quality is 0..1");
    detail::require("KltTracker",
                    options.window_px >= 5 && options.window_px <= 61 && options.window_px % 2 == 1,
                    "window_px is odd, 5..61");
    detail::require("KltTracker", options.levels >= 0 && options.levels <= 6, "levels is 0..6");
    detail::require("KltTracker", options.forward_backward_px > 0, "forward_backward_px is > 0");
    detail::require("KltTracker", options.similarity >= 0 && options.similarity <= 1,
                    "similarity is 0..1");
    detail::require("KltTracker", options.patience >= 0, "patience is >= 0");
  }

  const std::vector<TrackedPoint>& track(const vpImage<unsigned char>& image,
                                         const std::vector<ExpectedPoint>& expected) {
    points_.clear();
    retired_.clear();
    try {
      follow(image, expected);
    } catch (const cv::Exception&) {  // for this image only
      previous_.clear();
      for (Track& track : tracks_) ++track.unseen;
    }
    retire();
    for (const Track& track : tracks_) {
      if (track.unseen > 0) continue;
      points_.push_back({track.id, track.point.x(), track.point.y(), track.sigma_px});
    }
    return points_;
  }

  const std::vector<int>& retired() const { return retired_; }

  void giveUp(int id) {
    for (Track& track : tracks_) {
      if (track.id == id) track.isGivenUp = true;
    }
  }

 private:
  void follow(const vpImage<unsigned char>& visp, const std::vector<ExpectedPoint>& expected) {
    const cv::Mat raw(static_cast<int>(visp.getHeight()), static_cast<int>(visp.getWidth()), CV_8U,
                      visp.bitmap);
    const bool isOfOneSize = size_ == cv::Size() || size_ == raw.size();
    if (raw.empty() || !isOfOneSize) {
      for (Track& track : tracks_) ++track.unseen;
      previous_.clear();
      return;
    }
    size_ = raw.size();
    const std::vector<Eigen::Vector2d> places = placesOf(expected);
    const cv::Mat image = previous_.empty() ? raw : inTheLightOfBefore(raw, places);
    noise_ = noiseOf(image);
    cv::buildOpticalFlowPyramid(image, pyramid_, window_, options_.levels);
    if (!previous_.empty()) search(places);
    for (std::size_t i = 0; i < tracks_.size(); ++i) locate(image, i, places[i]);
    std::swap(previous_, pyramid_);
    lastImage_ = image.data == raw.data ? raw.clone() : image;

    if (static_cast<double>(seen()) < kChooseBelow * options_.points) choose(image);
  }

  std::size_t seen() const {
    return static_cast<std::size_t>(std::count_if(tracks_.begin(), tracks_.end(),
                                                  [](const Track& t) { return t.unseen == 0; }));
  }

  /// Where the points should be in this image.
  std::vector<Eigen::Vector2d> placesOf(const std::vector<ExpectedPoint>& expected) const {
    std::vector<Eigen::Vector2d> places;
    auto next = expected.begin();
    for (const Track& track : tracks_) {
      places.push_back(track.point + (track.unseen + 1) * track.velocity);
      next = std::find_if(next, expected.end(),
                          [&](const ExpectedPoint& e) { return e.id >= track.id; });
      if (next == expected.end() || next->id != track.id) continue;
      const bool isSure =
          next->sigma_px < kSureExpectation_px && std::isfinite(next->u) && std::isfinite(next->v);
      if (isSure) places.back() = {next->u, next->v};
    }
    return places;
  }

  /// The image with its gain changed so that the points are as light as they were.
  cv::Mat inTheLightOfBefore(const cv::Mat& raw, const std::vector<Eigen::Vector2d>& places) {
    const auto meanAt = [](const cv::Mat& image, const Eigen::Vector2d& p) {
      constexpr int kHalf = 4;
      const cv::Rect box(static_cast<int>(p.x()) - kHalf, static_cast<int>(p.y()) - kHalf,
                         2 * kHalf + 1, 2 * kHalf + 1);
      const bool isInside =
          p.x() >= kHalf && p.y() >= kHalf && box.br().x <= image.cols && box.br().y <= image.rows;
      return isInside ? cv::mean(image(box))[0] : 0.0;
    };
    gains_.clear();
    for (std::size_t i = 0; i < tracks_.size(); i += 1 + tracks_.size() / 64) {
      if (tracks_[i].unseen > 0) continue;
      const double before = meanAt(lastImage_, tracks_[i].point), now = meanAt(raw, places[i]);
      if (before > 1 && now > 1) gains_.push_back(before / now);
    }
    if (gains_.empty()) return raw;
    const double gain = detail::medianOf(gains_);
    if (std::abs(gain - 1) < kGainStep) return raw;
    cv::Mat image;
    raw.convertTo(image, CV_8U, gain);
    return image;
  }

  /// Lucas-Kanade there and back, of the points in view: near the places where they should be, then
  /// what was not found there anywhere.
  void search(const std::vector<Eigen::Vector2d>& places) {
    found_.assign(tracks_.size(), std::nullopt);
    for (const int levels : {std::min(kLevelsNear, options_.levels), options_.levels}) {
      searched_.clear();
      for (std::size_t i = 0; i < tracks_.size(); ++i) {
        if (tracks_[i].unseen == 0 && !found_[i]) searched_.push_back(i);
      }
      if (!searched_.empty()) searchOnce(places, levels);
    }
  }

  void searchOnce(const std::vector<Eigen::Vector2d>& places, int levels) {
    from_.clear(), to_.clear();
    for (const std::size_t i : searched_) {
      from_.push_back(toCv(tracks_[i].point));
      to_.push_back(toCv(places[i]));
    }
    cv::calcOpticalFlowPyrLK(previous_, pyramid_, from_, to_, forward_, errors_, window_, levels,
                             criteria_, cv::OPTFLOW_USE_INITIAL_FLOW);
    back_ = from_;  // the way back starts where it should end
    cv::calcOpticalFlowPyrLK(pyramid_, previous_, to_, back_, backward_, errors_, window_, 0,
                             kBackwardCriteria, cv::OPTFLOW_USE_INITIAL_FLOW);
    for (std::size_t k = 0; k < searched_.size(); ++k) {
      const cv::Point2f gap = back_[k] - from_[k];
      const bool returns = std::hypot(gap.x, gap.y) < options_.forward_backward_px;
      if (forward_[k] && backward_[k] && returns) found_[searched_[k]] = toEigen(to_[k]);
    }
  }

  void locate(const cv::Mat& image, std::size_t i, const Eigen::Vector2d& place) {
    Track& track = tracks_[i];
    const bool wasSeen = track.unseen == 0;
    const bool isFound = i < found_.size() && found_[i].has_value();
    ++track.unseen;
    if (wasSeen && !isFound) return;
    const auto aligned = track.look.align(image, wasSeen ? *found_[i] : place, kReach_px, noise_);
    if (aligned && aligned->similarity >= (wasSeen ? options_.similarity : kRefound)) {
      if (wasSeen || isFree(aligned->point)) take(image, track, *aligned);
    } else if (wasSeen) {
      takeFromLastImage(image, track, *found_[i]);
    }
  }

  /// Whether a point that is found again has a place: no other is there, nor are there enough.
  bool isFree(const Eigen::Vector2d& point) const {
    if (static_cast<int>(seen()) >= options_.points) return false;
    return std::none_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
      return other.unseen == 0 &&
             (other.point - point).norm() < kSamePlace * options_.least_distance_px;
    });
  }

  void take(const cv::Mat& image, Track& track, const ReferencePatch::Alignment& aligned) {
    track.velocity = (aligned.point - track.point) / track.unseen;
    track.point = aligned.point;
    track.unseen = 0;
    const double warp_px = kWarpError * aligned.warp_px;
    const double variance = aligned.sigma_px * aligned.sigma_px + warp_px * warp_px;
    track.sigma_px = std::sqrt(variance + track.variance_px2 + kFloor_px * kFloor_px);
    if (track.similarity == 0) track.similarity = aligned.similarity;
    const bool looksTheSame =
        aligned.similarity > track.similarity - kNewLook && aligned.warp_px < kNewLookWarp_px;
    if (!looksTheSame) renewLook(image, track);
  }

  /// Of a point that has come to look different within one image: by what it looked like then.
  void takeFromLastImage(const cv::Mat& image, Track& track, const Eigen::Vector2d& place) {
    const auto look = ReferencePatch::at(lastImage_, track.point);
    const auto aligned = look ? look->align(image, place, kReach_px, noise_) : std::nullopt;
    if (!aligned || aligned->similarity < kStepSimilarity) return;
    track.variance_px2 = track.sigma_px * track.sigma_px;
    take(image, track, *aligned);
    renewLook(image, track);
  }

  void renewLook(const cv::Mat& image, Track& track) {
    const auto look = ReferencePatch::at(image, track.point);
    if (!look) return;
    track.look = *look;
    track.variance_px2 = track.sigma_px * track.sigma_px;
    track.similarity = 0;
  }

  void retire() {
    const auto isGone = [&](const Track& track) {
      return track.isGivenUp || track.unseen > options_.patience;
    };
    for (const Track& track : tracks_) {
      if (isGone(track)) retired_.push_back(track.id);
    }
    tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), isGone), tracks_.end());
  }

  /// New corners in one strip of the image, the next one at each call: the cost is the same for
  /// every image, and no part of it is left empty. All at once when there is none yet.
  void choose(const cv::Mat& image) {
    const int strips = seen() == 0 ? kStrips : 1;
    for (int k = 0; k < strips; ++k) {
      chooseIn(image, image.rows * strip_ / kStrips, image.rows * (strip_ + 1) / kStrips);
      strip_ = (strip_ + 1) % kStrips;
    }
  }

  void chooseIn(const cv::Mat& image, int top, int bottom) {
    const int margin = static_cast<int>(std::ceil(ReferencePatch::kMargin_px));
    const cv::Rect inner(margin, margin, image.cols - 2 * margin, image.rows - 2 * margin);
    const cv::Rect strip = cv::Rect(0, top, image.cols, bottom - top) & inner;
    const int inStrip =
        static_cast<int>(std::count_if(tracks_.begin(), tracks_.end(), [&](const Track& track) {
          return track.unseen == 0 && track.point.y() >= top && track.point.y() < bottom;
        }));
    const int share = static_cast<int>(std::ceil(kSurplus * options_.points / kStrips));
    const int wanted = std::min(options_.points - static_cast<int>(seen()), share - inStrip);
    if (strip.width < 3 || strip.height < 3 || wanted <= 0) return;
    cv::Mat mask(strip.size(), CV_8U, cv::Scalar(255));
    for (const Track& track : tracks_) {
      if (track.unseen > 0) continue;
      cv::circle(mask, toCv(track.point - Eigen::Vector2d(strip.x, strip.y)),
                 static_cast<int>(options_.least_distance_px), 0, -1);
    }
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(image(strip), corners, wanted, options_.quality,
                            options_.least_distance_px, mask);
    for (const cv::Point2f& corner : corners) {
      add(image, Eigen::Vector2d(corner.x + static_cast<float>(strip.x),
                                 corner.y + static_cast<float>(strip.y)));
    }
  }

  void add(const cv::Mat& image, Eigen::Vector2d point) {
    auto look = ReferencePatch::at(image, point);
    if (!look) return;
    const Eigen::Vector2d shift = look->corner();
    if (shift.norm() < kCornerShift_px) {
      point += shift;
      look = ReferencePatch::at(image, point);
    }
    const bool isCorner = look && look->leastGradient2() > kGradient2PerNoise2 * noise_ * noise_ &&
                          !isSaturated(image, point);
    if (!isCorner) return;
    tracks_.push_back({nextId_++, point, Eigen::Vector2d::Zero(), *look});
    tracks_.back().sigma_px = kFloor_px;
  }

  static bool isSaturated(const cv::Mat& image, const Eigen::Vector2d& point) {
    const int side = ReferencePatch::kSide;
    const cv::Rect box(static_cast<int>(std::lround(point.x())) - side / 2,
                       static_cast<int>(std::lround(point.y())) - side / 2, side, side);
    return cv::countNonZero(image(box) >= kSaturated) > kMostSaturated * side * side;
  }

  /// Standard deviation of a pixel's noise [gray levels] (Immerkaer, CVIU 64(2), 1996: the
  /// difference of two Laplacians sees no edges; by its median, where nothing is clipped).
  double noiseOf(const cv::Mat& image) {
    constexpr double kMedianToSigma = 1.4826 / 6;
    constexpr int kMost = 16 * 255;
    counts_.assign(kMost + 1, 0);
    int n = 0;
    for (int v = 1; v + 1 < image.rows; v += kNoiseStep) {
      const auto *a = image.ptr<unsigned char>(v - 1), *b = image.ptr<unsigned char>(v),
                 *c = image.ptr<unsigned char>(v + 1);
      for (int u = 1; u + 1 < image.cols; u += kNoiseStep) {
        const int most = std::max(
            {a[u - 1], a[u], a[u + 1], b[u - 1], b[u], b[u + 1], c[u - 1], c[u], c[u + 1]});
        const int least = std::min(
            {a[u - 1], a[u], a[u + 1], b[u - 1], b[u], b[u + 1], c[u - 1], c[u], c[u + 1]});
        if (most >= kSaturated || least <= kBlack) continue;
        const int value = a[u - 1] + a[u + 1] + c[u - 1] + c[u + 1] + 4 * b[u] -
                          2 * (a[u] + b[u - 1] + b[u + 1] + c[u]);
        ++counts_[static_cast<std::size_t>(std::abs(value))];
        ++n;
      }
    }
    int median = 0;
    for (int half = n / 2;
         median < kMost && (half -= counts_[static_cast<std::size_t>(median)]) >= 0;)
      ++median;
    return kMedianToSigma * median;
  }

  KltTrackerOptions options_;
  cv::Size window_;
  cv::TermCriteria criteria_;
  cv::Size size_;              // of the first image
  std::vector<Track> tracks_;  // by ascending id
  int nextId_ = 0, strip_ = 0;
  std::vector<cv::Mat> previous_, pyramid_;
  cv::Mat lastImage_;
  std::vector<TrackedPoint> points_;
  std::vector<int> retired_;

  // Of the image at hand.
  std::vector<std::size_t> searched_;
  std::vector<std::optional<Eigen::Vector2d>> found_;
  std::vector<cv::Point2f> from_, to_, back_;
  std::vector<unsigned char> forward_, backward_;
  std::vector<float> errors_;
  std::vector<double> gains_;
  std::vector<int> counts_;
  double noise_ = 0;  // of a pixel [gray levels]
};

KltTracker::KltTracker(const KltTrackerOptions& options) : impl_(std::make_unique<Impl>(options)) {}
KltTracker::KltTracker(KltTracker&&) noexcept = default;
KltTracker& KltTracker::operator=(KltTracker&&) noexcept = default;
KltTracker::~KltTracker() = default;

const std::vector<TrackedPoint>& KltTracker::track(const vpImage<unsigned char>& image,
                                                   const std::vector<ExpectedPoint>& expected) {
  return impl_->track(image, expected);
}

const std::vector<int>& KltTracker::retired() const { return impl_->retired(); }
void KltTracker::giveUp(int id) { impl_->giveUp(id); }

}  // namespace depthservo
