#include "depthservo/report/Report.h"

#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <string>

#include "commands.h"
#include "depthservo/experiments/SweepFolder.h"

namespace depthservo {
namespace {

/// The last part of a path that says something.
std::string nameOf(const std::filesystem::path& folder) {
  const auto whole = std::filesystem::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

}  // namespace

void addReport(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "report", "Make report.html of a run or a sweep anew, or one page of two runs side by side");
  struct Arguments {
    std::string run, other, out;
  };
  auto a = std::make_shared<Arguments>();
  command->add_option("RUN_DIR", a->run, "Folder written by run, replay, live, servo or sweep")
      ->required();
  auto* other = command->add_option("OTHER", a->other, "Another run, to be laid beside it");
  command->add_option("--out", a->out, "Page of both; must not exist; default: both names in one")
      ->type_name("FILE")
      ->needs(other);
  command->callback([a] {
    if (a->other.empty()) {
      SweepFolder::isOne(a->run) ? writeSweepReport(a->run, false) : writeReport(a->run);
      a->out = (std::filesystem::path(a->run) / "report.html").string();
    } else {
      if (a->out.empty()) a->out = nameOf(a->run) + "-beside-" + nameOf(a->other) + ".html";
      writeReportOfTwo(a->run, a->other, a->out);
    }
    fmt::print(stderr, "report: {}\n", a->out);
  });
}

}  // namespace depthservo
