#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/experiments/SweepFolder.h"

namespace depthservo {

/// Successes among runs.
struct Successes {
  std::size_t successes = 0, runs = 0;

  double share() const { return static_cast<double>(successes) / static_cast<double>(runs); }
  /// Where the true share is, with 95 %, by Wilson's score interval (1927).
  std::pair<double, double> interval() const;
};

/// The places that the values of a column have in a picture: each its own, or bins of numbers.
struct SweepScale {
  std::string title;                ///< of the column, with its unit
  std::vector<std::string> labels;  ///< by place
  std::vector<double> numbers;      ///< by place, the middle; empty: words
  std::vector<double> edges;        ///< of bins; empty: each value has a place
  bool isLog = false;
  std::map<std::string, std::size_t> places;  ///< by cell

  bool isOfNumbers() const { return !numbers.empty(); }
  std::size_t size() const { return labels.size(); }
};

/// The results of a sweep, with the coordinates of each.
class SweepTable {
 public:
  SweepTable(const Sweep& sweep, std::vector<SweepResult> results);

  const Sweep& sweep() const { return sweep_; }
  const std::vector<SweepResult>& results() const { return results_; }
  const std::string& cell(std::size_t result, std::size_t column) const {
    return rows_[result].cells[column];
  }
  const Sweep::Row& row(std::size_t result) const { return rows_[result]; }

  std::size_t column(const std::string& name) const;  ///< of the sweep's
  SweepScale scale(const std::string& column) const;
  /// The metric of a run; NaN: not known, or not kept.
  double metric(std::size_t result, const std::string& name) const;

  bool isSuccess(const std::string& outcome) const;
  std::map<std::string, std::size_t> outcomes() const;
  Successes all() const;

  /// Those of the sweep, or what suits its columns.
  std::vector<SweepMap> maps() const;
  std::vector<SweepCurve> curves() const;

  /// Runs that a person should look at, the worst of each kind of failure first; by result.
  std::vector<std::size_t> worst(std::size_t most) const;

 private:
  std::vector<std::string> columnsThat(bool areOfNumbers) const;

  const Sweep& sweep_;
  std::vector<SweepResult> results_;
  std::vector<Sweep::Row> rows_;
};

}  // namespace depthservo
