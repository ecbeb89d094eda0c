#include "papers/Claims.h"

#include <limits>

#include "text/StrictYaml.h"

namespace depthservo {
namespace {

using detail::StrictMapping;

constexpr double kAnyNumber = std::numeric_limits<double>::max();
const std::vector<std::string> kRowKeys = {"claim", "paper", "expected", "unit", "within",
                                           "note",  "holds", "full",     "only"};

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
    claim.expected = row.number("expected", {-kAnyNumber, kAnyNumber}, "");
  }
}

}  // namespace

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
      const auto [key, why] = claim.fault();
      if (!key.empty()) row.fail(key, why);
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

std::vector<JudgedClaim> judge(const Claims& claims, const Measurements& measured) {
  std::vector<JudgedClaim> rows;
  for (const Claim& claim : claims.all) {
    rows.push_back(judge(claim, measured, claims.paper.name + "/"));
  }
  return rows;
}

}  // namespace depthservo
