#include "simulation/sensorNoise.h"

#include <algorithm>
#include <cmath>

namespace depthservo::detail {
namespace {

/// log2 of the number of noise values; 5 of these indices fit in one random word.
constexpr int kNoiseBits = 12;
constexpr std::size_t kNoisePerWord = 64 / kNoiseBits;

/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014: word `index` of
/// stream `key`.
std::uint64_t randomWord(std::uint64_t key, std::uint64_t index) {
  std::uint64_t z = key + (index + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

}  // namespace

std::vector<float> normalQuantiles(double sigma) {
  const std::size_t n = std::size_t{1} << kNoiseBits;
  std::vector<double> values(n);
  double x = 0, sum2 = 0;
  for (std::size_t i = n / 2; i < n;
       ++i) {  // upper half, each from its neighbour by Newton's method
    const double upperTail = 1 - (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    for (int k = 0; k < 8; ++k) {
      const double density = std::exp(-0.5 * x * x) / std::sqrt(2 * M_PI);
      x += (0.5 * std::erfc(x / std::sqrt(2.0)) - upperTail) / density;
    }
    values[i] = x;
    values[n - 1 - i] = -x;
    sum2 += 2 * x * x;
  }
  const double scale = sigma / std::sqrt(sum2 / static_cast<double>(n));
  std::vector<float> quantiles(n);
  std::transform(values.begin(), values.end(), quantiles.begin(),
                 [scale](double value) { return static_cast<float>(scale * value); });
  return quantiles;
}

void addNoise(const std::vector<float>& quantiles, std::uint64_t seed, std::uint64_t frame,
              std::vector<float>& light) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kNoiseBits) - 1;
  const std::uint64_t key = randomWord(randomWord(0, seed), frame);
  std::size_t i = 0;
  for (std::uint64_t index = 0; i < light.size(); ++index) {
    std::uint64_t word = randomWord(key, index);
    const std::size_t end = std::min(light.size(), i + kNoisePerWord);
    for (; i < end; ++i, word >>= kNoiseBits) light[i] += quantiles[word & kMask];
  }
}

std::vector<float> vignette(const PinholeCamera& camera, double loss) {
  const double u = std::max(camera.cx, camera.width - 1 - camera.cx);
  const double v = std::max(camera.cy, camera.height - 1 - camera.cy);
  const double lossPerPixel2 = loss / (u * u + v * v);
  std::vector<float> gain;
  gain.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int j = 0; j < camera.height; ++j) {
    for (int i = 0; i < camera.width; ++i) {
      const double r2 = (i - camera.cx) * (i - camera.cx) + (j - camera.cy) * (j - camera.cy);
      gain.push_back(static_cast<float>(std::max(0.0, 1 - lossPerPixel2 * r2)));
    }
  }
  return gain;
}

}  // namespace depthservo::detail
