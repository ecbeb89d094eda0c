#include "depthservo/scenario/observationOf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "scenario/FieldReader.h"
#include "scenario/keys.h"
#include "text/KeyTree.h"

namespace depthservo {
namespace {

using detail::Fields;
using Json = nlohmann::ordered_json;

/// In one line.
std::string yamlOf(const Json& value) {
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_structured()) return value.dump();
  std::vector<std::string> items;
  for (const auto& [key, item] : value.items()) {
    items.push_back(value.is_object() ? key + ": " + yamlOf(item) : yamlOf(item));
  }
  const std::string joined = fmt::format("{}", fmt::join(items, ", "));
  return value.is_object() ? "{" + joined + "}" : "[" + joined + "]";
}

/// The rooms' names of keys that stand at the top here.
std::string keyOf(const std::string& key) {
  const std::string gains = "gains.";
  return "replay." + (key.rfind(gains, 0) == 0 ? key.substr(gains.size()) : key);
}

}  // namespace

ObservationOptions observationOf(const ReplaySection& section) {
  ObservationOptions options;
  if (!section.value) return options;
  const detail::YamlValue& value = *section.value;
  detail::FieldReader(value, section.file, "replay",
                      [&](Fields& fields) { describe(fields, options); });
  check(options.depth, [&](const std::string& key, const std::string& message) {
    const std::string path = keyOf(key);
    const detail::YamlValue* at = value.find(path.substr(path.find('.') + 1));
    throw InputError({section.file, at ? at->line : value.line, path}, message);
  });
  return options;
}

ErrorProfile readErrorProfile(const std::string& file) {
  ErrorProfile profile;
  detail::FieldReader(detail::loadYaml(file), file, "",
                      [&](Fields& fields) { describe(fields, profile); });
  return profile;
}

ObservationOptions observationOf(const Sequence& sequence) {
  return observationOf(sequence.replaySection());
}

std::string replayYaml(const ObservationOptions& options) {
  ObservationOptions copy = options;
  const Json json = detail::toJson(detail::keyTree([&](Fields& f) { describe(f, copy); }));
  std::string text;
  for (const auto& [key, value] : json.items()) {
    if (!value.is_null()) text += fmt::format("{}: {}\n", key, yamlOf(value));
  }
  return text;
}

}  // namespace depthservo
