#include "experiments/Claim.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>

#include "text/TextFile.h"

namespace depthservo {
namespace {

constexpr double kAnything = std::numeric_limits<double>::max();
constexpr const char* kFactor = "factor ";
constexpr const char* kAtMost = "at most ";

bool startsWith(const std::string& text, const char* start) { return text.rfind(start, 0) == 0; }

/// The number in a tolerance.
std::optional<double> sizeOf(const std::string& within) {
  std::string digits = within;
  for (const char* start : {kFactor, kAtMost}) {
    if (startsWith(within, start)) digits = within.substr(std::strlen(start));
  }
  const std::size_t end = digits.size() < 2 ? 0 : digits.size() - 2;
  if (digits == within && digits.compare(end, 2, " %") == 0) digits.resize(end);
  return detail::toNumber(digits);
}

/// "< 5" or ">= experiment/figure".
struct Relation {
  std::string sign, operand;

  explicit Relation(const std::string& text)
      : sign(text.substr(0, text.find(' '))), operand(text.substr(text.find(' ') + 1)) {}
  bool holds(double ours, double limit) const {
    return sign == "<"    ? ours < limit
           : sign == "<=" ? ours <= limit
           : sign == ">"  ? ours > limit
                          : ours >= limit;
  }
};

/// Whether the paper's claim holds.
bool holds(const Claim& claim, double ours, const Measurements& measured) {
  if (claim.holds == "no") return false;
  const Relation rule(claim.holds);
  const auto* other = measured.find(rule.operand);
  const auto limit = other ? other->value : detail::toNumber(rule.operand);
  return limit && rule.holds(ours, *limit);
}

}  // namespace

void Measurements::add(const std::string& id, double value, std::string note) {
  if (!values_.emplace(id, Value{value, std::move(note)}).second) {
    throw std::logic_error(id + " was measured twice");
  }
}

const Measurements::Value* Measurements::find(const std::string& id) const {
  const auto found = values_.find(id);
  return found == values_.end() ? nullptr : &found->second;
}

std::pair<double, double> Claim::accepted() const {
  const double size = *sizeOf(within);
  if (startsWith(within, kAtMost)) return {-kAnything, size};
  if (startsWith(within, kFactor)) return {expected / size, expected * size};
  const double slack = within.back() == '%' ? 0.01 * size * std::abs(expected) : size;
  return {expected - slack, expected + slack};
}

std::string Claim::tolerance() const {
  if (within == "0") return "exact";
  const bool isInUnit = within.back() != '%' && !startsWith(within, kFactor);
  return isInUnit && unit != "1" && !unit.empty() ? within + " " + unit : within;
}

std::pair<std::string, std::string> Claim::fault() const {
  const auto size = sizeOf(within);
  if (!size || *size < 0) {
    return {"within", "expected '2 %', '0.1', 'factor 1.5' or 'at most 3', got " + within};
  }
  const Relation rule(holds);
  const bool isRule =
      rule.sign == "<" || rule.sign == "<=" || rule.sign == ">" || rule.sign == ">=";
  const bool hasOperand =
      detail::toNumber(rule.operand) || rule.operand.find('/') != std::string::npos;
  if (holds.empty() || holds == "no" || (isRule && hasOperand)) return {};
  return {"holds", "expected 'no', '>= 5' or '>= experiment/figure', got " + holds};
}

JudgedClaim judge(const Claim& claim, const Measurements& measured, const std::string& prefix) {
  const auto* value = measured.find(claim.id);
  const auto [low, high] = claim.accepted();
  JudgedClaim row;
  row.id = prefix + claim.id;
  row.claim = claim.text;
  row.paper = claim.paper;
  row.expected = claim.expected;
  row.ours = value && std::isfinite(value->value) ? value->value : kAnything;
  row.unit = claim.unit;
  row.tolerance = claim.tolerance();
  row.pass = value && row.ours >= low && row.ours <= high;
  row.reproduces = claim.holds.empty() ? row.pass : value && holds(claim, row.ours, measured);
  row.note = !value ? "not measured" : value->note.empty() ? claim.note : value->note;
  return row;
}

}  // namespace depthservo
