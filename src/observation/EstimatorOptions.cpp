#include "depthservo/observation/EstimatorOptions.h"

#include <fmt/format.h>

#include "observation/estimatorWords.h"

namespace depthservo {

const std::vector<detail::Choice<EstimatorKind>>& estimatorWords() {
  static const std::vector<detail::Choice<EstimatorKind>> all = {
      {EstimatorKind::constant, "constant"},  {EstimatorKind::trueDepth, "true"},
      {EstimatorKind::twoFrame, "two-frame"}, {EstimatorKind::nonlinear, "nonlinear"},
      {EstimatorKind::window, "window"},      {EstimatorKind::filter, "filter"},
      {EstimatorKind::joint, "joint"},        {EstimatorKind::pose, "pose"},
  };
  return all;
}

const std::vector<detail::Choice<ErrorKind>>& errorWords() {
  static const std::vector<detail::Choice<ErrorKind>> all = {
      {ErrorKind::automatic, "automatic"},
      {ErrorKind::declared, "declared"},
      {ErrorKind::exact, "exact"},
      {ErrorKind::typical, "typical"},
      {ErrorKind::arm, "arm"},
      {ErrorKind::poses, "poses"},
  };
  return all;
}

const char* toString(ErrorKind kind) {
  return kind == ErrorKind::file ? "file" : detail::wordOf(errorWords(), kind);
}

std::optional<ErrorKind> errorKindNamed(const std::string& name) {
  return detail::valueOf(errorWords(), name);
}

std::vector<std::string> errorKindNames() { return detail::wordsOf(errorWords()); }

const char* toString(EstimatorKind kind) { return detail::wordOf(estimatorWords(), kind); }

EstimatorKind estimatorNamed(const std::string& name, const InputError::Place& place) {
  if (const auto kind = detail::valueOf(estimatorWords(), name)) return *kind;
  throw InputError(place, detail::unknownWord(name, detail::wordsOf(estimatorWords())));
}

ObserverGains ObserverGainOptions::observer() const {
  if (!k || !k_3) return ObserverGains::scheduled(settling, W_min);
  ObserverGains gains;
  gains.k = *k;
  gains.k_3 = *k_3;
  return gains;
}

void check(const EstimatorOptions& depth, const Refuse& refuse) {
  if (depth.Z_min >= depth.Z_max) {
    refuse("Z_min", fmt::format("{} m must be below Z_max = {} m", depth.Z_min, depth.Z_max));
  }
  if (depth.object && depth.estimator != EstimatorKind::nonlinear) {
    refuse("object",
           fmt::format("needs the estimator nonlinear, not {}", toString(depth.estimator)));
  }
  if (depth.euler && (depth.estimator != EstimatorKind::nonlinear || depth.object)) {
    refuse("euler", fmt::format("needs the estimator nonlinear, not {}, and a depth for each point",
                                toString(depth.estimator)));
  }
  if (depth.gains.k.has_value() != depth.gains.k_3.has_value()) {
    refuse(depth.gains.k ? "gains.k" : "gains.k_3",
           "k and k_3 go together; give both, or settling and W_min");
  }
}

}  // namespace depthservo
