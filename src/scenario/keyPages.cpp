#include "depthservo/scenario/keyPages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <regex>

#include "depthservo/text/InputError.h"
#include "scenario/keyTables.h"
#include "scenario/keys.h"

namespace depthservo {
namespace {

using detail::Fields;
using detail::KeyNode;
using Json = nlohmann::ordered_json;
using Type = KeyNode::Type;

constexpr std::size_t kLongestText = 200, kLongestList = 1000;  // as StrictMapping reads them

std::vector<KeyNode> keysOf(KeySet set) {
  if (set == KeySet::replay) {
    ObservationOptions options;
    return detail::allKeys([&](Fields& fields) { describe(fields, options); });
  }
  if (set == KeySet::errors) {
    ErrorProfile profile = ErrorProfile::typical();
    return detail::allKeys([&](Fields& fields) { describe(fields, profile); });
  }
  if (set == KeySet::robot) {
    RobotFile file;
    return detail::allKeys([&](Fields& fields) { describe(fields, file); });
  }
  Scenario scenario;
  return detail::allKeys([&](Fields& fields) { describe(fields, scenario); });
}

// Text -------------------------------------------------------------------------------------------

std::string shortly(const Json& value) {
  if (value.is_number_float()) return fmt::format("{:g}", value.get<double>());
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  std::vector<std::string> items;
  for (const Json& item : value) items.push_back(shortly(item));
  return fmt::format("[{}]", fmt::join(items, ", "));
}

std::string defaultOf(const KeyNode& key) {
  if (*key.need.requiredWhen) return fmt::format("required for {}", key.need.requiredWhen);
  if (key.need.isRequired) return "required";
  if (!key.otherwise.empty()) return key.otherwise;
  if (key.value.is_null() || key.type == Type::section) return "";
  return shortly(key.value);
}

std::string meaningOf(const KeyNode& key) {
  if (!*key.need.allowedWhen) return key.meaning;
  return fmt::format("{} ({} only)", key.meaning, key.need.allowedWhen);
}

std::string rangeOf(const KeyNode& key) {
  const std::string range = key.range.text("");
  switch (key.type) {
    case Type::number:
    case Type::integer:
      return range;
    case Type::flag:
      return "true, false";
    case Type::text:
      return fmt::format("1 to {} characters", kLongestText);
    case Type::texts:
      return "list of words or numbers";
    case Type::word:
      return fmt::format("{}", fmt::join(key.words, ", "));
    case Type::numbers:
      return key.size > 0 ? fmt::format("{} numbers in {}", key.size, range)
                          : "numbers in " + range;
    case Type::oneOrMore:
      return "one or more in " + range;
    case Type::integers:
      return "whole numbers in " + range;
    case Type::rows:
      return fmt::format("lists of {} numbers in {}", key.size, range);
    case Type::section:
      return "";
    case Type::list:
      return "list";
  }
  return "";
}

struct Line {
  std::string key, unit, otherwise, range, meaning;
};

void addLines(const std::vector<KeyNode>& keys, const std::string& prefix,
              std::vector<Line>& lines) {
  for (const KeyNode& key : keys) {
    lines.push_back({prefix + key.name, key.unit, defaultOf(key), rangeOf(key), meaningOf(key)});
    addLines(key.below, prefix + key.name + ".", lines);
  }
}

std::vector<Line> linesOf(const std::vector<KeyNode>& keys) {
  std::vector<Line> lines;
  addLines(keys, "", lines);
  return lines;
}

// Schema -----------------------------------------------------------------------------------------

Json schemaOf(const std::vector<KeyNode>& keys);

Json numberSchema(const KeyNode& key, const char* type) {
  return {{"type", type},
          {key.range.lowIsOpen ? "exclusiveMinimum" : "minimum", key.range.low},
          {"maximum", key.range.high}};
}

Json listSchema(Json items, std::size_t least = 0, std::size_t most = kLongestList) {
  Json schema{{"type", "array"}, {"items", std::move(items)}};
  if (least > 0) schema["minItems"] = least;
  schema["maxItems"] = most;
  return schema;
}

/// YAML takes the word true for a truth value.
Json wordSchema(const KeyNode& key) {
  Json words = key.words;
  if (std::find(key.words.begin(), key.words.end(), "true") != key.words.end()) {
    words.push_back(true);
  }
  return {{"enum", words}};
}

Json mappingsSchema(const KeyNode& key) {
  const Json mapping = schemaOf(key.below);
  if (key.shortForm.empty()) return listSchema(mapping);
  Json values = Json::array();
  for (const std::string& name : key.shortForm) {
    values.push_back(mapping["properties"][name]);
  }
  const Json pair{{"type", "array"},
                  {"items", values},
                  {"minItems", values.size()},
                  {"maxItems", values.size()}};
  return {{"anyOf", {listSchema({{"anyOf", {mapping, pair}}}), mapping}}};
}

Json typeSchema(const KeyNode& key) {
  switch (key.type) {
    case Type::number:
      return numberSchema(key, "number");
    case Type::integer:
      return numberSchema(key, "integer");
    case Type::flag:
      return {{"type", "boolean"}};
    case Type::text:
      return {{"type", "string"}, {"minLength", 1}, {"maxLength", kLongestText}};
    case Type::texts:
      return listSchema({{"type", {"string", "number", "boolean"}}});
    case Type::word:
      return wordSchema(key);
    case Type::numbers:
      return listSchema(numberSchema(key, "number"), key.size, key.size ? key.size : kLongestList);
    case Type::oneOrMore:
      return {{"anyOf", {numberSchema(key, "number"), listSchema(numberSchema(key, "number"), 1)}}};
    case Type::integers:
      return listSchema(numberSchema(key, "integer"));
    case Type::rows:
      return listSchema(listSchema(numberSchema(key, "number"), key.size, key.size));
    case Type::section:
      return schemaOf(key.below);
    case Type::list:
      return mappingsSchema(key);
  }
  return {};
}

Json keySchema(const KeyNode& key) {
  Json schema = typeSchema(key);
  if (key.mayBeNull) schema["type"] = {schema["type"], "null"};
  const std::string unit = key.unit.empty() ? "" : fmt::format(" [{}]", key.unit);
  schema["description"] = meaningOf(key) + unit;
  if (!key.need.isRequired && key.type != Type::section && !key.value.is_null()) {
    schema["default"] = key.value;
  }
  return schema;
}

Json schemaOf(const std::vector<KeyNode>& keys) {
  Json properties = Json::object(), required = Json::array();
  for (const KeyNode& key : keys) {
    properties[key.name] = keySchema(key);
    if (key.need.isRequired && !*key.need.requiredWhen) required.push_back(key.name);
  }
  Json schema{{"type", "object"}, {"properties", properties}};
  if (!required.empty()) schema["required"] = required;
  schema["additionalProperties"] = false;
  return schema;
}

}  // namespace

std::string keysAsText(KeySet set, const std::string& prefix) {
  return detail::keysAsText(keysOf(set), prefix);
}

std::string keysAsMarkdown(KeySet set) { return detail::keysAsMarkdown(keysOf(set)); }

std::string scenarioSchema() {
  return detail::schemaText(keysOf(KeySet::scenario), "depthservo scenario");
}

namespace detail {

std::string keysAsText(const std::vector<KeyNode>& keys, const std::string& prefix) {
  std::vector<Line> lines = linesOf(keys);
  std::vector<std::string> all;
  for (const Line& line : lines) all.push_back(line.key);
  lines.erase(std::remove_if(lines.begin(), lines.end(),
                             [&](const Line& line) { return line.key.rfind(prefix, 0) != 0; }),
              lines.end());
  if (lines.empty()) {
    throw InputError({"keys", 0, prefix},
                     "no key begins like this; the nearest is '" + nearestWord(prefix, all) + "'");
  }
  Line widest{"", "", "", "", ""};
  for (const Line& line : lines) {
    for (const auto member : {&Line::key, &Line::unit, &Line::otherwise, &Line::range}) {
      if ((line.*member).size() > (widest.*member).size()) widest.*member = line.*member;
    }
  }
  std::string text;
  for (const Line& line : lines) {
    text += fmt::format("{:<{}}  {:<{}}  {:<{}}  {:<{}}  {}\n", line.key, widest.key.size(),
                        line.unit, widest.unit.size(), line.otherwise, widest.otherwise.size(),
                        line.range, widest.range.size(), line.meaning);
  }
  return text;
}

std::string keysAsMarkdown(const std::vector<KeyNode>& keys) {
  static const std::regex page("doc/([a-z-]+\\.md)");
  std::string text = "| key | unit | default | range | meaning |\n|---|---|---|---|---|\n";
  for (const Line& line : linesOf(keys)) {
    const bool isRequired = line.otherwise.rfind("required", 0) == 0;
    const std::string otherwise =
        isRequired ? "*required*" + line.otherwise.substr(std::string("required").size())
                   : line.otherwise;
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n", line.key, line.unit, otherwise,
                        line.range, std::regex_replace(line.meaning, page, "[$1]($1)"));
  }
  return text;
}

std::string schemaText(const std::vector<KeyNode>& keys, const char* title) {
  Json schema{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  schema.update(schemaOf(keys));
  return schema.dump(1) + "\n";
}

}  // namespace detail

}  // namespace depthservo
