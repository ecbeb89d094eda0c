#include "depthservo/servo/RunLog.h"

#include <cmath>

namespace depthservo {

const char* toString(Outcome outcome) {
  switch (outcome) {
    case Outcome::converged:
      return "converged";
    case Outcome::stalled:
      return "stalled";
    case Outcome::leftImage:
      return "left-image";
    case Outcome::lost:
      return "lost";
    case Outcome::diverged:
      return "diverged";
    case Outcome::collision:
      return "collision";
    case Outcome::timeout:
      return "timeout";
  }
  return "";
}

double meanImageError(const RunLog& log, double from_s, double to_s) {
  constexpr double kTimeSlack_s = 1e-6;
  struct Sum {
    Eigen::Vector2d error = Eigen::Vector2d::Zero();
    int count = 0;
  };
  std::vector<Sum> sums(log.goals.size());
  for (auto frame = log.frames.rbegin();
       frame != log.frames.rend() && frame->time_s >= from_s - kTimeSlack_s; ++frame) {
    if (frame->time_s > to_s + kTimeSlack_s) continue;
    for (const FeatureRecord& feature : frame->features) {
      const auto i = static_cast<std::size_t>(feature.id);
      if (feature.id < 0 || i >= sums.size()) continue;
      sums[i].error += Eigen::Vector2d(feature.u, feature.v) - log.goals[i];
      ++sums[i].count;
    }
  }
  double squared = 0;
  int features = 0;
  for (const Sum& sum : sums) {
    if (sum.count == 0) continue;
    squared += (sum.error / sum.count).squaredNorm();
    ++features;
  }
  return features > 0 ? std::sqrt(squared / features) : kUnknown;
}

}  // namespace depthservo
