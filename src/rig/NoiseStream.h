#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <random>

#include "depthservo/rig/SimulatedRigOptions.h"

namespace depthservo {

/// What errs in a simulated robot.
enum class ErrorSource : unsigned {
  slip = 1,
  gyroNoise,
  gyroBias,
  scale,
  stampJitter,
  latency,
  wander,
  mount,
  focal
};

/// Standard normal numbers of one source of errors. Each source has a stream of its own, so that
/// switching one on does not change what the others draw.
class NoiseStream {
 public:
  NoiseStream(unsigned seed, ErrorSource source) : seed_(seed), source_(source) {}

  double next() {
    if (!random_) {  // most sources of most robots are silent, and a seed takes long
      std::seed_seq mixed{seed_, static_cast<unsigned>(source_)};
      random_.emplace(mixed);
    }
    return gaussian_(*random_);
  }
  Eigen::Vector3d next3() {
    const double x = next(), y = next();
    return {x, y, next()};
  }

 private:
  unsigned seed_;
  ErrorSource source_;
  std::optional<std::mt19937_64> random_;
  std::normal_distribution<double> gaussian_;
};

/// Values that err for a while, each by itself: first-order autoregressive, with the correlation
/// exp(-dt / tau) and the same sigma at all times.
class LastingNoise {
 public:
  /// \param size how many values
  LastingNoise(Eigen::Index size, const LastingError& error, NoiseStream stream)
      : error_(error), stream_(std::move(stream)), values_(Eigen::VectorXd::Zero(size)) {}

  /// The values at a time [s], which is not before that of the last call.
  const Eigen::VectorXd& at(double time_s) {
    if (error_.sigma == 0) return values_;
    const double kept = error_.tau > 0 ? std::exp((time_s_ - time_s) / error_.tau) : 0;
    const double fresh = error_.sigma * std::sqrt(1 - kept * kept);
    for (double& value : values_) value = kept * value + fresh * stream_.next();
    time_s_ = time_s;
    return values_;
  }

 private:
  LastingError error_;
  NoiseStream stream_;
  Eigen::VectorXd values_;
  double time_s_ = -HUGE_VAL;  // nothing is kept at the first call
};

}  // namespace depthservo
