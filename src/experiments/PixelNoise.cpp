#include "depthservo/experiments/PixelNoise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "observation/makeTracker.h"

namespace depthservo {
namespace {

constexpr double kMostCorrelation = 0.3;

}  // namespace

void PixelNoiseMeter::add(const std::vector<TrackedPoint>& points) {
  for (const TrackedPoint& point : points) {
    points_[point.id].push_back({images_, {point.u, point.v}});
  }
  ++images_;
}

PixelNoise PixelNoiseMeter::result() const {
  PixelNoise noise;
  double squares = 0, freedom = 0;
  for (const auto& [id, samples] : points_) {
    Eigen::Array2d pointSquares(0, 0), products(0, 0);
    double pointFreedom = 0;
    Eigen::Array2d low(INFINITY, INFINITY), high(-INFINITY, -INFINITY);
    for (std::size_t first = 0; first < samples.size(); first += kBlock) {
      const std::size_t n = std::min(kBlock, samples.size() - first);
      if (n < kLeast) break;
      const Sample* block = &samples[first];
      double meanTime = 0;
      Eigen::Array2d mean(0, 0);
      for (std::size_t i = 0; i < n; ++i) {
        meanTime += static_cast<double>(block[i].image) / static_cast<double>(n);
        mean += block[i].pixel.array() / static_cast<double>(n);
      }
      double timeSquares = 0;
      Eigen::Array2d slope(0, 0);
      for (std::size_t i = 0; i < n; ++i) {
        const double t = static_cast<double>(block[i].image) - meanTime;
        timeSquares += t * t;
        slope += t * (block[i].pixel.array() - mean);
      }
      slope /= timeSquares;
      Eigen::Array2d before(0, 0);
      for (std::size_t i = 0; i < n; ++i) {
        const double t = static_cast<double>(block[i].image) - meanTime;
        const Eigen::Array2d residual = block[i].pixel.array() - mean - t * slope;
        pointSquares += residual.square();
        if (i > 0) products += residual * before;
        before = residual;
      }
      pointFreedom += static_cast<double>(n - 2);
      // Half a block either side of its middle; over the noise of the slope it says nothing.
      low = low.min(mean);
      high = high.max(mean);
      const Eigen::Array2d reach = slope.abs() * static_cast<double>(n) / 2;
      const Eigen::Array2d slopeNoise =
          (pointSquares / pointFreedom / timeSquares).sqrt() * static_cast<double>(n) / 2;
      for (int axis = 0; axis < 2; ++axis) {
        constexpr double kSignificant = 5;
        if (reach[axis] < kSignificant * slopeNoise[axis]) continue;
        low[axis] = std::min(low[axis], mean[axis] - reach[axis]);
        high[axis] = std::max(high[axis], mean[axis] + reach[axis]);
      }
    }
    if (pointFreedom == 0) continue;
    PointNoise point;
    point.id = id;
    point.images = samples.size();
    const Eigen::Array2d variance = pointSquares / pointFreedom;
    point.sigma_u = std::sqrt(variance[0]);
    point.sigma_v = std::sqrt(variance[1]);
    point.moved_px = (high - low).matrix().norm();
    point.correlation = pointSquares.sum() > 0 ? products.sum() / pointSquares.sum() : 0;
    // Six standard deviations of the distance of two means of a block.
    const double unmoved = 6 * std::sqrt(variance.sum() * 2 / static_cast<double>(kBlock));
    constexpr double kFileDigits_px = 1e-6;
    noise.hasMoved = noise.hasMoved || point.moved_px > std::max(unmoved, kFileDigits_px);
    noise.moved_px = std::max(noise.moved_px, point.moved_px);
    noise.worst_px = std::max(noise.worst_px, std::sqrt(variance.mean()));
    squares += pointSquares.sum();
    freedom += 2 * pointFreedom;
    noise.points.push_back(point);
  }
  if (noise.points.empty()) return noise;
  noise.sigma_px = std::sqrt(squares / freedom);
  const double correlation =
      std::accumulate(noise.points.begin(), noise.points.end(), 0.0,
                      [](double sum, const PointNoise& point) { return sum + point.correlation; });
  noise.isWhite = correlation / static_cast<double>(noise.points.size()) < kMostCorrelation;
  return noise;
}

namespace {

PixelNoise resultOf(const PixelNoiseMeter& meter, const std::string& source) {
  PixelNoise noise = meter.result();
  if (noise.points.empty()) {
    throw InputError({source, 0, ""},
                     fmt::format("no point is seen in {} images; record at least a second of a "
                                 "target that stands still",
                                 PixelNoiseMeter::kLeast));
  }
  return noise;
}

}  // namespace

PixelNoise measurePixelNoise(const Sequence& sequence, TrackerKind wanted,
                             const std::function<void(double)>& progress) {
  const ObservedSource source = ObservedSource::of(sequence);
  const std::unique_ptr<PointTracker> tracker =
      makeTracker(source.target, chooseTracker(source, wanted), {});
  PixelNoiseMeter meter;
  const std::size_t count = sequence.frames().size();
  for (std::size_t k = 0; k < count; ++k) {
    if (tracker) {
      meter.add(tracker->track(sequence.readImage(k), {}));
    } else {
      std::vector<TrackedPoint> points;
      for (const PixelPoint& point : sequence.frames()[k].tracks) {
        points.push_back({point.id, point.u, point.v, 0});
      }
      meter.add(points);
    }
    if (progress) progress(static_cast<double>(k + 1) / static_cast<double>(count));
  }
  return resultOf(meter, sequence.folder());
}

PixelNoise measurePixelNoise(ImageSource& images, std::size_t most, const SequenceTarget& seen,
                             TrackerKind wanted, const std::function<void(double)>& progress) {
  const ObservedSource source{"--source", "", {}, seen};
  const std::unique_ptr<PointTracker> tracker =
      makeTracker(seen, chooseTracker(source, wanted), {});
  PixelNoiseMeter meter;
  TimedImage image;
  for (std::size_t k = 0; k < most; ++k) {
    const ImageStatus status = images.next(image);
    if (status == ImageStatus::ended) break;
    if (status == ImageStatus::skipped) continue;
    meter.add(tracker->track(image.image, {}));
    if (progress) progress(static_cast<double>(k + 1) / static_cast<double>(most));
  }
  return resultOf(meter, "--source");
}

}  // namespace depthservo
