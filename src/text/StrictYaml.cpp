#include "text/StrictYaml.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>
#include <utility>

namespace depthservo::detail {
namespace {

constexpr TextLimits kYamlLimits{std::size_t{256} << 10, std::size_t{64} << 10};
constexpr std::size_t kDeepest = 12;
constexpr std::size_t kMostValues = 10000;

/// Builds a tree of bounded size from the events of yaml-cpp's parser. (YAML::LoadAll never returns
/// on some broken texts and keeps one of two equal keys.)
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::string& file) : file_(file) {}

  YamlValue take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { add(mark, {}); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "YAML aliases (*name) are not supported; write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& text) override {
    if (isKeyNext()) return beginEntry(mark, text);
    YamlValue value;
    value.kind = YamlValue::Kind::scalar;
    value.scalar = text;
    value.isString = tag == "!" || tag == "tag:yaml.org,2002:str";
    add(mark, std::move(value));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open(mark, YamlValue::Kind::list);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    open(mark, YamlValue::Kind::mapping);
  }
  void OnMapEnd() override { close(); }

 private:
  struct Level {
    YamlValue container;
    std::string key;  // of the entry whose value comes next
    int keyLine = 0;  // 0: a key comes next
  };

  [[noreturn]] void refuse(const YAML::Mark& mark, const std::string& message) const {
    throw InputError({file_, mark.line + 1, ""}, message);
  }
  bool isKeyNext() const {
    return !levels_.empty() && levels_.back().container.kind == YamlValue::Kind::mapping &&
           levels_.back().keyLine == 0;
  }
  void beginEntry(const YAML::Mark& mark, const std::string& key) {
    Level& level = levels_.back();
    for (const auto& entry : level.container.entries) {
      if (entry.key != key) continue;
      throw InputError({file_, mark.line + 1, key},
                       fmt::format("appears twice, first in line {}; remove one", entry.line));
    }
    level.key = key;
    level.keyLine = mark.line + 1;
  }
  void open(const YAML::Mark& mark, YamlValue::Kind kind) {
    if (isKeyNext()) refuse(mark, "a key must be a plain word");
    if (levels_.size() == kDeepest) refuse(mark, fmt::format("more than {} levels", kDeepest));
    levels_.emplace_back();
    levels_.back().container.kind = kind;
    levels_.back().container.line = mark.line + 1;
  }
  void close() {
    YamlValue value = std::move(levels_.back().container);
    levels_.pop_back();
    place(std::move(value));
  }
  void add(const YAML::Mark& mark, YamlValue value) {
    if (isKeyNext()) refuse(mark, "a key must be a plain word");
    value.line = mark.line + 1;
    place(std::move(value));
  }
  void place(YamlValue value) {
    if (++count_ > kMostValues) {
      throw InputError({file_, value.line, ""}, fmt::format("more than {} values", kMostValues));
    }
    if (levels_.empty()) {
      root_ = std::move(value);
      return;
    }
    Level& level = levels_.back();
    if (level.container.kind == YamlValue::Kind::list) {
      level.container.items.push_back(std::move(value));
    } else {
      level.container.entries.push_back({level.key, level.keyLine, std::move(value)});
      level.keyLine = 0;
    }
  }

  const std::string& file_;
  YamlValue root_;
  std::vector<Level> levels_;
  std::size_t count_ = 0;
};

/// Knows only where the last document begins.
class DocumentStart : public YAML::EventHandler {
 public:
  int line = 0;

