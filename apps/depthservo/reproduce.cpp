#include "depthservo/servo/Reproduce.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "depthservo/sequence/InputError.h"

namespace depthservo {
namespace {

struct Paper {
  const char* name;
  Reproduction (*reproduce)(const ReproduceOptions&);
};
constexpr Paper kPapers[] = {{"deluca2008", reproduceDeLuca2008},
                             {"durand2010", reproduceDurand2010},
                             {"ibuki2023", reproduceIbuki2023}};

std::vector<ReproduceRow> rowsOf(const std::string& name, const ReproduceOptions& options) {
  std::vector<ReproduceRow> rows;
  for (const Paper& paper : kPapers) {
    if (name != paper.name && name != "all") continue;
    const auto more = paper.reproduce(options).rows;
    rows.insert(rows.end(), more.begin(), more.end());
  }
  if (rows.empty()) {
    throw InputError(
        {"reproduce", 0, ""},
        fmt::format("'{}' is not in this version; use deluca2008, durand2010, ibuki2023 or all",
                    name));
  }
  return rows;
}

void printTable(const std::vector<ReproduceRow>& rows) {
  for (const ReproduceRow& row : rows) {
    fmt::print("{:4} {:<44} {:>12.6g} {:>12.6g} {:<6} {}\n", row.pass ? "ok" : "FAIL", row.id,
               row.expected, row.ours, row.unit, row.claim);
    if (!row.reproduces) fmt::print("     does not reproduce: {}\n", row.note);
  }
}

void printJson(const std::vector<ReproduceRow>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const ReproduceRow& row : rows) {
    json.push_back({{"id", row.id},
                    {"claim", row.claim},
                    {"paper", row.paper},
                    {"expected", row.expected},
                    {"ours", row.ours},
                    {"unit", row.unit},
                    {"pass", row.pass},
                    {"reproduces", row.reproduces},
                    {"note", row.note}});
  }
  fmt::print("{}\n", json.dump(2));
}

}  // namespace

void addReproduce(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand(
      "reproduce",
      "Run the simulations of a paper, theirs against ours; exit 1 when a figure is off");
  auto paper = std::make_shared<std::string>();
  auto options = std::make_shared<ReproduceOptions>();
  auto json = std::make_shared<bool>(false);
  command->add_option("PAPER", *paper, "deluca2008 | durand2010 | ibuki2023 | all")->required();
  command->add_flag("--full", options->full, "More seeds and finer searches");
  command->add_flag("--json", *json, "Print the rows as one JSON array on stdout");
  command->callback([=, &exitCode] {
    const auto rows = rowsOf(*paper, *options);
    *json ? printJson(rows) : printTable(rows);
    const auto passed =
        std::count_if(rows.begin(), rows.end(), [](const auto& r) { return r.pass; });
    fmt::print(stderr, "{} of {} figures agree\n", passed, rows.size());
    exitCode = passed == static_cast<std::ptrdiff_t>(rows.size()) ? kMet : kNotMet;
  });
}

}  // namespace depthservo
