#include "scenario/FieldReader.h"

#include <algorithm>
#include <string>

#include "text/KeyTree.h"

namespace depthservo::detail {
namespace {

std::vector<std::string> keysOf(const Fields::Describe& describe) {
  std::vector<std::string> keys;
  for (const KeyNode& node : keyTree(describe)) keys.push_back(node.name);
  return keys;
}

/// [1, 2] as {from: 1, to: 2}.
YamlValue expanded(const YamlValue& value, const std::vector<std::string>& shortForm) {
  if (shortForm.empty() || value.kind != YamlValue::Kind::list ||
      value.items.size() != shortForm.size()) {
    return value;
  }
  YamlValue mapping;
  mapping.kind = YamlValue::Kind::mapping;
  mapping.line = value.line;
  mapping.option = value.option;
  for (std::size_t i = 0; i < shortForm.size(); ++i) {
    mapping.entries.push_back({shortForm[i], value.line, value.items[i]});
  }
  return mapping;
}

}  // namespace

FieldReader::FieldReader(const YamlValue& value, const std::string& file, const std::string& path,
                         const Describe& describe)
    : mapping_(value, file, path, keysOf(describe)) {
  describe(*this);
}

bool FieldReader::reads(const Key& key) const {
  if (key.need.isRequired) mapping_.value(key.name);
  if (!mapping_.has(key.name)) return false;
  if (!key.need.isAllowed) {
    mapping_.fail(key.name, std::string("is for ") + key.need.allowedWhen + " only; remove it");
  }
  return true;
}

bool FieldReader::isSet(const Key& key) const {
  return reads(key) && mapping_.value(key.name).kind != YamlValue::Kind::null;
}

void FieldReader::number(const Key& key, double& value, const Range& range, const char* unit) {
  if (reads(key)) value = mapping_.number(key.name, range, unit);
}

void FieldReader::number(const Key& key, std::optional<double>& value, const Range& range,
                         const char* unit) {
  if (isSet(key)) value = mapping_.number(key.name, range, unit);
}

void FieldReader::integerOf(const Key& key, long long& value, const Range& range,
                            const char* unit) {
  if (reads(key)) value = mapping_.integer(key.name, range, unit);
}

void FieldReader::flag(const Key& key, bool& value) {
  if (reads(key)) value = mapping_.flag(key.name);
}

void FieldReader::text(const Key& key, std::string& value) {
  if (reads(key)) value = mapping_.text(key.name);
}

void FieldReader::texts(const Key& key, std::vector<std::string>& value) {
  if (reads(key)) value = mapping_.texts(key.name);
}

void FieldReader::numbersOf(const Key& key, std::size_t size, std::optional<Numbers>& value,
                            const Range& range, const char* unit) {
  if (value ? reads(key) : isSet(key)) value = mapping_.numbers(key.name, size, range, unit);
}

void FieldReader::oneOrMore(const Key& key, std::vector<double>& value, const Range& range,
                            const char* unit) {
  if (!reads(key)) return;
  const bool isList = mapping_.value(key.name).kind == YamlValue::Kind::list;
  value = isList ? mapping_.numbers(key.name, 0, range, unit)
                 : std::vector<double>{mapping_.number(key.name, range, unit)};
  if (value.empty()) refuse(key, "expected a number or a list of numbers, got []");
}

void FieldReader::integers(const Key& key, std::vector<int>& value, const Range& range) {
  if (!reads(key)) return;
  value.clear();
  for (const double number : mapping_.numbers(key.name, 0, range, "")) {
    if (number != static_cast<int>(number)) refuse(key, "expected whole numbers");
    value.push_back(static_cast<int>(number));
  }
}

void FieldReader::rowsOf(const Key& key, std::size_t width, Rows& value, const Range& range,
                         const char* unit) {
  if (reads(key)) value = mapping_.rows(key.name, width, range, unit);
}

void FieldReader::word(const Key& key, std::size_t& index, const std::vector<std::string>& words) {
  if (!reads(key)) return;
  const std::string text = mapping_.text(key.name);
  const auto found = std::find(words.begin(), words.end(), text);
  if (found == words.end()) refuse(key, unknownWord(text, words));
  index = static_cast<std::size_t>(found - words.begin());
}

void FieldReader::section(const Key& key, const Describe& describe) {
  if (!reads(key)) return;
  FieldReader(mapping_.value(key.name), mapping_.file(), mapping_.pathOf(key.name), describe);
}

void FieldReader::optionalSection(const Key& key, bool, const std::function<void()>& create,
                                  const Describe& describe) {
  if (!isSet(key)) return;
  create();
  section(key, describe);
}

void FieldReader::listOf(const Key& key, const std::vector<std::string>& shortForm, std::size_t,
                         const std::function<void(std::size_t)>& resize,
                         const std::function<void(Fields&, std::size_t)>& describe) {
  if (!reads(key)) return;
  const bool isAlone =
      !shortForm.empty() && mapping_.value(key.name).kind == YamlValue::Kind::mapping;
  const std::vector<YamlValue> items =
      isAlone ? std::vector{mapping_.value(key.name)} : mapping_.list(key.name).items;
  resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    FieldReader(expanded(items[i], shortForm), mapping_.file(), mapping_.pathOf(key.name),
                [&](Fields& fields) { describe(fields, i); });
  }
}

void FieldReader::refuse(const Key& key, const std::string& message) const {
  mapping_.fail(key.name, message);
}

}  // namespace depthservo::detail
