#include "depthservo/scenario/Scenario.h"

#include "depthservo/text/InputError.h"
#include "scenario/FieldReader.h"
#include "scenario/checks.h"
#include "scenario/keys.h"
#include "scenario/overrides.h"
#include "text/KeyTree.h"

namespace depthservo {
namespace {

using detail::Fields;
using detail::KeyNode;
using detail::YamlValue;

/// The configuration in the run.json of a run folder, which is a scenario; any other file as it is.
YamlValue configurationIn(YamlValue root, const std::string& file) {
  const YamlValue* command = root.find("command");
  YamlValue* configuration = root.find("configuration");
  if (!command || !configuration) return root;
  if (command->scalar != "run") {
    throw InputError({file, 0, "configuration"},
                     "is that of a " + command->scalar + ", not of a run: no scenario");
  }
  return std::move(*configuration);
}

/// Refuses at the deepest mapping of the path that exists.
Refuse refuseIn(const YamlValue& root, const std::string& file) {
  return [&root, file](const std::string& path, const std::string& message) {
    const YamlValue* at = &root;
    std::string rest = path + ".";
    for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest.erase(0, dot + 1)) {
      const YamlValue* below = at->find(rest.substr(0, dot));
      if (!below) break;
      at = below;
    }
    if (at->option.empty()) throw InputError({file, at->line, path}, message);
    throw InputError({file, 0, at->option}, path + ": " + message);
  };
}

void listPaths(const std::vector<KeyNode>& nodes, const std::string& prefix,
               std::vector<std::string>& paths) {
  for (const KeyNode& node : nodes) {
    paths.push_back(prefix + node.name);
    listPaths(node.below, prefix + node.name + ".", paths);
  }
}

}  // namespace

struct ScenarioText::Parts {
  YamlValue root;
  std::string file;
  std::vector<std::string> keys = Scenario::keys();
};

ScenarioText::ScenarioText(const std::string& text, std::string file) {
  YamlValue root = configurationIn(detail::parseYaml(text, file), file);
  parts_ = std::make_unique<Parts>(Parts{std::move(root), std::move(file)});
}

ScenarioText::~ScenarioText() = default;
ScenarioText::ScenarioText(ScenarioText&&) noexcept = default;
ScenarioText& ScenarioText::operator=(ScenarioText&&) noexcept = default;

Scenario ScenarioText::with(const std::vector<std::string>& overrides) const {
  const std::string& path = parts_->file;
  YamlValue root = parts_->root;
  for (const std::string& setting : overrides) applyOverride(root, path, setting, parts_->keys);
  Scenario scenario;
  scenario.file = path;
  detail::FieldReader(root, path, "", [&](Fields& fields) { describe(fields, scenario); });
  if (scenario.target.points.empty()) scenario.target.points = scenario.target.ownPoints();
  checkTogether(scenario, refuseIn(root, path));
  return scenario;
}

Scenario Scenario::load(const std::string& path, const std::vector<std::string>& overrides) {
  return ScenarioText(detail::readYamlText(path), path).with(overrides);
}

std::string Scenario::toJson() const {
  Scenario copy = *this;
  return detail::toJson(detail::keyTree([&](Fields& fields) { describe(fields, copy); })).dump();
}

std::vector<std::string> Scenario::keys() {
  Scenario all;
  std::vector<std::string> paths;
  listPaths(detail::allKeys([&](Fields& fields) { describe(fields, all); }), "", paths);
  return paths;
}

}  // namespace depthservo
