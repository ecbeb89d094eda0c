#include "report/TimeRows.h"

#include <algorithm>
#include <cmath>

#include "depthservo/observation/RunLog.h"

namespace depthservo {

TimeRows::TimeRows(std::size_t frames, std::size_t most) : count_(frames) {
  if (frames <= most) {
    for (std::size_t i = 0; i < frames; ++i) frames_.push_back(i);
    return;
  }
  const std::size_t buckets = (most - 2) / 2, inner = frames - 2;
  bucket_ = (inner + buckets - 1) / buckets;
  frames_.push_back(0);
  for (std::size_t begin = 1; begin < frames - 1; begin += bucket_) {
    const std::size_t length = std::min(bucket_, frames - 1 - begin);
    frames_.push_back(begin + length / 4);
    if (length > 1) frames_.push_back(begin + std::max(length / 4 + 1, 3 * length / 4));
  }
  frames_.push_back(frames - 1);
}

TimeRows::Place TimeRows::placeOf(std::size_t frame) const {
  if (bucket_ == 1) return {frame, frame};
  if (frame == 0) return {0, 0};
  const std::size_t last = frames_.size() - 1;
  if (frame == count_ - 1) return {last, last};
  const std::size_t first = 1 + 2 * ((frame - 1) / bucket_);
  return {first, std::min(first + 1, last - 1)};
}

ThinnedColumn::ThinnedColumn(const TimeRows& rows, Shown shown)
    : rows_(&rows), shown_(shown), values_(rows.size(), kUnknown) {}

void ThinnedColumn::add(std::size_t frame, double value) {
  if (std::isnan(value)) return;
  const auto [first, second] = rows_->placeOf(frame);
  double &a = values_[first], &b = values_[second];
  if (first == second) {
    a = value;
    return;
  }
  switch (shown_) {
    case Shown::sample:
      if (frame == rows_->frameOf(first)) a = value;
      if (frame == rows_->frameOf(second)) b = value;
      return;
    case Shown::lowest:
      a = b = std::fmin(a, value);
      return;
    case Shown::highest:
      a = b = std::fmax(a, value);
      return;
    case Shown::extremes:
      if (std::isnan(a)) {
        a = b = value;
      } else if (const double low = std::min(a, b), high = std::max(a, b); value > high) {
        a = low;
        b = value;
      } else if (value < low) {
        a = high;
        b = value;
      }
      return;
  }
}

}  // namespace depthservo
