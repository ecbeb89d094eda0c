#include "scenario/overrides.h"

#include <algorithm>

#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

using detail::YamlValue;

void markOption(YamlValue& value, const std::string& option) {
  value.option = option;
  for (YamlValue& item : value.items) markOption(item, option);
  for (auto& entry : value.entries) markOption(entry.value, option);
}

/// The mapping that the last key of the path belongs to, made where it is missing; `path` is left
/// with that key.
YamlValue& mappingOf(std::string& path, YamlValue& root, const std::string& file,
                     const std::string& option) {
  YamlValue* mapping = &root;
  for (std::size_t dot; (dot = path.find('.')) != std::string::npos; path.erase(0, dot + 1)) {
    const std::string key = path.substr(0, dot);
    YamlValue* below = mapping->find(key);
    if (!below) {
      YamlValue empty;
      empty.kind = YamlValue::Kind::mapping;
      markOption(empty, option);
      mapping->entries.push_back({key, 0, std::move(empty)});
      below = &mapping->entries.back().value;
    }
    if (below->kind != YamlValue::Kind::mapping) {
      throw InputError({file, 0, option},
                       "'" + key + "' is not a mapping; set '" + key + "' as a whole");
    }
    mapping = below;
  }
  return *mapping;
}

}  // namespace

void applyOverride(YamlValue& root, const std::string& file, const std::string& setting,
                   const std::vector<std::string>& keys) {
  const std::string option = "--set " + setting;
  const auto refuse = [&](const std::string& why) { throw InputError({file, 0, option}, why); };
  detail::checkText(option, "--set", {4096, 4096});
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) refuse("expected key.path=value");
  std::string path = setting.substr(0, equals);
  if (std::find(keys.begin(), keys.end(), path) == keys.end()) {
    refuse("unknown key; the nearest valid key is '" + nearestWord(path, keys) + "'");
  }
  YamlValue value;
  try {
    value = detail::parseYaml(setting.substr(equals + 1), option);
  } catch (const InputError& e) {
    refuse(e.message());
  }
  const bool remove = value.kind == YamlValue::Kind::null;
  if (remove && setting.substr(equals + 1) != "null" && setting.substr(equals + 1) != "~") {
    refuse("no value after '='; write null to remove the key");
  }
  markOption(value, option);

  YamlValue& mapping = mappingOf(path, root, file, option);
  auto& entries = mapping.entries;
  if (YamlValue* existing = mapping.find(path); existing && !remove) {
    *existing = std::move(value);
  } else if (!remove) {
    entries.push_back({path, 0, std::move(value)});
  } else {
    entries.erase(std::remove_if(entries.begin(), entries.end(),
                                 [&](const auto& entry) { return entry.key == path; }),
                  entries.end());
  }
}

}  // namespace depthservo
