#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

namespace depthservo {

/// Random numbers that a text makes: the same on every machine, and for one text independent of
/// all others. (SplitMix64, Steele, Lea, Flood 2014, from the FNV-1a hash of the text.)
class Draws {
 public:
  explicit Draws(std::string_view text) {
    for (const char c : text) {
      constexpr std::uint64_t kPrime = 0x100000001B3U;
      state_ = (state_ ^ static_cast<unsigned char>(c)) * kPrime;
    }
  }

  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
  }

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(bits() >> 11U) * 0x1p-53;
  }

  /// By the method of Box and Muller.
  double normal(double mean, double sigma) {
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    return mean + sigma * radius * std::cos(2 * M_PI * uniform(0, 1));
  }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325U;
};

}  // namespace depthservo
