#pragma once

#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

namespace depthservo {

/// Seconds of wall clock since the last call.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double> lap = now - last_;
    last_ = now;
    return lap.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// The last of many durations, as many as images come in five minutes at 30 Hz; in no order.
class LastLaps {
 public:
  void add(double duration_s) {
    constexpr std::size_t kMost = 9000;
    if (laps_.size() < kMost) {
      laps_.push_back(duration_s);
    } else {
      laps_[oldest_++ % kMost] = duration_s;
    }
  }
  std::vector<double> take() { return std::move(laps_); }

 private:
  std::vector<double> laps_;
  std::size_t oldest_ = 0;
};

}  // namespace depthservo