  void OnDocumentStart(const YAML::Mark& mark) override { line = mark.line + 1; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

}  // namespace

const YamlValue* YamlValue::find(const std::string& key) const {
  for (const Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

YamlValue* YamlValue::find(const std::string& key) {
  for (Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

YamlValue loadYaml(const std::string& path) { return parseYaml(readYamlText(path), path); }

std::string readYamlText(const std::string& path) { return readTextFile(path, kYamlLimits); }

YamlValue parseYaml(const std::string& text, const std::string& file) {
  checkText(text, file, kYamlLimits);
  try {
    // Syntax first: on broken text the parser may send strange events before it throws.
    std::istringstream stream(text);
    YAML::Parser syntax(stream);
    DocumentStart document;
    if (!syntax.HandleNextDocument(document)) return {};
    if (syntax.HandleNextDocument(document)) {
      throw InputError({file, document.line, ""},
                       "a second YAML document or a stray character; expected one document");
    }
    stream.clear();
    stream.seekg(0);
    YAML::Parser parser(stream);
    TreeBuilder tree(file);
    parser.HandleNextDocument(tree);
    return tree.take();
  } catch (const YAML::Exception& e) {
    throw InputError({file, e.mark.is_null() ? 0 : e.mark.line + 1, ""},
                     "is not valid YAML: " + e.msg);
  }
}

std::string described(const YamlValue& value) {
  switch (value.kind) {
    case YamlValue::Kind::null:
      return "nothing";
    case YamlValue::Kind::scalar:
      return (value.isString ? "the text " : "") + detail::quoted(value.scalar);
    case YamlValue::Kind::list:
      return fmt::format("a list of {}", value.items.size());
    case YamlValue::Kind::mapping:
      return "a mapping";
  }
  return "";
}

StrictMapping::StrictMapping(const YamlValue& value, std::string file, std::string path,
                             const std::vector<std::string>& validKeys)
    : mapping_(&value), file_(std::move(file)), path_(std::move(path)) {
  if (value.kind != YamlValue::Kind::mapping) {
    fail(value, path_, "expected a mapping (key: value), got " + described(value));
  }
  for (const auto& entry : value.entries) {
    if (std::find(validKeys.begin(), validKeys.end(), entry.key) != validKeys.end()) continue;
    YamlValue at = entry.value;
    at.line = entry.line;
    fail(at, pathOf(entry.key),
         fmt::format("unknown key; the nearest valid key is '{}'",
                     pathOf(nearestWord(entry.key, validKeys))));
  }
}

std::string StrictMapping::pathOf(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

const YamlValue& StrictMapping::value(const std::string& key) const {
  if (const YamlValue* found = mapping_->find(key)) return *found;
  fail(*mapping_, pathOf(key), "missing key; add it");
}

void StrictMapping::fail(const std::string& key, const std::string& message) const {
  const YamlValue* found = mapping_->find(key);
  fail(found ? *found : *mapping_, pathOf(key), message);
}

void StrictMapping::fail(const YamlValue& at, const std::string& path,
                         const std::string& message) const {
  if (at.option.empty()) throw InputError({file_, at.line, path}, message);
  throw InputError({file_, 0, at.option}, path + ": " + message);
}

double StrictMapping::numberAt(const YamlValue& at, const std::string& path, const Range& range,
                               const char* unit) const {
  const auto number = at.kind == YamlValue::Kind::scalar && !at.isString ? toNumber(at.scalar)
                                                                         : std::optional<double>();
  if (number && range.contains(*number)) return *number;
  fail(at, path,
       fmt::format("expected a finite number in {}, got {}", range.text(unit), described(at)));
}

double StrictMapping::number(const std::string& key, const Range& range, const char* unit) const {
  return numberAt(value(key), pathOf(key), range, unit);
}

long long StrictMapping::integer(const std::string& key, const Range& range,
                                 const char* unit) const {
  const YamlValue& at = value(key);
  const auto number = at.kind == YamlValue::Kind::scalar && !at.isString
                          ? toInteger(at.scalar)
                          : std::optional<long long>();
  if (number && range.contains(static_cast<double>(*number))) return *number;
  fail(at, pathOf(key),
       fmt::format("expected a whole number in {}, got {}", range.text(unit), described(at)));
}

bool StrictMapping::flag(const std::string& key) const {
  const YamlValue& at = value(key);
  if (at.kind == YamlValue::Kind::scalar && !at.isString) {
    if (at.scalar == "true") return true;
    if (at.scalar == "false") return false;
  }
  fail(at, pathOf(key), "expected true or false, got " + described(at));
}

std::string StrictMapping::textAt(const YamlValue& at, const std::string& path) const {
  constexpr std::size_t kLongestText = 200;
  if (at.kind != YamlValue::Kind::scalar || at.scalar.empty() || at.scalar.size() > kLongestText ||
      at.scalar.find_first_of("\n\r\t") != std::string::npos) {
    fail(at, path,
         fmt::format("expected one line of text of 1 to {} characters, got {}", kLongestText,
                     described(at)));
  }
  return at.scalar;
}

std::string StrictMapping::text(const std::string& key) const {
  return textAt(value(key), pathOf(key));
}

std::vector<std::string> StrictMapping::texts(const std::string& key) const {
  std::vector<std::string> all;
  for (const YamlValue& item : list(key).items) all.push_back(textAt(item, pathOf(key)));
  return all;
}

const YamlValue& StrictMapping::list(const std::string& key) const {
  const YamlValue& at = value(key);
  if (at.kind != YamlValue::Kind::list || at.items.size() > kLongestList) {
    fail(at, pathOf(key),
         fmt::format("expected a list of at most {}, got {}", kLongestList, described(at)));
  }
  return at;
}

std::vector<double> StrictMapping::numbers(const std::string& key, std::size_t size,
                                           const Range& range, const char* unit) const {
  const YamlValue& at = value(key);
  if (at.kind != YamlValue::Kind::list || at.items.size() > kLongestList ||
      (size > 0 && at.items.size() != size)) {
    fail(at, pathOf(key),
         fmt::format("expected a list of {}numbers in {}, got {}",
                     size > 0 ? fmt::format("{} ", size) : "", range.text(unit), described(at)));
  }
  std::vector<double> numbers;
  for (const YamlValue& item : at.items) {
    numbers.push_back(numberAt(item, pathOf(key), range, unit));
  }
  return numbers;
}

std::vector<std::vector<double>> StrictMapping::rows(const std::string& key, std::size_t width,
                                                     const Range& range, const char* unit) const {
  std::vector<std::vector<double>> rows;
  for (const YamlValue& item : list(key).items) {
    if (item.kind != YamlValue::Kind::list || item.items.size() != width) {
      fail(item, pathOf(key),
           fmt::format("expected a list of lists of {} numbers in {}, got {} in it", width,
                       range.text(unit), described(item)));
    }
    rows.emplace_back();
    for (const YamlValue& cell : item.items) {
      rows.back().push_back(numberAt(cell, pathOf(key), range, unit));
    }
  }
  return rows;
}

StrictMapping StrictMapping::mapping(const std::string& key,
                                     const std::vector<std::string>& validKeys) const {
  return StrictMapping(value(key), file_, pathOf(key), validKeys);
}

}  // namespace depthservo::detail
