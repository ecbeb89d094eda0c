#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/papers/Reproduce.h"

namespace depthservo {

/// What the experiments of a paper gave, by the ids of the figures without the paper's name.
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

/// A figure of a paper and what it must be: a row of data/papers/<paper>.yaml.
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
};

struct Claims {
  Paper paper;
  std::vector<Claim> all;
  struct Words {
    std::string title, caption;
  };
  std::map<std::string, Words> figures;  ///< by name
};

/// What running a paper's experiments gives, not yet judged.
struct Experiments {
  Measurements measured;
  std::vector<Figure> figures;
};

/// The claims of a paper, as they are compiled in. \param full of a full reproduction
Claims claimsOf(const std::string& paper, bool full = false);

/// The same from YAML. \throw InputError
Claims readClaims(const std::string& yaml, const std::string& paper, bool full);

/// Every claim against what was measured; a figure that was not measured does not agree.
std::vector<ReproduceRow> judge(const Claims& claims, const Measurements& measured);

/// Gives figures their titles and captions. \throw std::out_of_range there are none of a figure
void describe(std::vector<Figure>& figures, const Claims& claims);

}  // namespace depthservo
