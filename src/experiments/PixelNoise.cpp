#include "depthservo/experiments/PixelNoise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "observation/makeTracker.h"

namespace depthservo {
namespace {

constexpr double kMostCorrelation = 0.3;

using Sample = PixelNoiseMeter::Sample;

/// The straight line of least squares through the samples of a block.
struct SlowMotion {
  double meanTime = 0, timeSquares = 0;
  Eigen::Array2d mean{0, 0}, slope{0, 0};

  SlowMotion(const Sample* block, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) {
      meanTime += static_cast<double>(block[i].image) / static_cast<double>(n);
      mean += block[i].pixel.array() / static_cast<double>(n);
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double t = static_cast<double>(block[i].image) - meanTime;
      timeSquares += t * t;
      slope += t * (block[i].pixel.array() - mean);
    }
    slope /= timeSquares;
  }
  Eigen::Array2d residual(const Sample& sample) const {
    const double t = static_cast<double>(sample.image) - meanTime;
    return sample.pixel.array() - mean - t * slope;
  }
};

/// Sums over the blocks of one point.
class PointSums {
 public:
  Eigen::Array2d squares{0, 0}, products{0, 0};
  double freedom = 0;

  void add(const Sample* block, std::size_t n) {
    const SlowMotion line(block, n);
    Eigen::Array2d before(0, 0);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Array2d residual = line.residual(block[i]);
      squares += residual.square();
      if (i > 0) products += residual * before;
      before = residual;
    }
    freedom += static_cast<double>(n - 2);
    widen(line, static_cast<double>(n) / 2);
  }

  Eigen::Array2d variance() const { return squares / freedom; }
  double moved_px() const { return (high_ - low_).matrix().norm(); }

 private:
  /// Half a block either side of its middle; within the noise of the slope that says nothing.
  void widen(const SlowMotion& line, double half) {
    constexpr double kSignificant = 5;
    low_ = low_.min(line.mean);
    high_ = high_.max(line.mean);
    const Eigen::Array2d reach = line.slope.abs() * half;
    const Eigen::Array2d noise = (variance() / line.timeSquares).sqrt() * half;
    for (int axis = 0; axis < 2; ++axis) {
      if (reach[axis] < kSignificant * noise[axis]) continue;
      low_[axis] = std::min(low_[axis], line.mean[axis] - reach[axis]);
      high_[axis] = std::max(high_[axis], line.mean[axis] + reach[axis]);
    }
  }

  Eigen::Array2d low_{INFINITY, INFINITY}, high_{-INFINITY, -INFINITY};
};

PointSums sumsOf(const std::vector<Sample>& samples) {
  PointSums sums;
  for (std::size_t first = 0; first < samples.size(); first += PixelNoiseMeter::kBlock) {
    const std::size_t n = std::min(PixelNoiseMeter::kBlock, samples.size() - first);
    if (n >= PixelNoiseMeter::kLeast) sums.add(&samples[first], n);
  }
  return sums;
}

PointNoise noiseOf(int id, std::size_t images, const PointSums& sums) {
  PointNoise point;
  point.id = id;
  point.images = images;
  point.sigma_u = std::sqrt(sums.variance()[0]);
  point.sigma_v = std::sqrt(sums.variance()[1]);
  point.moved_px = sums.moved_px();
  point.correlation = sums.squares.sum() > 0 ? sums.products.sum() / sums.squares.sum() : 0;
  return point;
}

/// More than the noise explains: six standard deviations of the distance of two means of a block.
bool hasMoved(const PointSums& sums) {
  constexpr double kFileDigits_px = 1e-6;
  const double unmoved =
      6 * std::sqrt(sums.variance().sum() * 2 / static_cast<double>(PixelNoiseMeter::kBlock));
  return sums.moved_px() > std::max(unmoved, kFileDigits_px);
}

}  // namespace

void PixelNoiseMeter::add(const std::vector<TrackedPoint>& points) {
  for (const TrackedPoint& point : points) {
    points_[point.id].push_back({images_, {point.u, point.v}});
  }
  ++images_;
}

PixelNoise PixelNoiseMeter::result() const {
  PixelNoise noise;
  double squares = 0, freedom = 0, correlation = 0;
  for (const auto& [id, samples] : points_) {
    const PointSums sums = sumsOf(samples);
    if (sums.freedom == 0) continue;
    const PointNoise point = noiseOf(id, samples.size(), sums);
    noise.hasMoved = noise.hasMoved || hasMoved(sums);
    noise.moved_px = std::max(noise.moved_px, point.moved_px);
    noise.worst_px = std::max(noise.worst_px, std::sqrt(sums.variance().mean()));
    squares += sums.squares.sum();
    freedom += 2 * sums.freedom;
    correlation += point.correlation;
    noise.points.push_back(point);
  }
  if (noise.points.empty()) return noise;
  noise.sigma_px = std::sqrt(squares / freedom);
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
