#include "experiments/sweepAxes.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <set>

#include "depthservo/text/InputError.h"
#include "experiments/Draws.h"
#include "experiments/sweepStarts.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

/// Numbers to twelve digits: the same text on every machine.
std::string written(double value) {
  return fmt::format("{}", *detail::toNumber(fmt::format("{:.12g}", value)));
}

/// One axis while it is expanded.
class Expansion {
 public:
  Expansion(const SweepAxis& axis, const AxisContext& context) : axis_(axis), context_(context) {}

  SweptAxis expand() {
    checkName();
    checkKinds();
    swept_.columns = {axis_.name};
    if (axis_.cone) {
      drawCone();
    } else if (!axis_.cases.empty()) {
      for (const SweepCase& one : axis_.cases) swept_.values.push_back({{one.name}, one.set});
    } else if (axis_.draw != SweepDraw::none) {
      drawNumbers();
    } else if (axis_.from) {
      spread();
    } else {
      for (const std::string& value : axis_.values) add(shortly(value), value);
    }
    checkDistinct();
    return std::move(swept_);
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError({context_.file, 0, "axes." + axis_.name}, why);
  }

  void checkName() const {
    constexpr std::size_t kLongest = 40;
    bool isWord = !axis_.name.empty() && axis_.name.size() <= kLongest &&
                  std::isalpha(static_cast<unsigned char>(axis_.name[0])) != 0;
    for (const char c : axis_.name) {
      isWord = isWord && (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-');
    }
    if (!isWord) refuse("expected a name of up to 40 letters, digits, _ and -, a letter first");
  }

  /// One way to say which values there are.
  void checkKinds() const {
    const bool isRange = axis_.from || axis_.to, isNormal = axis_.draw == SweepDraw::normal;
    const int ways = !axis_.values.empty() + (isRange || isNormal) + !axis_.cases.empty() +
                     axis_.cone.has_value();
    if (ways != 1) refuse("expected exactly one of values, from and to, draw, cases and cone");
    const bool needsKey = axis_.cases.empty() && !axis_.cone;
    if (needsKey == axis_.key.empty()) {
      refuse(needsKey ? "needs the key that its values are of" : "cases and cone have no key");
    }
    const bool needsCount = isRange || isNormal || axis_.cone;
    if (needsCount && axis_.count < 1) refuse("needs a count of at least 1");
    if (!needsCount && axis_.count != 0) refuse("count is for from and to, draw and cone");
    if (isRange && isNormal) refuse("draw: normal has mean and sigma, not from and to");
    if (isRange && !(axis_.from && axis_.to)) refuse("needs both from and to");
    if (isRange && !(*axis_.from < *axis_.to)) refuse("from must be below to");
    if (axis_.isLog && !(isRange && *axis_.from > 0)) refuse("log needs a from above 0");
    if (axis_.draw == SweepDraw::uniform && !isRange) refuse("draw: uniform needs from and to");
    if (isRange && axis_.draw == SweepDraw::none && axis_.count < 2) {
      refuse("from and to are two values: count must be at least 2");
    }
    if (axis_.cone && !(axis_.cone->distance[0] <= axis_.cone->distance[1])) {
      refuse("cone.distance: the least comes first");
    }
  }

  void checkDistinct() const {
    std::set<std::vector<std::string>> seen;
    for (const SweptValue& value : swept_.values) {
      if (!seen.insert(value.cells).second) refuse(value.cells.front() + " appears twice");
    }
  }

  void add(const std::string& cell, const std::string& value) {
    swept_.values.push_back({{cell}, {axis_.key + "=" + value}});
  }

  /// A number as all others are written; else as it stands.
  static std::string shortly(const std::string& value) {
    const auto number = detail::toNumber(value);
    return number ? fmt::format("{}", *number) : value;
  }

  /// From 0 to 1.
  double between(double share) const {
    const double a = *axis_.from, b = *axis_.to;
    return axis_.isLog ? a * std::pow(b / a, share) : a + (b - a) * share;
  }

  void spread() {
    for (int i = 0; i < axis_.count; ++i) {
      const std::string value = written(between(static_cast<double>(i) / (axis_.count - 1)));
      add(value, value);
    }
  }

  std::string streamOf(int i) const {
    return fmt::format("{}|{}|{}", context_.seed, axis_.name, i);
  }

  void drawNumbers() {
    for (int i = 0; i < axis_.count; ++i) {
      Draws draws(streamOf(i));
      const std::string value = written(axis_.draw == SweepDraw::uniform
                                            ? between(draws.uniform(0, 1))
                                            : draws.normal(axis_.mean, axis_.sigma));
      add(value, value);
    }
  }

  void drawCone() {
    const Scenario scenario = context_.scenario();
    const bool isFree = scenario.robot.type == RobotKind::free;
    for (const char* what : {"distance", "bearing", "aim"}) {
      swept_.columns.push_back(axis_.name + "." + what);
    }
    if (isFree) swept_.columns.push_back(axis_.name + ".elevation");
    for (int i = 0; i < axis_.count; ++i) {
      const auto start = drawStart(scenario, *axis_.cone, streamOf(i));
      if (!start) refuse("cone: the target is not seen from there; make aim smaller, or distance fit");
      SweptValue value{{std::to_string(i), fmt::format("{}", start->distance),
                        fmt::format("{}", start->bearing), fmt::format("{}", start->aim)},
                       settingsOf(*start)};
      if (isFree) value.cells.push_back(fmt::format("{}", start->elevation));
      swept_.values.push_back(std::move(value));
    }
  }

  const SweepAxis& axis_;
  const AxisContext& context_;
  SweptAxis swept_;
};

}  // namespace

SweptAxis sweptAxis(const SweepAxis& axis, const AxisContext& context) {
  return Expansion(axis, context).expand();
}

}  // namespace depthservo
