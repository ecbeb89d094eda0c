#include "depthservo/motion/MotionBuffer.h"

#include <algorithm>
#include <cmath>

namespace depthservo {
namespace {

/// Slack at the ends [s]: a double holds epoch seconds to 0.24 us, files hold 9 decimals.
constexpr double kClockResolution_s = 1e-6;

/// A row holds for at most so many median periods, or so long, whichever is more.
constexpr double kHolePeriods = 4, kHole_s = 0.04;

/// A robot speeds up or slows down for about so long, and its commands may come at the same place
/// between two samples each time: what samples miss then has the same sign. Means miss nothing.
constexpr double kSameSign_s = 2;

}  // namespace

const char* toString(Coverage coverage) {
  switch (coverage) {
    case Coverage::complete:
      return "complete";
    case Coverage::hole:
      return "a hole between its rows";
    case Coverage::ended:
      return "it has ended";
    case Coverage::refused:
      return "what was told of the motion cannot be used";
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

MotionBuffer::MotionBuffer(std::size_t capacity, double nominalPeriod_s,
                           const UnknownMotion& bounds)
    : rows_(std::max<std::size_t>(capacity, 2)),
      nominalPeriod_s_(nominalPeriod_s),
      bounds_(bounds) {
  sortedPeriods_.reserve(rows_.size());
}

void MotionBuffer::clear() {
  first_ = size_ = refused_ = 0;
  sortedPeriods_.clear();
}

bool MotionBuffer::push(double time_s, const Twist& twist) {
  Row known;
  known.time_s = time_s;
  known.twist = twist;
  return add(known);
}

bool MotionBuffer::pushUnknown(double time_s) {
  Row unknown;
  unknown.time_s = time_s;
  unknown.isKnown = false;
  if (size_ > 0) unknown.twist = row(size_ - 1).twist;
  const bool isStill = size_ > 0 && !row(size_ - 1).isKnown && time_s > row(size_ - 1).time_s;
  return isStill || add(unknown);
}

void MotionBuffer::holdUntil(double time_s) {
  if (size_ > 0) rows_[(first_ + size_ - 1) % rows_.size()].heldUntil_s = time_s;
}

bool MotionBuffer::add(const Row& added) {
  const double time_s = added.time_s;
  const bool later = size_ == 0 || time_s > row(size_ - 1).time_s;
  if (!std::isfinite(time_s) || !added.twist.isUsable() || !later) {
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
    Row& before = rows_[(first_ + size_ - 1) % rows_.size()];
    const bool saysBefore = meaning_ == RowMeaning::meanBefore && added.isKnown;
    if (saysBefore && before.isKnown && period <= longestHold()) before.twist = added.twist;
  }
  rows_[(first_ + size_) % rows_.size()] = added;
  ++size_;
  return true;
}

double MotionBuffer::medianPeriod() const {
  const std::size_t n = sortedPeriods_.size();
  if (n == 0) return nominalPeriod_s_;
  return 0.5 * (sortedPeriods_[(n - 1) / 2] + sortedPeriods_[n / 2]);
}

double MotionBuffer::longestHold(double medianPeriod_s) {
  return std::max(kHolePeriods * medianPeriod_s, kHole_s);
}

double MotionBuffer::longestHold() const {
  return longestHold(medianPeriod()) + kClockResolution_s;
}

/// Where the known part of row i ends: at the next row, unless that is too far.
double MotionBuffer::knownUntil(std::size_t i) const {
  const Row& r = row(i);
  if (!r.isKnown) return r.time_s;
  const double alone = std::max(r.time_s + medianPeriod(), r.heldUntil_s);
  if (i + 1 == size_) return alone;
  const double next = row(i + 1).time_s;
  return next - r.time_s <= longestHold() ? next : std::min(next, alone);
}

bool MotionBuffer::saysUntil(double time_s) const {
  return meaning_ == RowMeaning::hold || (size_ > 0 && row(size_ - 1).time_s >= time_s);
}

double MotionBuffer::end() const { return knownUntil(size_ - 1); }

MotionBuffer::Known MotionBuffer::known(double t0_s, double t1_s) const {
  if (!std::isfinite(t0_s) || !std::isfinite(t1_s) || t1_s < t0_s) return {Coverage::reversed};
  if (size_ == 0) return {Coverage::empty};
  const bool isTooLong = t1_s - t0_s > Motion::kLongest_s;
  if (isTooLong || t0_s < row(0).time_s - kClockResolution_s) return {Coverage::beforeStart};
  const Row& newest = row(size_ - 1);
  const bool isPast = t1_s > end() + kClockResolution_s;
  const bool mayBeLate = t1_s <= end() + longestHold() - medianPeriod();
  if (isPast && newest.isKnown && mayBeLate) return {Coverage::afterEnd};
  for (std::size_t i = rowAt(t0_s); i < size_ && row(i).time_s <= t1_s; ++i) {
    const double until = i + 1 < size_ ? std::min(row(i + 1).time_s, t1_s) : t1_s;
    const double since = knownUntil(i);
    if (until <= since + kClockResolution_s) continue;
    const Coverage absent = i + 1 < size_ ? Coverage::hole : Coverage::ended;
    return {row(i).isKnown ? absent : Coverage::refused, since};
  }
  return {Coverage::complete};
}

/// The row that holds at a time: the last one that does not begin after it. Found from where it
/// would be if all rows were equally long, in steps that double.
std::size_t MotionBuffer::rowAt(double time_s) const {
  const auto begun = [&](std::size_t i) { return row(i).time_s <= time_s; };
  const double first_s = row(0).time_s, last_s = row(size_ - 1).time_s;
  const double span_s = last_s - first_s;  // infinite where times are beyond sense
  const double share = span_s > 0 && std::isfinite(span_s) ? (time_s - first_s) / span_s : 0;
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

/// Calls part(row, from, to) for the part of each row between the two times.
template <class Part>
void MotionBuffer::forEachPart(double t0_s, double t1_s, const Part& part) const {
  std::size_t i = rowAt(t0_s);
  for (double t = t0_s; t < t1_s; ++i) {
    const double rowEnd = i + 1 < size_ ? std::min(row(i + 1).time_s, t1_s) : t1_s;
    part(i, t, rowEnd);
    t = rowEnd;
  }
}

/// Whether the row after row i is at hand and no hole is between them.
bool MotionBuffer::isFollowed(std::size_t i) const {
  return i + 1 < size_ && row(i + 1).isKnown && row(i + 1).time_s - row(i).time_s <= longestHold();
}

/// Change of the twist in the time from row i to the next, as far as the rows up to that say: to
/// its sample, or as much as the mean differs from that of the row before.
Vector6d MotionBuffer::changeIn(std::size_t i) const {
  if (meaning_ == RowMeaning::instant) return row(i + 1).twist.vector() - row(i).twist.vector();
  if (i == 0 || !isFollowed(i - 1)) return Vector6d::Zero();
  return row(i).twist.vector() - row(i - 1).twist.vector();
}

/// Mean over a part of the time from row i to the next.
Twist MotionBuffer::twistIn(std::size_t i, double from_s, double to_s) const {
  const Twist& twist = row(i).twist;
  if (meaning_ == RowMeaning::hold || !isFollowed(i)) return twist;
  const double met = meaning_ == RowMeaning::instant ? 0 : 0.5;  // where in the row its twist is
  const double period_s = row(i + 1).time_s - row(i).time_s;
  const double share = (0.5 * (from_s + to_s) - row(i).time_s) / period_s - met;
  const Vector6d change = share * changeIn(i);
  return {twist.linear + change.head<3>(), twist.angular + change.tail<3>()};
}

/// With a change by d at a time that is uniform over the period T: between two samples the twist
/// differs from the straight line as a Brownian bridge does; of a row with a known mean the
/// integral is right again at the end; what goes on from the newest row does not come back.
WithinRows MotionBuffer::within(std::size_t i, double from_s, double to_s) const {
  if (meaning_ == RowMeaning::hold) return {};
  const bool isNewest = !isFollowed(i);
  if (isNewest && (i == 0 || !isFollowed(i - 1))) return {};  // nothing is known of changes
  const std::size_t last = isNewest ? i - 1 : i;              // that is known whole
  const double T = row(last + 1).time_s - row(last).time_s;
  const double a = (from_s - row(i).time_s) / T, b = (to_s - row(i).time_s) / T, l = b - a;
  const double onwards = l * l * a + l * l * l / 3;
  const Vector6d change = changeIn(last);
  Eigen::Array<double, 6, 1> squares = change.array().square();
  if (meaning_ == RowMeaning::instant) {
    const double mean = 0.5 * (b * b - a * a);
    squares *= isNewest ? onwards : std::max(0., onwards - mean * mean);
    squares /= std::tanh(0.5 * T / kSameSign_s);  // of errors that last, counted as white
  } else if (isNewest) {
    squares *= onwards + 0.5 * l * l;  // the mean is half a row old
  } else {
    const auto bridge = [](double x, double y) {  // covariance at x <= y
      return x * (1 - y) * ((2 * y - x * x - y * y) / 6 - y * (1 - x) / 4);
    };
    squares *= std::max(0., bridge(a, a) + bridge(b, b) - 2 * bridge(a, b));
    if (last > 0) {  // the change is not that of the row before
      const double bend = 0.5 * (b * (1 - b) - a * (1 - a));
      squares += bend * bend * (change - changeIn(last - 1)).array().square();
    }
  }
  squares *= T * T;
  return {squares.head<3>().sum(), squares.tail<3>().sum()};
}

Motion MotionBuffer::partOf(std::size_t i, double from_s, double to_s) const {
  Motion motion = Motion::fromTwist(twistIn(i, from_s, to_s), to_s - from_s);
  motion.within = within(i, from_s, to_s);
  return motion;
}

MotionBuffer::Interval MotionBuffer::motion(double t0_s, double t1_s) const {
  Interval interval{{}, coverage(t0_s, t1_s)};
  if (!hasMotion(interval.coverage)) return interval;
  const bool isComplete = interval.coverage == Coverage::complete;
  forEachPart(t0_s, t1_s, [&](std::size_t i, double from_s, double to_s) {
    const Twist& twist = row(i).twist;
    const double end_s = isComplete ? to_s : std::clamp(knownUntil(i), from_s, to_s);
    if (end_s > from_s) {
      interval.motion = interval.motion.then(partOf(i, from_s, end_s));
    }
    if (end_s == to_s) return;
    const double start_s = std::min(knownUntil(i), end_s);
    const UnknownPart part = bounds_.over(twist, end_s - start_s, to_s - start_s);
    interval.motion = interval.motion.then(Motion::notKnown(part));
  });
  return interval;
}

MotionBuffer::Mean MotionBuffer::meanTwist(double t0_s, double t1_s) const {
  Mean mean{{}, coverage(t0_s, t1_s)};
  if (mean.coverage != Coverage::complete || t0_s == t1_s) return mean;
  forEachPart(t0_s, t1_s, [&](std::size_t i, double from_s, double to_s) {
    const double share = (to_s - from_s) / (t1_s - t0_s);
    const Twist twist = twistIn(i, from_s, to_s);
    mean.twist.linear += share * twist.linear;
    mean.twist.angular += share * twist.angular;
  });
  return mean;
}

}  // namespace depthservo
