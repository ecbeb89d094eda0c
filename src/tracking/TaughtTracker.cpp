#include "depthservo/tracking/TaughtTracker.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

#include "depthservo/visp/using.h"
#include "text/require.h"
#include "tracking/PatchAligner.h"
#include "tracking/TaughtMatcher.h"

namespace depthservo {
namespace {

using detail::ReferencePatch;
using detail::TaughtPlace;
using Image = vpImage<unsigned char>;

constexpr double kReach_px = 4;        // from where a point should be to where it is
constexpr double kSearchReach_px = 8;  // the same after a search
constexpr double kFloor_px = 0.05;     // of sigma_px: the warp is that of the neighbours
constexpr double kPlace_px = 3;        // sigma of a place that only the search tells
constexpr double kLost = 0.3;          // of the points in view, less: it searches anew
constexpr double kFar_px = 10;         // from a sure expectation: the neighbours move otherwise
constexpr double kSureExpectation_px = 10;
constexpr double kLeastZoom = 0.08, kMostZoom = 8;
constexpr std::size_t kNeighbours = 8;
constexpr int kLevels = 4;  // of the taught image's pyramid
constexpr int kFlowLevels = 3;
const cv::Size kWindow(21, 21);

cv::Mat matOf(const Image& image) {
  return {static_cast<int>(image.getHeight()), static_cast<int>(image.getWidth()), CV_8U,
          image.bitmap};
}

/// White noise of an image by its Laplacian's median, as a robust 1 sigma [gray levels].
double grayNoise(const cv::Mat& image) {
  cv::Mat small, laplacian;
  cv::Laplacian(image, laplacian, CV_16S, 1);
  std::vector<short> values;
  for (int v = 2; v < laplacian.rows - 2; v += 4) {
    for (int u = 2; u < laplacian.cols - 2; u += 4) {
      values.push_back(static_cast<short>(std::abs(laplacian.at<short>(v, u))));
    }
  }
  if (values.empty()) return 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  constexpr double kMedian = 0.6745, kGain = 4.4721;  // sqrt(20) of the 4-neighbour mask
  return std::max(0.5, values[values.size() / 2] / (kMedian * kGain));
}

}  // namespace

class TaughtTracker::Impl {
 public:
  Impl(const TaughtImage& taught, const TaughtTrackerOptions& options)
      : options_(options),
        taught_(matOf(taught.image).clone()),
        points_(taught.points),
        matcher_(taught_, options.features, options.ratio),
        states_(taught.points.size()) {
    pyramid_.push_back(taught_);
    for (int i = 1; i < kLevels; ++i) {
      cv::Mat half;
      cv::pyrDown(pyramid_.back(), half);
      pyramid_.push_back(half);
    }
  }

  const std::vector<TrackedPoint>& track(const Image& visp, const std::vector<ExpectedPoint>& e) {
    found_.clear();
    try {
      const cv::Mat image = matOf(visp);
      if (image.size() == taught_.size()) follow(image, e);
    } catch (const cv::Exception&) {  // for this image only
      found_.clear();
      before_.release();
    }
    return found_;
  }

  std::string news() { return std::exchange(news_, ""); }

 private:
  struct State {
    TaughtPlace place;
    bool isSeen = false;
    bool hasPlace = false;  // by its neighbours, and not contradicting what is expected
    double sigma_px = 0;
  };

  void follow(const cv::Mat& image, const std::vector<ExpectedPoint>& expected) {
    noise_ = grayNoise(image);
    const bool isLost = static_cast<double>(seen()) < kLost * static_cast<double>(states_.size());
    if (isLost && !search(image)) {
      for (State& state : states_) state.isSeen = false;
    }
    if (!isLost) flow(image, expected);
    image.copyTo(before_);
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const State& state = states_[i];
      const double sigma_px = state.isSeen ? state.sigma_px : kPlace_px;
      if (!state.isSeen && !(state.hasPlace && 2 * seen() >= states_.size())) continue;
      found_.push_back(
          {static_cast<int>(i), state.place.point.x(), state.place.point.y(), sigma_px});
    }
  }

  std::size_t seen() const {
    return static_cast<std::size_t>(
        std::count_if(states_.begin(), states_.end(), [](const State& s) { return s.isSeen; }));
  }

