#include "depthservo/motion/MotionBuffer.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// Slack at the ends [s]: a double holds epoch seconds to 0.24 us, files hold 9 decimals.
constexpr double kClockResolution_s = 1e-6;

}  // namespace

const char* toString(Coverage coverage) {
  switch (coverage) {
    case Coverage::complete:
      return "complete";
    case Coverage::empty:
      return "no odometry";
    case Coverage::beforeStart:
      return "before the first odometry row";
    case Coverage::afterEnd:
      return "after the last odometry row";
    case Coverage::reversed:
      return "time runs backwards";
  }
  return "";
}

MotionBuffer::MotionBuffer(std::size_t capacity, double nominalPeriod_s)
    : rows_(std::max<std::size_t>(capacity, 2)), nominalPeriod_s_(nominalPeriod_s) {
  sortedPeriods_.reserve(rows_.size());
}

void MotionBuffer::clear() {
  first_ = size_ = refused_ = 0;
  sortedPeriods_.clear();
  heldUntil_s_ = -std::numeric_limits<double>::infinity();
}

bool MotionBuffer::push(double time_s, const Twist& twist) {
  const bool later = size_ == 0 || time_s > row(size_ - 1).time_s;
  if (!std::isfinite(time_s) || !twist.isFinite() || !later) {
    ++refused_;
    return false;
  }
  if (size_ == rows_.size()) {
    const double oldest = row(1).time_s - row(0).time_s;
    sortedPeriods_.erase(std::lower_bound(sortedPeriods_.begin(), sortedPeriods_.end(), oldest));
    first_ = (first_ + 1) % rows_.size();
    --size_;
  }
  if (size_ > 0) {
    const double period = time_s - row(size_ - 1).time_s;
    sortedPeriods_.insert(std::upper_bound(sortedPeriods_.begin(), sortedPeriods_.end(), period),
                          period);
  }
  rows_[(first_ + size_) % rows_.size()] = {time_s, twist};
  ++size_;
  heldUntil_s_ = -std::numeric_limits<double>::infinity();
  return true;
}

double MotionBuffer::medianPeriod() const {
  const std::size_t n = sortedPeriods_.size();
  if (n == 0) return nominalPeriod_s_;
  return 0.5 * (sortedPeriods_[(n - 1) / 2] + sortedPeriods_[n / 2]);
}

double MotionBuffer::end() const {
  return std::max(row(size_ - 1).time_s + medianPeriod(), heldUntil_s_);
}

MotionBuffer::Interval MotionBuffer::motion(double t0_s, double t1_s) const {
  if (!std::isfinite(t0_s) || !std::isfinite(t1_s) || t1_s < t0_s) return {{}, Coverage::reversed};
  if (size_ == 0) return {{}, Coverage::empty};
  if (t0_s < row(0).time_s - kClockResolution_s) return {{}, Coverage::beforeStart};
  if (t1_s > end() + kClockResolution_s) return {{}, Coverage::afterEnd};

  // The row that holds at t0: the last one that does not begin after it. Binary search in the ring.
  std::size_t low = 0, high = size_;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (row(middle).time_s <= t0_s ? low : high) = middle;
  }
  Motion motion;
  for (double t = t0_s; t < t1_s; ++low) {
    const double rowEnd = low + 1 < size_ ? std::min(row(low + 1).time_s, t1_s) : t1_s;
    motion = motion.then(Motion::fromTwist(row(low).twist, rowEnd - t));
    t = rowEnd;
  }
  return {motion, Coverage::complete};
}

}  // namespace depthservo
