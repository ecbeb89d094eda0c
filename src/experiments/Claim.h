#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/experiments/JudgedClaim.h"

namespace depthservo {

/// What experiments gave, by the ids of the figures.
class Measurements {
 public:
  struct Value {
    double value = 0;
    std::string note;  ///< instead of the claim's own; empty: none
  };

  /// \throw std::logic_error there is a value of this id
  void add(const std::string& id, double value, std::string note = "");
  const Value* find(const std::string& id) const;

 private:
  std::map<std::string, Value> values_;
};

/// A figure and what it must be: a row of data/papers/<paper>.yaml, or of `claims` of a sweep.
struct Claim {
  std::string id;  ///< without the paper's name
  std::string text, paper, unit, note;
  double expected = 0;
  std::string within = "0";  ///< "2 %" or "0.1" of expected, "factor 1.5", "at most 3"
  std::string holds;         ///< when the paper's claim does; empty: when the figure agrees

  /// Least and greatest figure that agree with it.
  std::pair<double, double> accepted() const;
  /// `within` for people, with the unit.
  std::string tolerance() const;

  /// Why it could not be judged, by the key: within | holds; empty: it can.
  std::pair<std::string, std::string> fault() const;
};

/// A figure that was not measured does not agree. \param prefix of the id of the result
JudgedClaim judge(const Claim& claim, const Measurements& measured, const std::string& prefix = "");

}  // namespace depthservo
