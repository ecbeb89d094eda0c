#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/papers/Reproduce.h"

namespace depthservo {

/// Collects the rows of a paper.
class Rows {
 public:
  /// \param prefix of every id, "<paper>/"
  explicit Rows(std::string prefix) : prefix_(std::move(prefix)) {}

  /// A figure that must agree within a relative tolerance. The claim reproduces when it does;
  /// change the returned row when the paper says more or something else.
  ReproduceRow& add(const std::string& id, const std::string& claim, double expected, double ours,
                    const std::string& unit, double tolerance) {
    ReproduceRow row;
    row.id = prefix_ + id;
    row.claim = claim;
    row.expected = expected;
    row.ours = std::isfinite(ours) ? ours : std::numeric_limits<double>::max();
    row.unit = unit;
    row.pass = std::abs(ours - expected) <= tolerance * std::abs(expected);
    row.reproduces = row.pass;
    rows_.push_back(std::move(row));
    return rows_.back();
  }

  /// A figure that must agree within an absolute tolerance, such as one in its last digit.
  ReproduceRow& addWithin(const std::string& id, const std::string& claim, double expected,
                          double ours, const std::string& unit, double tolerance) {
    ReproduceRow& row = add(id, claim, expected, ours, unit, 0);
    row.pass = row.reproduces = std::abs(ours - expected) <= tolerance;
    return row;
  }

  /// A statistic, which must agree within a factor.
  ReproduceRow& addWithinFactor(const std::string& id, const std::string& claim, double expected,
                                double ours, const std::string& unit, double factor) {
    ReproduceRow& row = add(id, claim, expected, ours, unit, 0);
    row.pass = row.reproduces = ours <= expected * factor && ours >= expected / factor;
    return row;
  }

  /// Something that is or is not so: 1 or 0.
  ReproduceRow& addTruth(const std::string& id, const std::string& claim, bool ours) {
    return add(id, claim, 1, ours ? 1 : 0, "yes = 1", 0);
  }

  std::vector<ReproduceRow> take() { return std::move(rows_); }

 private:
  std::string prefix_;
  std::vector<ReproduceRow> rows_;
};

}  // namespace depthservo
