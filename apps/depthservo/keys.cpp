#include <fmt/core.h>

#include <memory>

#include "commands.h"
#include "depthservo/experiments/Sweep.h"
#include "depthservo/scenario/keyPages.h"
#include "observation.h"

namespace depthservo {
namespace {

struct KeyArguments {
  std::string prefix;
  bool replay = false, errors = false, robot = false, sweep = false, markdown = false,
       schema = false;
};

void printSweepKeys(const KeyArguments& a) {
  if (a.replay || a.errors || a.robot) refuseOption("--sweep", "is for another file");
  if ((a.markdown || a.schema) && !a.prefix.empty()) refuseOption("PREFIX", "all keys are printed");
  fmt::print("{}", a.schema     ? sweepSchema()
                   : a.markdown ? sweepKeysAsMarkdown()
                                : sweepKeysAsText(a.prefix));
}

void printKeys(const KeyArguments& a) {
  if (a.sweep) return printSweepKeys(a);
  if (a.schema) {
    if (a.replay || a.errors || a.robot || a.markdown)
      refuseOption("--schema", "is for scenarios and sweeps");
    fmt::print("{}", scenarioSchema());
    return;
  }
  if (a.markdown && !a.prefix.empty()) refuseOption("--markdown", "prints all keys");
  if (a.replay && a.errors) refuseOption("--errors", "is for another file than --replay");
  if (a.robot && (a.replay || a.errors)) refuseOption("--robot", "is for another file");
  const KeySet set = a.replay   ? KeySet::replay
                     : a.errors ? KeySet::errors
                     : a.robot  ? KeySet::robot
                                : KeySet::scenario;
  fmt::print("{}", a.markdown ? keysAsMarkdown(set) : keysAsText(set, a.prefix));
}

}  // namespace

void addKeys(CLI::App& app, int&) {
  CLI::App* command =
      app.add_subcommand("keys", "Every key of a scenario: unit, default, range and meaning");
  auto a = std::make_shared<KeyArguments>();
  command->add_option("PREFIX", a->prefix, "Only keys that begin like this, e.g. depth");
  command->add_flag("--replay", a->replay, "Keys of 'replay' in sequence.yaml instead");
  command->add_flag("--errors", a->errors, "Keys of a file for --errors instead, as in `typical`");
  command->add_flag("--robot", a->robot, "Keys of a file for servo --robot instead");
  command->add_flag("--sweep", a->sweep, "Keys of a sweep file instead");
  command->add_flag("--markdown", a->markdown, "As the table in doc/formats.md");
  command->add_flag("--schema", a->schema, "As a JSON schema for editors");
  command->callback([a] { printKeys(*a); });
}

}  // namespace depthservo
