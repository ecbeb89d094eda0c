#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Figures of a replay that were looked at once and accepted, kept in a JSON file:
///     {"name": "mire-2", "tolerance": 1e-6, "figures": {"frames": 501, "point 0, Z at 100 %": 1.2,
///     ...}}
/// The tolerance is relative, and may be edited.
class Baseline {
 public:
  /// The figures of this log, with a tolerance of 1e-6.
  static Baseline of(const RunLog& log);

  /// \throw InputError no such file, or not a baseline
  static Baseline load(const std::filesystem::path& file);

  /// \throw InputError the file cannot be written
  void save(const std::filesystem::path& file) const;

  /// A figure that is not what was accepted; NaN stands for a figure that one side does not have.
  struct Difference {
    std::string figure;
    double accepted, now;
  };
  /// Every figure of `now` that has moved by more than this baseline's tolerance, appeared or
  /// disappeared.
  std::vector<Difference> differences(const Baseline& now) const;

  double tolerance() const { return tolerance_; }
  void setTolerance(double tolerance) { tolerance_ = tolerance; }

 private:
  std::string name_;
  double tolerance_ = 1e-6;
  std::vector<std::pair<std::string, double>> figures_;
};

}  // namespace depthservo
