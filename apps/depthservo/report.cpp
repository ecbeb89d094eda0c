#include "depthservo/report/Report.h"

#include <fmt/core.h>

#include "commands.h"

namespace depthservo {

void addReport(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("report", "Make report.html of a run folder anew");
  auto folder = std::make_shared<std::string>();
  command->add_option("RUN_DIR", *folder, "Folder written by run, replay or live")->required();
  command->callback([folder] {
    writeReport(*folder);
    fmt::print(stderr, "report: {}/report.html\n", *folder);
  });
}

}  // namespace depthservo
