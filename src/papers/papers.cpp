#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "depthservo/papers/Reproduce.h"
#include "papers/EmbeddedPapers.h"
#include "papers/runPapers.h"

namespace depthservo {
namespace {

struct Source {
  std::string_view claims;  ///< YAML
  Experiments (*run)(const ReproduceOptions&);
};

const std::map<std::string, Source>& sources() {
  static const std::map<std::string, Source> all = {
      {"deluca2008", {embeddedPapers().deluca2008, runDeLuca2008}},
      {"durand2010", {embeddedPapers().durand2010, runDurand2010}},
      {"ibuki2023", {embeddedPapers().ibuki2023, runIbuki2023}}};
  return all;
}

}  // namespace

Claims claimsOf(const std::string& paper, bool full) {
  return readClaims(std::string(sources().at(paper).claims), paper, full);
}

std::vector<std::string> paperNames() {
  std::vector<std::string> names;
  for (const auto& [name, source] : sources()) names.push_back(name);
  return names;
}

const std::vector<Paper>& papers() {
  static const std::vector<Paper> all = [] {
    std::vector<Paper> read;
    for (const std::string& name : paperNames()) read.push_back(claimsOf(name).paper);
    return read;
  }();
  return all;
}

Reproduction reproduce(const std::string& name, const ReproduceOptions& options) {
  const Claims claims = claimsOf(name, options.full);
  Experiments experiments = sources().at(name).run(options);
  describe(experiments.figures, claims);
  return {judge(claims, experiments.measured), std::move(experiments.figures)};
}

ReproductionCount::ReproductionCount(const std::vector<JudgedClaim>& all) : rows(all.size()) {
  for (const JudgedClaim& row : all) {
    agreeing += row.pass;
    printed += !row.paper.empty();
    met += !row.paper.empty() && row.reproduces;
  }
}

std::string ReproductionCount::text() const {
  const double share =
      rows == 0 ? 0 : 100. * static_cast<double>(printed) / static_cast<double>(rows);
  return fmt::format(
      "{} of the {} claims that the papers print hold, {:.0f} % of all rows; {} of {} rows agree "
      "with "
      "our own independent computation, each within its tolerance",
      met, printed, share, agreeing, rows);
}

std::string toJson(const std::vector<JudgedClaim>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const JudgedClaim& row : rows) {
    json.push_back({{"id", row.id},
                    {"claim", row.claim},
                    {"paper", row.paper},
                    {"expected", row.expected},
                    {"ours", row.ours},
                    {"unit", row.unit},
                    {"tolerance", row.tolerance},
                    {"pass", row.pass},
                    {"reproduces", row.reproduces},
                    {"note", row.note}});
  }
  return json.dump(2);
}

}  // namespace depthservo
