#include "depthservo/depth/InverseDepthFilterBatch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "depth/FilterPointSteps.h"

namespace depthservo {
namespace {

using Block = InverseDepthFilterBatch::Block;
using detail::FilterPoint;
using detail::FilterStep;
using Phase = FilterPoint::Phase;

constexpr std::size_t kPoints = Block::kPoints;

template <int kWidth>
struct Lanes {
  typedef double Vector __attribute__((vector_size(kWidth * sizeof(double))));

  // By reference: a vector passed by value would need its instructions everywhere.
  DEPTHSERVO_INLINE static void load(const double* from, Vector& v) {
    std::memcpy(&v, from, sizeof v);
  }
  DEPTHSERVO_INLINE static void store(double* to, const Vector& v) {
    std::memcpy(to, &v, sizeof v);
  }
  /// Whether a comparison (all bits or none in each lane) holds in every lane.
  template <class Mask>
  DEPTHSERVO_INLINE static bool all(const Mask& mask) {
    long long lanes[kWidth], both = -1;
    std::memcpy(lanes, &mask, sizeof mask);
    for (int i = 0; i < kWidth; ++i) both &= lanes[i];
    return both != 0;
  }
};

template <int kWidth>
DEPTHSERVO_INLINE void loadState(const Block& b, std::size_t i,
                                 detail::FilterState<typename Lanes<kWidth>::Vector>& s) {
  using L = Lanes<kWidth>;
  L::load(b.x + i, s.x);
  L::load(b.y + i, s.y);
  L::load(b.chi + i, s.c);
  L::load(b.xx + i, s.xx);
  L::load(b.xy + i, s.xy);
  L::load(b.xc + i, s.xc);
  L::load(b.yy + i, s.yy);
  L::load(b.yc + i, s.yc);
  L::load(b.cc + i, s.cc);
  L::load(b.noise_t + i, s.bias.variance_t);
  L::load(b.noise_xy + i, s.bias.variance_xy);
  L::load(b.bias + i, s.bias.mean);
  L::load(b.levelSum + i, s.bias.levelSum);
  L::load(b.levelWeight + i, s.bias.levelWeight);
}

template <int kWidth>
DEPTHSERVO_INLINE void storeState(Block& b, std::size_t i,
                                  const detail::FilterState<typename Lanes<kWidth>::Vector>& s) {
  using L = Lanes<kWidth>;
  L::store(b.x + i, s.x);
  L::store(b.y + i, s.y);
  L::store(b.chi + i, s.c);
  L::store(b.xx + i, s.xx);
  L::store(b.xy + i, s.xy);
  L::store(b.xc + i, s.xc);
  L::store(b.yy + i, s.yy);
  L::store(b.yc + i, s.yc);
  L::store(b.cc + i, s.cc);
  L::store(b.noise_t + i, s.bias.variance_t);
  L::store(b.noise_xy + i, s.bias.variance_xy);
  L::store(b.bias + i, s.bias.mean);
  L::store(b.levelSum + i, s.bias.levelSum);
  L::store(b.levelWeight + i, s.bias.levelWeight);
}

/// Predicts a plain block; the lanes of the result's bits are left for the scalar step.
template <int kWidth>
DEPTHSERVO_INLINE unsigned predictBlock(Block& b, const FilterStep& step) {
  using L = Lanes<kWidth>;
  using Vector = typename L::Vector;
  unsigned left = 0;
  for (std::size_t i = 0; i < kPoints; i += kWidth) {
    detail::FilterState<Vector> before{};
    loadState<kWidth>(b, i, before);
    detail::Prediction<Vector> next{};
    detail::predictState(step, before, next);
    if (!L::all((next.q3 > 0) & (next.size < detail::kLargestVariance))) {
      left |= ((1u << kWidth) - 1) << i;
      continue;
    }
    storeState<kWidth>(b, i, next.state);
    L::store(b.parallax2 + i, next.F.xc * next.F.xc + next.F.yc * next.F.yc);
  }
  return left;
}

struct Gates {
  double gate, huber, huber2, smallestVariance;
};

/// Corrects a plain block; the lanes of the result's bits are left for the scalar step.
template <int kWidth>
DEPTHSERVO_INLINE unsigned correctBlock(Block& b, const double* x, const double* y,
                                        const double* sigma, const Gates& gates) {
  using L = Lanes<kWidth>;
  using Vector = typename L::Vector;
  unsigned left = 0;
  for (std::size_t i = 0; i < kPoints; i += kWidth) {
    detail::FilterState<Vector> s{};
    loadState<kWidth>(b, i, s);
    Vector measured_x, measured_y, sigmas;
    L::load(x + i, measured_x);
    L::load(y + i, measured_y);
    L::load(sigma + i, sigmas);
    const Vector squared = sigmas * sigmas;
    const Vector r =
        squared > gates.smallestVariance ? squared : squared * 0 + gates.smallestVariance;
    detail::FilterInnovation<Vector> nu{};
    detail::innovate(s, measured_x, measured_y, r, nu);
    const auto isGood = (nu.det > 0) & (nu.nis >= 0) & (nu.nis <= gates.gate) & (sigmas >= 0);
    if (!L::all(isGood)) {
      left |= ((1u << kWidth) - 1) << i;
      continue;
    }
    Vector weighted = r;
    if (!L::all(nu.nis <= gates.huber2)) {
      for (int k = 0; k < kWidth; ++k) {
        if (nu.nis[k] > gates.huber2) weighted[k] *= __builtin_sqrt(nu.nis[k]) / gates.huber;
      }
    }
    detail::FilterGain<Vector> K{};
    detail::correctState(s, nu, weighted, K);
    storeState<kWidth>(b, i, s);
    L::store(b.r + i, r);
  }
  return left;
}

/// The two steps, compiled for one set of instructions.
struct Steps {
  unsigned (*predict)(Block&, const FilterStep&);
  unsigned (*correct)(Block&, const double*, const double*, const double*, const Gates&);
};

unsigned predictPortable(Block& b, const FilterStep& step) { return predictBlock<2>(b, step); }
unsigned correctPortable(Block& b, const double* x, const double* y, const double* sigma,
                         const Gates& gates) {
  return correctBlock<2>(b, x, y, sigma, gates);
}

#ifdef __x86_64__
__attribute__((target("avx2,fma"))) unsigned predictAvx2(Block& b, const FilterStep& step) {
  return predictBlock<4>(b, step);
}
__attribute__((target("avx2,fma"))) unsigned correctAvx2(Block& b, const double* x, const double* y,
                                                         const double* sigma, const Gates& gates) {
  return correctBlock<4>(b, x, y, sigma, gates);
}
#endif

Steps stepsFor(InverseDepthFilterBatch::Instructions instructions) {
  switch (instructions) {
#ifdef __x86_64__
    case InverseDepthFilterBatch::Instructions::avx2:
      return {predictAvx2, correctAvx2};
#endif
    default:
      return {predictPortable, correctPortable};
  }
}

/// A point that is followed, at rest in the image's centre: fills the last block.
void fill(Block& b, std::size_t k) {
  for (double* row :
       {b.x, b.y, b.chi, b.xx, b.xy, b.xc, b.yy, b.yc, b.cc, b.noise_t, b.noise_xy, b.bias,
        b.levelSum, b.parallax2, b.r}) {
    row[k] = 0;
  }
  b.levelWeight[k] = 1;
  b.phase[k] = Phase::measured;
  b.accepted[k] = detail::kYoung;
  b.rejections[k] = 0;
}

}  // namespace

InverseDepthFilterBatch::Instructions InverseDepthFilterBatch::best() {
  return isSupported(Instructions::avx2) ? Instructions::avx2 : Instructions::portable;
}

bool InverseDepthFilterBatch::isSupported(Instructions instructions) {
#ifdef __x86_64__
  if (instructions == Instructions::avx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  }
#endif
  return instructions == Instructions::portable;
}

InverseDepthFilterBatch::InverseDepthFilterBatch(std::size_t size, const Options& options,
                                                 const DepthRange& range, Instructions instructions)
    : size_(size),
      options_(options),
      range_(range),
      instructions_(isSupported(instructions) ? instructions : best()),
      blocks_((size + kPoints - 1) / kPoints) {
  for (std::size_t i = 0; i < kPoints * blocks_.size(); ++i) {
    if (i < size_) {
      store(i, {});
    } else {
      fill(blocks_[i / kPoints], i % kPoints);
    }
  }
}

FilterPoint InverseDepthFilterBatch::load(std::size_t i) const {
  const Block& b = blocks_[i / kPoints];
  const std::size_t k = i % kPoints;
  FilterPoint p;
  detail::setState(p, {b.x[k], b.y[k], b.chi[k], b.xx[k], b.xy[k], b.xc[k], b.yy[k], b.yc[k],
                       b.cc[k],
                       {b.noise_t[k], b.noise_xy[k], b.bias[k], b.levelSum[k], b.levelWeight[k]}});
  p.parallax2 = b.parallax2[k];
  p.r = b.r[k];
  for (std::size_t j = 0; j < 3; ++j) {
    p.scale[j] = b.scale[j][k];
    p.focal[j] = b.focal[j][k];
  }
  p.rejections = b.rejections[k];
  p.accepted = b.accepted[k];
  p.phase = b.phase[k];
  return p;
}

void InverseDepthFilterBatch::store(std::size_t i, const FilterPoint& p) {
  Block& b = blocks_[i / kPoints];
  const std::size_t k = i % kPoints;
  b.x[k] = p.x;
  b.y[k] = p.y;
  b.chi[k] = p.chi;
  b.xx[k] = p.xx;
  b.xy[k] = p.xy;
  b.xc[k] = p.xc;
  b.yy[k] = p.yy;
  b.yc[k] = p.yc;
  b.cc[k] = p.cc;
  b.noise_t[k] = p.noise_t;
  b.noise_xy[k] = p.noise_xy;
  b.bias[k] = p.bias;
  b.levelSum[k] = p.levelSum;
  b.levelWeight[k] = p.levelWeight;
  b.parallax2[k] = p.parallax2;
  b.r[k] = p.r;
  for (std::size_t j = 0; j < 3; ++j) {
    b.scale[j][k] = p.scale[j];
    b.focal[j][k] = p.focal[j];
  }
  b.rejections[k] = p.rejections;
  b.accepted[k] = p.accepted;
  b.phase[k] = p.phase;
  bool isPlain = !(options_.odometryScaleSigma > 0 || options_.focalSigma > 0);
  for (std::size_t j = 0; j < kPoints; ++j) {
    isPlain = isPlain && b.phase[j] != Phase::unset && b.phase[j] != Phase::behind &&
              b.rejections[j] == 0 && b.accepted[j] == detail::kYoung;
  }
  b.isPlain = isPlain;
}

void InverseDepthFilterBatch::reset(std::size_t i, const PointMeasurement& measurement,
                                    const DepthPrior& prior) {
  if (!measurement.isUsable()) return;
  FilterPoint p;
  detail::resetPoint(p, measurement, prior.sanitised(range_));
  store(i, p);
}

void InverseDepthFilterBatch::predict(const Motion& motion) {
  if (!motion.isUsable()) return;
  step_ = options_.odometry.over(motion);
  dt_ = motion.dt;
  const FilterStep step(motion, step_);
  const Steps steps = stepsFor(instructions_);
  for (std::size_t first = 0; first < size_; first += kPoints) {
    Block& b = blocks_[first / kPoints];
    unsigned left = 0xff;
    if (b.isPlain && !step.unknown.exists()) {
      left = steps.predict(b, step);
      std::memset(b.phase, static_cast<int>(Phase::coasting), sizeof b.phase);
    }
    for (std::size_t k = 0; left != 0; ++k, left >>= 1) {
      if ((left & 1) == 0) continue;
      if (first + k >= size_) {
        fill(b, k);
        continue;
      }
      FilterPoint p = load(first + k);
      detail::predictPoint(p, step, options_);
      store(first + k, p);
    }
  }
}

void InverseDepthFilterBatch::correctOne(std::size_t i, const PointMeasurement& measurement) {
  FilterPoint p = load(i);
  detail::correctPoint(p, measurement, options_, range_);
  store(i, p);
}

void InverseDepthFilterBatch::correct(const double* x, const double* y, const double* sigma) {
  const Gates gates{options_.gate, options_.huber, options_.huber * options_.huber,
                    detail::measurementVariance(0)};
  const Steps steps = stepsFor(instructions_);
  for (std::size_t first = 0; first < size_; first += kPoints) {
    Block& b = blocks_[first / kPoints];
    const std::size_t count = std::min(kPoints, size_ - first);
    unsigned left = (1u << count) - 1;
    if (b.isPlain && count == kPoints) {
      left = steps.correct(b, x + first, y + first, sigma + first, gates);
    } else if (b.isPlain) {
      double padded[3][kPoints] = {};
      std::copy_n(x + first, count, padded[0]);
      std::copy_n(y + first, count, padded[1]);
      std::copy_n(sigma + first, count, padded[2]);
      for (std::size_t k = count; k < kPoints; ++k) {
        padded[0][k] = b.x[k];
        padded[1][k] = b.y[k];
      }
      left = steps.correct(b, padded[0], padded[1], padded[2], gates) & left;
    }
    if (left == 0) {
      std::memset(b.phase, static_cast<int>(Phase::measured), sizeof b.phase);
      continue;
    }
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = first + k;
      if ((left >> k & 1) == 0) {
        b.phase[k] = Phase::measured;
      } else if (!std::isnan(x[i])) {
        correctOne(i, {x[i], y[i], sigma[i]});
      }
    }
  }
}

void InverseDepthFilterBatch::correctDepth(std::size_t i, const DepthPrior& measured) {
  if (!measured.isUsable()) return;
  FilterPoint p = load(i);
  detail::correctPointDepth(p, measured, range_);
  store(i, p);
}

DepthEstimate InverseDepthFilterBatch::estimate(std::size_t i) const {
  return detail::describePoint(load(i), step_, dt_, options_, range_);
}

}  // namespace depthservo
