#include "text/TextTable.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <utility>

namespace depthservo::detail {
namespace {

constexpr TextLimits kTableLimits{std::size_t{1} << 30, 4096};

constexpr Range kIds{0, 1e9};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Without what stands in brackets, such as units.
std::string withoutBrackets(std::string_view text) {
  std::string rest;
  int depth = 0;
  for (const char c : text) {
    if (c == '[' || c == '(') ++depth;
    if (depth == 0) rest += c;
    if ((c == ']' || c == ')') && depth > 0) --depth;
  }
  return rest;
}

/// The component that a word of a header names: x, y, z or w; 0 when none. Words are `tx`, `q_w`,
/// `position.x`, `qr` (real part, with qi, qj, qk), `q0` (real part, with q1, q2, q3).
char componentOf(std::string_view word) {
  static const std::map<char, char> quaternion = {{'r', 'w'}, {'i', 'x'}, {'j', 'y'}, {'k', 'z'},
                                                  {'0', 'w'}, {'1', 'x'}, {'2', 'y'}, {'3', 'z'}};
  const auto last = static_cast<char>(std::tolower(static_cast<unsigned char>(word.back())));
  if (last >= 'w' && last <= 'z') return last;
  const auto first = std::tolower(static_cast<unsigned char>(word.front()));
  const auto known = quaternion.find(last);
  return first == 'q' && word.size() <= 3 && known != quaternion.end() ? known->second : '\0';
}

/// Seconds of whole nanoseconds: the double nearest to the decimal number, as in our own files.
std::optional<double> secondsOf(std::string_view text) {
  const auto nanoseconds = toInteger(text);
  if (!nanoseconds || *nanoseconds < 0) return std::nullopt;
  constexpr long long kPerSecond = 1000000000;
  return toNumber(fmt::format("{}.{:09}", *nanoseconds / kPerSecond, *nanoseconds % kPerSecond));
}

}  // namespace

TextTable::TextTable(std::string path, Style style, std::vector<std::string> columns, Order order)
    : path_(std::move(path)),
      bytes_(readTextFile(path_, kTableLimits)),
      style_(style),
      columns_(std::move(columns)),
      order_(order),
      width_(columns_.size()) {
  if (style_ == Style::csv) checkHeader();
  if (style_ == Style::euroc) checkEurocHeader();
}

bool TextTable::nextLine() {
  while (position_ < bytes_.size()) {
    const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
    content_ = trimmed(std::string_view(bytes_).substr(position_, end - position_));
    position_ = end + 1;
    ++line_;
    if (content_.empty()) continue;
    if (content_.front() == '#') {
      checkComment(content_.substr(1));
    } else if (style_ == Style::spaces && !hasRow_ && isHeader()) {
      checkComment(content_);
    } else {
      return true;
    }
  }
  return false;
}

void TextTable::split() { split(content_); }

void TextTable::split(std::string_view rest) {
  fields_.clear();
  // What follows the first field tells how a line of a `spaces` table is separated.
  if (style_ == Style::spaces) {
    const std::size_t blank = rest.find_first_of(" \t,;");
    const std::size_t sign = rest.find_first_not_of(" \t", std::min(blank, rest.size()));
    const char first = sign == std::string_view::npos ? ' ' : rest[sign];
    separators_ = first == ',' ? "," : first == ';' ? ";" : " \t";
  }
  for (;;) {
    const std::size_t end = rest.find_first_of(separators_);
    fields_.push_back(trimmed(rest.substr(0, end)));
    if (end == std::string_view::npos) return;
    rest.remove_prefix(end + 1);
    if (separators_[0] == ' ') rest = trimmed(rest);
  }
}

void TextTable::checkHeader() {
  const std::string expected = fmt::format("{}", fmt::join(columns_, ","));
  if (!nextLine()) {
    throw InputError({path_, 0, ""}, fmt::format("is empty, expected the header '{}'", expected));
  }
  split();
  if (!std::equal(fields_.begin(), fields_.end(), columns_.begin(), columns_.end())) {
    throw InputError({path_, line_, ""},
                     fmt::format("expected the header '{}', got {}", expected, quoted(content_)));
  }
}

void TextTable::checkEurocHeader() {
  const std::string expected = fmt::format("#{}", fmt::join(columns_, ","));
  const std::size_t end = std::min(bytes_.find('\n'), bytes_.size());
  const std::string_view header = trimmed(std::string_view(bytes_).substr(0, end));
  split(header.empty() || header.front() != '#' ? std::string_view() : header.substr(1));
  width_ = fields_.size();
  for (std::string_view& field : fields_) field = trimmed(field.substr(0, field.find('[')));
  if (width_ < columns_.size() || !std::equal(columns_.begin(), columns_.end(), fields_.begin())) {
    throw InputError({path_, 1, ""},
                     fmt::format("expected a header that begins '{}', got {}", expected,
                                 quoted(std::string_view(bytes_).substr(0, end))));
  }
  position_ = end + 1;
  line_ = 1;
}

/// A first line that begins with a word for the time.
bool TextTable::isHeader() const {
  std::string word(content_.substr(0, content_.find_first_of(" \t,;[(")));
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word == "t" || word == "time" || word == "stamp" || word == "timestamp";
}

void TextTable::checkComment(std::string_view comment) {
  if (style_ != Style::spaces) return;
  const std::string text = withoutBrackets(comment);
  std::vector<std::string_view> words;
  std::string components, expected;
  for (std::size_t i = 0; (i = text.find_first_not_of(" \t,;", i)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(" \t,;", i), text.size());
    words.push_back(std::string_view(text).substr(i, end - i));
    if (const char component = componentOf(words.back())) components += component;
    i = end;
  }
  for (const std::string& column : columns_) {
    if (const char component = componentOf(column)) expected += component;
  }
  const auto isReordered = [](const auto& got, const auto& wanted) {
    return !std::equal(got.begin(), got.end(), wanted.begin(), wanted.end()) &&
           std::is_permutation(got.begin(), got.end(), wanted.begin(), wanted.end());
  };
  if (isReordered(words, columns_) || isReordered(components, expected)) {
    throw InputError({path_, line_, ""},
                     fmt::format("columns in another order: expected '{}', got {}",
                                 fmt::join(columns_, " "), quoted(content_)));
  }
}

bool TextTable::next() {
  if (!nextLine()) {
    if (!hasRow_) {
      throw InputError({path_, 0, ""},
                       fmt::format("has no row, expected rows of '{}'", fmt::join(columns_, " ")));
    }
    return false;
  }
  split();
  if (fields_.size() != width_) {
    const bool missing = fields_.size() < columns_.size();
    throw InputError(
        {path_, line_, missing ? columns_[fields_.size()] : std::string()},
        fmt::format("{} column: expected {} columns ({}{}), got {}",
                    fields_.size() < width_ ? "missing" : "extra", width_, fmt::join(columns_, " "),
                    width_ > columns_.size() ? " ..." : "", fields_.size()));
  }
  readTime();
  hasRow_ = true;
  return true;
}

double TextTable::seconds(std::size_t column) const {
  const auto value = toNumber(fields_[column]);
  if (!value || !kTimes.contains(*value)) {
    fail(column,
         expectedNumber(kTimes, "s", fields_[column]) + (value ? unitHint(*value) : std::string()));
  }
  return *value;
}

void TextTable::readTime() {
  const double before = time_s_;
  if (style_ == Style::euroc) {
    const auto time_s = secondsOf(fields_[0]);
    if (!time_s) {
      fail(0, fmt::format("expected a time in whole nanoseconds, got {}", quoted(fields_[0])));
    }
    time_s_ = *time_s;
  } else {
    time_s_ = seconds(0);
  }
  if (hasRow_ && time_s_ < before) {
    fail(0, fmt::format("time runs backwards: {} s after {} s; sort the file", time_s_, before));
  }
  if (hasRow_ && time_s_ == before && order_ == Order::increasing) {
    fail(0, fmt::format("the time {} s appears twice; remove one row", time_s_));
  }
}

double TextTable::number(std::size_t column, const Range& range, const char* unit) const {
  const auto value = toNumber(fields_[column]);
  if (!value || !range.contains(*value)) fail(column, expectedNumber(range, unit, fields_[column]));
  return *value;
}

bool TextTable::isNaN(std::size_t column) const {
  std::string text(fields_[column]);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text == "nan" || text == "-nan" || text == "+nan";
}

int TextTable::id(std::size_t column) const {
  const auto value = toInteger(fields_[column]);
  if (!value || !kIds.contains(static_cast<double>(*value))) {
    fail(column, fmt::format("expected a whole number in {}, got {}", kIds.text(""),
                             quoted(fields_[column])));
  }
  return static_cast<int>(*value);
}

void TextTable::fail(std::size_t column, const std::string& message) const {
  throw InputError({path_, line_, columns_[column]}, message);
}

}  // namespace depthservo::detail
