#pragma once

#include <fmt/format.h>

#include <string>

#include "depthservo/motion/Twist.h"

namespace depthservo::detail {

/// First line of a file or stream of twists.
constexpr const char* kTwistHeader = "timestamp,vx,vy,vz,wx,wy,wz";

/// A row with its end of line; the numbers come back exactly.
inline std::string twistLine(double time_s, const Twist& twist) {
  const Eigen::Vector3d &v = twist.linear, &w = twist.angular;
  return fmt::format("{:.9f},{},{},{},{},{},{}\n", time_s, v.x(), v.y(), v.z(), w.x(), w.y(),
                     w.z());
}

}  // namespace depthservo::detail
