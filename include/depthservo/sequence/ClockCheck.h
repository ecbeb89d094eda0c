#pragma once

#include <string>
#include <vector>

#include "depthservo/api.h"

namespace depthservo {

struct TimeSpan {
  double from_s = 0, to_s = 0;
};

/// How the times of images and of odometry (or poses) fit together.
struct ClockCheck {
  TimeSpan images, odometry;

  /// Whether the odometry tells the motion of some image at least.
  bool overlaps = false;

  /// How long images come before the first row and after the last one stops to hold [s]; 0 when not
  /// longer than a hole would have to be.
  double missingBefore_s = 0, missingAfter_s = 0;

  /// Intervals between two rows, within the images' span, that are longer than four median periods
  /// and 0.04 s: the motion in them is unknown.
  std::vector<TimeSpan> holes;

  /// What is to be told of all this, one sentence each; of units, too (images 33 s apart).
  std::vector<std::string> findings;
};

/// \param imageTimes [s], increasing, not empty
/// \param odometryTimes times of the rows [s], increasing, not empty; a row holds until the next,
/// the last one for a median period
/// \param odometryName what to call it in the findings
DEPTHSERVO_API ClockCheck describeClocks(const std::vector<double>& imageTimes,
                                         const std::vector<double>& odometryTimes,
                                         const std::string& odometryName = "odometry");

/// Intervals between successive times that are longer than four times the median and 0.04 s (twice
/// what associate.py of the TUM RGB-D benchmark accepts between an image and its pose).
DEPTHSERVO_API std::vector<TimeSpan> holesOf(const std::vector<double>& times);

}  // namespace depthservo