  /// False: the taught image is not found.
  bool search(const cv::Mat& image) {
    const auto result = matcher_.find(image, points_, options_.least_matches);
    for (State& state : states_) state.isSeen = false, state.sigma_px = 0;
    if (result.hypotheses.empty()) {
      tell(fmt::format("the taught image is not found: {} of {} matches agree, needs {}",
                       result.inliers, result.matches, options_.least_matches));
      return false;
    }
    for (std::size_t i = 0; i < states_.size(); ++i) {
      for (const auto& places : result.hypotheses) {
        if (states_[i].isSeen) break;
        states_[i].place = places[i];
        measure(image, states_[i], points_[i], kSearchReach_px);
      }
      if (!states_[i].isSeen) states_[i].place = result.hypotheses[0][i];
      states_[i].hasPlace = true;
    }
    lookBesideThoseSeen(image);
    const std::size_t count = seen();
    if (static_cast<double>(count) < kLost * static_cast<double>(states_.size())) {
      for (State& state : states_) state.isSeen = false, state.sigma_px = 0;
      tell(fmt::format("the taught image seems to be there, but only {} of {} points look like it",
                       count, states_.size()));
      return false;
    }
    const std::string planes = result.planes == 1   ? "a plane"
                               : result.planes == 0 ? "one motion of the camera"
                                                    : fmt::format("{} planes", result.planes);
    tell(fmt::format(
        "the taught image is found: {} of {} matches agree with {}; {} of {} points seen",
        result.inliers, result.matches, planes, count, states_.size()));
    return true;
  }

  /// The points not seen yet, by the motion of those that are.
  void lookBesideThoseSeen(const cv::Mat& image) {
    std::vector<Eigen::Vector2d> taught, now;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      if (!states_[i].isSeen) continue;
      taught.push_back(points_[i]);
      now.push_back(states_[i].place.point);
    }
    for (std::size_t i = 0; i < states_.size(); ++i) {
      if (states_[i].isSeen) continue;
      const auto place = detail::affineAt(points_[i], taught, now, kNeighbours);
      if (!place) continue;
      states_[i].place = *place;
      measure(image, states_[i], points_[i], kSearchReach_px);
    }
  }

  /// The same words once in a row.
  void tell(std::string words) {
    if (words.substr(0, kSameWords) == told_.substr(0, kSameWords)) return;
    news_ = told_ = std::move(words);
  }
  static constexpr std::size_t kSameWords = 28;

  /// From the image before to this one.
  void flow(const cv::Mat& image, const std::vector<ExpectedPoint>& expected) {
    std::vector<cv::Point2f> from, to;
    std::vector<std::size_t> index;
    std::vector<std::optional<Eigen::Vector2d>> awaited(states_.size());
    for (const ExpectedPoint& e : expected) {
      if (e.id < 0 || static_cast<std::size_t>(e.id) >= states_.size()) continue;
      if (e.sigma_px < kSureExpectation_px) awaited[static_cast<std::size_t>(e.id)] = {e.u, e.v};
    }
    for (std::size_t i = 0; i < states_.size(); ++i) {
      if (!states_[i].isSeen) continue;
      const Eigen::Vector2d& p = states_[i].place.point;
      const Eigen::Vector2d q = awaited[i].value_or(p);
      from.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
      to.emplace_back(static_cast<float>(q.x()), static_cast<float>(q.y()));
      index.push_back(i);
    }
    std::vector<unsigned char> status;
    if (!from.empty()) {
      std::vector<float> error;
      cv::calcOpticalFlowPyrLK(before_, image, from, to, status, error, kWindow, kFlowLevels, {},
                               cv::OPTFLOW_USE_INITIAL_FLOW);
    }
    std::vector<Eigen::Vector2d> taught, now;
    for (std::size_t k = 0; k < index.size(); ++k) {
      if (!status[k]) continue;
      taught.push_back(points_[index[k]]);
      now.emplace_back(to[k].x, to[k].y);
      states_[index[k]].place.point = now.back();
    }
    for (std::size_t i = 0; i < states_.size(); ++i) {
      State& state = states_[i];
      const auto place = detail::affineAt(points_[i], taught, now, kNeighbours);
      if (place) state.place.warp = place->warp;
      state.hasPlace = place && !(awaited[i] && (place->point - *awaited[i]).norm() > kFar_px);
      if (!state.isSeen && (state.hasPlace || awaited[i])) {
        state.place.point = state.hasPlace ? place->point : *awaited[i];
      }
      measure(image, state, points_[i], kReach_px);
    }
  }

  /// Aligns the taught image, warped, near where the point should be.
  void measure(const cv::Mat& image, State& state, const Eigen::Vector2d& point, double reach_px) {
    state.isSeen = false;
    state.sigma_px = 0;
    const double zoom = std::sqrt(std::abs(state.place.warp.determinant()));
    if (!(zoom > kLeastZoom && zoom < kMostZoom) || !state.place.point.allFinite()) return;
    const cv::Mat expected = warped(state.place.warp, point, zoom);
    const auto look = ReferencePatch::at(expected, kMiddle);
    if (!look) return;
    const auto found = look->align(image, state.place.point, reach_px, noise_);
    if (!found || found->similarity < options_.similarity) return;
    if (likeness(expected, image, found->point) < options_.similarity) return;
    state.place.point = found->point;
    state.sigma_px = std::hypot(kFloor_px, found->sigma_px);
    state.isSeen = true;
  }

  /// Correlation of wide surroundings: corners alone are like many others.
  static double likeness(const cv::Mat& expected, const cv::Mat& image, const Eigen::Vector2d& at) {
    cv::Mat seen, result;
    cv::getRectSubPix(image, expected.size(),
                      {static_cast<float>(at.x()), static_cast<float>(at.y())}, seen);
    cv::matchTemplate(seen, expected, result, cv::TM_CCOEFF_NORMED);
    return static_cast<double>(result.at<float>(0, 0));
  }

  /// The surroundings of a taught point as they look now.
  cv::Mat warped(const Eigen::Matrix2d& warp, const Eigen::Vector2d& point, double zoom) const {
    const int level = std::clamp(static_cast<int>(std::lround(-std::log2(zoom))), 0, kLevels - 1);
    const double scale = std::ldexp(1.0, -level);  // pyrDown keeps pixel (0, 0) where it is
    const Eigen::Matrix2d back = scale * warp.inverse();
    const Eigen::Vector2d offset = scale * point - back * kMiddle;
    const cv::Matx23d M(back(0, 0), back(0, 1), offset.x(), back(1, 0), back(1, 1), offset.y());
    cv::Mat patch;
    cv::warpAffine(pyramid_[static_cast<std::size_t>(level)], patch, M, {kSide, kSide},
                   cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    return patch;
  }

  static constexpr int kSide = 39;  // [px]: twice and a half what is aligned
  const Eigen::Vector2d kMiddle = Eigen::Vector2d::Constant((kSide - 1) / 2.0);

  TaughtTrackerOptions options_;
  cv::Mat taught_, before_;
  std::vector<cv::Mat> pyramid_;
  std::vector<Eigen::Vector2d> points_;
  detail::TaughtMatcher matcher_;
  std::vector<State> states_;
  double noise_ = 1;
  std::string news_, told_;
  std::vector<TrackedPoint> found_;
};

