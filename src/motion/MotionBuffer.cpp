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

Coverage MotionBuffer::coverage(double t0_s, double t1_s) const {
  if (!std::isfinite(t0_s) || !std::isfinite(t1_s) || t1_s < t0_s) return Coverage::reversed;
  if (size_ == 0) return Coverage::empty;
  if (t0_s < row(0).time_s - kClockResolution_s) return Coverage::beforeStart;
  if (t1_s > end() + kClockResolution_s) return Coverage::afterEnd;
  return Coverage::complete;
}

/// The row that holds at a time: the last one that does not begin after it. Found from where it
/// would be if all rows were equally long, in steps that double.
std::size_t MotionBuffer::rowAt(double time_s) const {
  const auto begun = [&](std::size_t i) { return row(i).time_s <= time_s; };
  const double first_s = row(0).time_s, last_s = row(size_ - 1).time_s;
  const double share = last_s > first_s ? (time_s - first_s) / (last_s - first_s) : 0;
  std::size_t low = static_cast<std::size_t>(std::clamp(share, 0., 1.) * double(size_ - 1));
  std::size_t high = low + 1;
  for (std::size_t step = 1; low > 0 && !begun(low); step *= 2) {
    high = low;
    low -= std::min(step, low);
  }
  for (std::size_t step = 1; high < size_ && begun(high); step *= 2) {
    low = high;
    high = std::min(high + step, size_);
  }
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (begun(middle) ? low : high) = middle;
  }
  return low;
}

/// Calls part(twist, duration) for the part of each row between the two times.
template <class Part>
void MotionBuffer::forEachPart(double t0_s, double t1_s, const Part& part) const {
  std::size_t i = rowAt(t0_s);
  for (double t = t0_s; t < t1_s; ++i) {
    const double rowEnd = i + 1 < size_ ? std::min(row(i + 1).time_s, t1_s) : t1_s;
    part(row(i).twist, rowEnd - t);
    t = rowEnd;
  }
}

MotionBuffer::Interval MotionBuffer::motion(double t0_s, double t1_s) const {
  Interval interval{{}, coverage(t0_s, t1_s)};
  if (interval.coverage != Coverage::complete) return interval;
  forEachPart(t0_s, t1_s, [&](const Twist& twist, double duration_s) {
    interval.motion = interval.motion.then(Motion::fromTwist(twist, duration_s));
  });
  return interval;
}

MotionBuffer::Mean MotionBuffer::meanTwist(double t0_s, double t1_s) const {
  Mean mean{{}, coverage(t0_s, t1_s)};
  if (mean.coverage != Coverage::complete || t0_s == t1_s) return mean;
  forEachPart(t0_s, t1_s, [&](const Twist& twist, double duration_s) {
    const double share = duration_s / (t1_s - t0_s);
    mean.twist.linear += share * twist.linear;
    mean.twist.angular += share * twist.angular;
  });
  return mean;
}

}  // namespace depthservo
