#include "depthservo/papers/Reproduce.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <future>
#include <memory>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/text/NewFolder.h"
#include "observation.h"

namespace depthservo {
namespace {

struct ReproduceArguments {
  std::string paper, out;
  ReproduceOptions options;
  bool json = false;
};

std::vector<std::string> names() {
  std::vector<std::string> names = paperNames();
  names.push_back("all");
  return names;
}

std::vector<Paper> papersNamed(const std::string& name) {
  std::vector<Paper> chosen;
  for (const Paper& paper : papers()) {
    if (name == paper.name || name == "all") chosen.push_back(paper);
  }
  if (chosen.empty()) refuseWord("reproduce", name, names());
  return chosen;
}

void printTable(const std::vector<JudgedClaim>& rows) {
  fmt::print("{:4} {:<44} {:>12} {:>12} {:<8} {:<12} {}\n", "", "figure", "expected", "ours",
             "unit", "within", "claim");
  for (const JudgedClaim& row : rows) {
    fmt::print("{:4} {:<44} {:>12.6g} {:>12.6g} {:<8} {:<12} {}\n", row.pass ? "ok" : "FAIL",
               row.id, row.expected, row.ours, row.unit, row.tolerance, row.claim);
    if (!row.reproduces) fmt::print("     does not reproduce: {}\n", row.note);
  }
}

int reproduce(const ReproduceArguments& arguments) {
  const std::vector<Paper> chosen = papersNamed(arguments.paper);
  if (!arguments.out.empty()) requireNewRunFolder(arguments.out);
  std::vector<std::future<Reproduction>> running;
  for (const Paper& paper : chosen) {
    running.push_back(std::async(std::launch::async, depthservo::reproduce, paper.name,
                                 std::cref(arguments.options)));
  }
  std::vector<ReproducedPaper> reproduced;
  std::vector<JudgedClaim> rows;
  for (const Paper& paper : chosen) {
    ProgressBar bar(fmt::format("reproduce {}", paper.name));
    bar.show(static_cast<double>(reproduced.size()) / static_cast<double>(chosen.size()));
    reproduced.push_back({paper, running[reproduced.size()].get()});
    const auto& more = reproduced.back().result.rows;
    rows.insert(rows.end(), more.begin(), more.end());
  }
  if (!arguments.out.empty()) {
    if (!writeReproduction(arguments.paper, reproduced, arguments.out)) {
      fmt::print(stderr, "note: figures were not drawn; they need gnuplot\n");
    }
    fmt::print(stderr, "report: {}/report.html\n", arguments.out);
  }
  arguments.json ? fmt::print("{}\n", toJson(rows)) : printTable(rows);
  const ReproductionCount count(rows);
  fmt::print(stderr, "{}\n", count.text());
  return count.agreeing == count.rows ? kMet : kNotMet;
}

}  // namespace

void addReproduce(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand(
      "reproduce",
      "Run the simulations of a paper, theirs against ours; exit 1 when a figure is off");
  auto a = std::make_shared<ReproduceArguments>();
  command->add_option("PAPER", a->paper, fmt::format("{}", fmt::join(names(), " | ")))->required();
  command->add_flag("--full", a->options.full, "More seeds and finer searches");
  command->add_flag("--json", a->json, "Print the rows as one JSON array on stdout");
  command
      ->add_option("--out", a->out,
                   "Write a folder with report.html, figures and rows.json; must not exist")
      ->type_name("DIR");
  command->callback([a, &exitCode] { exitCode = reproduce(*a); });
}

}  // namespace depthservo
