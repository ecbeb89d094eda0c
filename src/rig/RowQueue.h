#pragma once

#include <deque>
#include <vector>

#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/motion/OdometryRow.h"

namespace depthservo {

/// Rows of odometry on their way to an image that needs them.
class RowQueue {
 public:
  void offer(const OdometryRow& row) { waiting_.push_back(row); }

  /// Adds the rows that begin before the image, as a robot has them by then; and a later one where
  /// the last of them does not say how the camera went on, or would not hold that long, and the
  /// next is known. Appends them to `used`.
  void readInto(MotionBuffer& odometry, double time_s, std::vector<OdometryRow>& used) {
    const auto isNeeded = [&](const OdometryRow& row) {
      return row.time_s < time_s || !odometry.saysUntil(time_s) ||
             odometry.coverage(time_s, time_s) == Coverage::afterEnd;
    };
    for (; !waiting_.empty() && isNeeded(waiting_.front()); waiting_.pop_front()) {
      odometry.push(waiting_.front().time_s, waiting_.front().twist);
      used.push_back(waiting_.front());
    }
  }

  /// Whether more rows would not change what is known of the motion up to this time [s].
  bool isCoveredBeyond(double time_s) const {
    return !waiting_.empty() && waiting_.back().time_s >= time_s;
  }

 private:
  std::deque<OdometryRow> waiting_;
};

}  // namespace depthservo
