#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "text/Names.h"
#include "text/TextFile.h"

namespace depthservo::detail {

enum class Need { optional, required };

/// Visits the keys of a configuration. One function describes the configuration to it; readers,
/// writers and lists of keys derive from it.
class Fields {
 public:
  virtual ~Fields() = default;

  virtual void number(const char* key, double& value, const Range& range, const char* unit,
                      Need need = Need::optional) = 0;
  virtual void number(const char* key, std::optional<double>& value, const Range& range,
                      const char* unit) = 0;
  virtual void integer(const char* key, long long& value, const Range& range, const char* unit,
                       Need need = Need::optional) = 0;
  virtual void flag(const char* key, bool& value) = 0;
  virtual void text(const char* key, std::string& value, Need need) = 0;
  /// A list of as many numbers as `value` has.
  virtual void numbers(const char* key, Eigen::Ref<Eigen::VectorXd> value, const Range& range,
                       const char* unit, Need need = Need::optional) = 0;
  /// A list of numbers of any length.
  virtual void numbersOfAny(const char* key, Eigen::VectorXd& value, const Range& range,
                            const char* unit, Need need = Need::optional) = 0;
  /// One number, or a list of them.
  virtual void oneOrMore(const char* key, std::vector<double>& value, const Range& range,
                         const char* unit, Need need) = 0;
  /// A list of any length.
  virtual void integers(const char* key, std::vector<int>& value, const Range& range) = 0;

  template <int width>
  void rows(const char* key, std::vector<Eigen::Matrix<double, width, 1>>& value,
            const Range& range, const char* unit, Need need = Need::optional);

  template <class Enum>
  void choice(const char* key, Enum& value, const std::vector<Choice<Enum>>& choices,
              Need need = Need::optional);

  using Describe = std::function<void(Fields&)>;
  virtual void section(const char* key, Need need, const Describe& describe) = 0;

  template <class T, class DescribeItem>
  void section(const char* key, std::optional<T>& value, const DescribeItem& describe) {
    optionalSection(
        key, value.has_value(), [&] { value.emplace(); },
        [&](Fields& fields) { describe(fields, *value); });
  }

  /// A list of mappings.
  template <class T, class DescribeItem>
  void list(const char* key, std::vector<T>& value, const DescribeItem& describe) {
    listOf(
        key, value.size(), [&](std::size_t size) { value.resize(size); },
        [&](Fields& fields, std::size_t i) { describe(fields, value[i]); });
  }

 protected:
  using Rows = std::vector<std::vector<double>>;
  virtual void rowsOf(const char* key, std::size_t width, Rows& value, const Range& range,
                      const char* unit, Need need) = 0;
  virtual void word(const char* key, std::size_t& index, const std::vector<std::string>& words,
                    Need need) = 0;
  virtual void optionalSection(const char* key, bool exists, const std::function<void()>& create,
                               const Describe& describe) = 0;
  virtual void listOf(const char* key, std::size_t size,
                      const std::function<void(std::size_t)>& resize,
                      const std::function<void(Fields&, std::size_t)>& describe) = 0;
};

template <int width>
void Fields::rows(const char* key, std::vector<Eigen::Matrix<double, width, 1>>& value,
                  const Range& range, const char* unit, Need need) {
  Rows rows;
  for (const auto& row : value) rows.emplace_back(row.data(), row.data() + width);
  rowsOf(key, width, rows, range, unit, need);
  value.clear();
  for (const auto& row : rows) value.emplace_back(row.data());
}

template <class Enum>
void Fields::choice(const char* key, Enum& value, const std::vector<Choice<Enum>>& choices,
                    Need need) {
  std::size_t index = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i].value == value) index = i;
  }
  word(key, index, wordsOf(choices), need);
  value = choices[index].value;
}

}  // namespace depthservo::detail
