#include "papers/Claims.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>

#include "text/StrictYaml.h"

namespace depthservo {
namespace {

using detail::StrictMapping;

constexpr double kAnything = std::numeric_limits<double>::max();
constexpr const char* kFactor = "factor ";
constexpr const char* kAtMost = "at most ";
const std::vector<std::string> kRowKeys = {"claim", "paper", "expected", "unit", "within",
                                           "note",  "holds", "full",     "only"};

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

/// Refuses what could not be judged.
void check(const StrictMapping& row, const Claim& claim) {
  const auto size = sizeOf(claim.within);
  if (!size || *size < 0) {
    row.fail("within", "expected '2 %', '0.1', 'factor 1.5' or 'at most 3', got " + claim.within);
  }
  const Relation rule(claim.holds);
  const bool isRule =
      rule.sign == "<" || rule.sign == "<=" || rule.sign == ">" || rule.sign == ">=";
  const bool hasOperand =
      detail::toNumber(rule.operand) || rule.operand.find('/') != std::string::npos;
  if (claim.holds.empty() || claim.holds == "no" || (isRule && hasOperand)) return;
  row.fail("holds", "expected 'no', '>= 5' or '>= experiment/figure', got " + claim.holds);
}

/// What a mapping says over what was said before: by its experiment, by the quick reproduction.
void take(const StrictMapping& row, Claim& claim) {
  const std::pair<const char*, std::string*> texts[] = {
      {"claim", &claim.text},    {"paper", &claim.paper}, {"unit", &claim.unit},
      {"within", &claim.within}, {"note", &claim.note},   {"holds", &claim.holds}};
  for (const auto& [key, text] : texts) {
    if (!row.has(key)) continue;
    const detail::YamlValue& value = row.value(key);
    const bool isEmpty = value.isString && value.scalar.empty();  // a figure without a unit
    *text = isEmpty ? "" : row.text(key);
  }
  if (!row.has("expected")) return;
  if (row.text("expected") == "yes") {
    claim.expected = 1;
    claim.unit = "yes = 1";
    claim.within = "0";
  } else {
    claim.expected = row.number("expected", {-kAnything, kAnything}, "");
  }
}

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

Claims readClaims(const std::string& yaml, const std::string& paper, bool full) {
  const std::string file = paper + ".yaml";
  const detail::YamlValue root = detail::parseYaml(yaml, file);
  const StrictMapping top(root, file, "", {"citation", "experiments", "figures"});
  Claims claims{{paper, top.text("citation"), {}}, {}, {}};
  for (const auto& experiment : top.value("experiments").entries) {
    const StrictMapping about(experiment.value, file, experiment.key,
                              {"title", "unit", "within", "rows"});
    claims.paper.experiments.emplace_back(experiment.key, about.text("title"));
    for (const auto& entry : about.value("rows").entries) {
      const StrictMapping row(entry.value, file, experiment.key + "/" + entry.key, kRowKeys);
      if (row.has("only") && !full) continue;
      Claim claim;
      claim.id = experiment.key + "/" + entry.key;
      take(about, claim);
      take(row, claim);
      if (full && row.has("full")) take(row.mapping("full", kRowKeys), claim);
      row.value("claim");
      row.value("expected");
      check(row, claim);
      claims.all.push_back(std::move(claim));
    }
  }
  if (!top.has("figures")) return claims;
  for (const auto& entry : top.value("figures").entries) {
    const StrictMapping figure(entry.value, file, entry.key, {"title", "caption"});
    claims.figures[entry.key] = {figure.text("title"), figure.value("caption").scalar};
  }
  return claims;
}

void describe(std::vector<Figure>& figures, const Claims& claims) {
  for (Figure& figure : figures) {
    const Claims::Words& words = claims.figures.at(figure.name);
    figure.title = words.title;
    figure.caption = words.caption;
  }
}

std::vector<ReproduceRow> judge(const Claims& claims, const Measurements& measured) {
  std::vector<ReproduceRow> rows;
  for (const Claim& claim : claims.all) {
    const auto* value = measured.find(claim.id);
    const auto [low, high] = claim.accepted();
    ReproduceRow row;
    row.id = claims.paper.name + "/" + claim.id;
    row.claim = claim.text;
    row.paper = claim.paper;
    row.expected = claim.expected;
    row.ours = value && std::isfinite(value->value) ? value->value : kAnything;
    row.unit = claim.unit;
    row.tolerance = claim.tolerance();
    row.pass = value && row.ours >= low && row.ours <= high;
    row.reproduces = claim.holds.empty() ? row.pass : value && holds(claim, row.ours, measured);
    row.note = !value ? "not measured" : value->note.empty() ? claim.note : value->note;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace depthservo