TaughtTracker::TaughtTracker(const TaughtImage& taught, const TaughtTrackerOptions& options) {
  detail::require("TaughtTracker", taught.points.size() >= 4, "needs at least four points");
  for (const Eigen::Vector2d& p : taught.points) {
    detail::require("TaughtTracker",
                    p.x() >= 0 && p.y() >= 0 && p.x() <= taught.image.getWidth() - 1.0 &&
                        p.y() <= taught.image.getHeight() - 1.0,
                    "a point is outside of the image");
  }
  detail::require("TaughtTracker", options.features >= 100 && options.features <= 5000,
                  "features is 100..5000");
  detail::require("TaughtTracker", options.ratio > 0 && options.ratio <= 1, "ratio is 0..1");
  detail::require("TaughtTracker", options.least_matches >= 8, "least_matches is at least 8");
  detail::require("TaughtTracker", options.similarity >= 0 && options.similarity < 1,
                  "similarity is 0..1");
  impl_ = std::make_unique<Impl>(taught, options);
}

TaughtTracker::TaughtTracker(TaughtTracker&&) noexcept = default;
TaughtTracker& TaughtTracker::operator=(TaughtTracker&&) noexcept = default;
TaughtTracker::~TaughtTracker() = default;

const std::vector<TrackedPoint>& TaughtTracker::track(const Image& image,
                                                      const std::vector<ExpectedPoint>& expected) {
  return impl_->track(image, expected);
}

std::string TaughtTracker::news() { return impl_->news(); }

}  // namespace depthservo
