#include "numbers.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace depthservo {
namespace {

CLI::Validator number(double low, bool isLowAllowed, double high, const std::string& wanted) {
  const auto check = [=](const std::string& text) -> std::string {
    double value = 0;
    const bool isNumber = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
    const bool isIn = isNumber && (isLowAllowed ? value >= low : value > low) && value <= high;
    return isIn ? std::string() : fmt::format("expected {}, got '{}'", wanted, text);
  };
  return CLI::Validator(std::function<std::string(std::string&)>(check), "");
}

constexpr double kAny = std::numeric_limits<double>::max();

}  // namespace

CLI::Validator within(double low, double high) {
  return number(low, true, high, fmt::format("a number in [{:g}, {:g}]", low, high));
}

CLI::Validator aboveZero() { return number(0, false, kAny, "a number above 0"); }

CLI::Validator zeroOrMore() { return number(0, true, kAny, "a number of 0 or more"); }

}  // namespace depthservo
