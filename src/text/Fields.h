#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "motion/DecimalPoint.h"
#include "text/Names.h"
#include "text/TextFile.h"

namespace depthservo::detail {

/// Whether a key must be there, or may.
struct Need {
  bool isRequired = false, isAllowed = true;
  const char *requiredWhen = "", *allowedWhen = "";  ///< conditions in words; empty: always

  static constexpr Need requiredFor(bool holds, const char* when) { return {holds, true, when}; }
  static constexpr Need onlyFor(bool holds, const char* when) { return {false, holds, "", when}; }
};
constexpr Need kOptional{}, kRequired{true};

/// A key of a configuration, as messages, documentation and schema tell it.
struct Key {
  const char* name;
  const char* meaning;  ///< a short sentence
  Need need = kOptional;
  const char* otherwise = "";  ///< what holds while it is not set, if that is no value
};

/// Visits the keys of a configuration. One function describes the configuration to it: what reads
/// it, writes it, documents it and checks it in an editor is made from that.
class Fields {
 public:
  virtual ~Fields() = default;

  virtual void number(const Key& key, double& value, const Range& range, const char* unit) = 0;
  virtual void number(const Key& key, std::optional<double>& value, const Range& range,
                      const char* unit) = 0;
  virtual void flag(const Key& key, bool& value) = 0;
  virtual void text(const Key& key, std::string& value) = 0;
  /// A list of words and numbers as they are written.
  virtual void texts(const Key& key, std::vector<std::string>& value) = 0;
  /// One number, or a list of them.
  virtual void oneOrMore(const Key& key, std::vector<double>& value, const Range& range,
                         const char* unit) = 0;
  /// A list of whole numbers, of any length.
  virtual void integers(const Key& key, std::vector<int>& value, const Range& range) = 0;

  template <class Integer>
  void integer(const Key& key, Integer& value, const Range& range, const char* unit) {
    long long wide = value;
    integerOf(key, wide, range, unit);
    value = static_cast<Integer>(wide);
  }

  /// A list of as many numbers as `value` has.
  void numbers(const Key& key, Eigen::Ref<Eigen::VectorXd> value, const Range& range,
               const char* unit);
  /// A list of `size` numbers, or none.
  template <int size>
  void numbers(const Key& key, std::optional<Eigen::Matrix<double, size, 1>>& value,
               const Range& range, const char* unit);
  /// A list of numbers of any length.
  void numbersOfAny(const Key& key, Eigen::VectorXd& value, const Range& range, const char* unit);

  /// A rotation as [qx, qy, qz, qw].
  void quaternion(const Key& key, Eigen::Quaterniond& value);

  template <int width>
  void rows(const Key& key, std::vector<Eigen::Matrix<double, width, 1>>& value, const Range& range,
            const char* unit);

  template <class Enum>
  void choice(const Key& key, Enum& value, const std::vector<Choice<Enum>>& choices);

  using Describe = std::function<void(Fields&)>;
  virtual void section(const Key& key, const Describe& describe) = 0;

  template <class T, class DescribeItem>
  void section(const Key& key, std::optional<T>& value, const DescribeItem& describe) {
    optionalSection(
        key, value.has_value(), [&] { value.emplace(); },
        [&](Fields& fields) { describe(fields, *value); });
  }

  /// A list of mappings. \param shortForm keys whose values alone, in a list, stand for a mapping;
  /// one mapping without a list is then a list of it, too
  template <class T, class DescribeItem>
  void list(const Key& key, std::vector<T>& value, const DescribeItem& describe,
            const std::vector<std::string>& shortForm = {}) {
    listOf(
        key, shortForm, value.size(), [&](std::size_t size) { value.resize(size); },
        [&](Fields& fields, std::size_t i) { describe(fields, value[i]); });
  }

 protected:
  using Numbers = std::vector<double>;
  using Rows = std::vector<Numbers>;
  virtual void integerOf(const Key& key, long long& value, const Range& range,
                         const char* unit) = 0;
  /// \param size how many; 0: any number
  virtual void numbersOf(const Key& key, std::size_t size, std::optional<Numbers>& value,
                         const Range& range, const char* unit) = 0;
  virtual void rowsOf(const Key& key, std::size_t width, Rows& value, const Range& range,
                      const char* unit) = 0;
  virtual void word(const Key& key, std::size_t& index, const std::vector<std::string>& words) = 0;
  virtual void optionalSection(const Key& key, bool exists, const std::function<void()>& create,
                               const Describe& describe) = 0;
  virtual void listOf(const Key& key, const std::vector<std::string>& shortForm, std::size_t size,
                      const std::function<void(std::size_t)>& resize,
                      const std::function<void(Fields&, std::size_t)>& describe) = 0;
  /// A value was read that is not valid.
  virtual void refuse(const Key& /*key*/, const std::string& /*message*/) const {}
};

inline void Fields::numbers(const Key& key, Eigen::Ref<Eigen::VectorXd> value, const Range& range,
                            const char* unit) {
  std::optional<Numbers> numbers(std::in_place, value.begin(), value.end());
  numbersOf(key, numbers->size(), numbers, range, unit);
  value = Eigen::Map<const Eigen::VectorXd>(numbers->data(), value.size());
}

template <int size>
void Fields::numbers(const Key& key, std::optional<Eigen::Matrix<double, size, 1>>& value,
                     const Range& range, const char* unit) {
  std::optional<Numbers> numbers;
  if (value) numbers.emplace(value->begin(), value->end());
  numbersOf(key, size, numbers, range, unit);
  if (numbers) value.emplace(numbers->data());
}

inline void Fields::numbersOfAny(const Key& key, Eigen::VectorXd& value, const Range& range,
                                 const char* unit) {
  std::optional<Numbers> numbers(std::in_place, value.begin(), value.end());
  numbersOf(key, 0, numbers, range, unit);
  value = Eigen::Map<const Eigen::VectorXd>(numbers->data(),
                                            static_cast<Eigen::Index>(numbers->size()));
}

inline void Fields::quaternion(const Key& key, Eigen::Quaterniond& value) {
  constexpr double kMostOff = 0.02;  // of the norm from 1
  numbers(key, value.coeffs(), {-1.1, 1.1}, "");
  const double norm = value.norm();
  if (!(std::abs(norm - 1) < kMostOff)) {
    const DecimalPoint point;
    refuse(key, "[qx, qy, qz, qw] has the norm " + std::to_string(norm) + ", expected 1");
  }
  value.normalize();
}

template <int width>
void Fields::rows(const Key& key, std::vector<Eigen::Matrix<double, width, 1>>& value,
                  const Range& range, const char* unit) {
  Rows rows;
  for (const auto& row : value) rows.emplace_back(row.data(), row.data() + width);
  rowsOf(key, width, rows, range, unit);
  value.clear();
  for (const auto& row : rows) value.emplace_back(row.data());
}

template <class Enum>
void Fields::choice(const Key& key, Enum& value, const std::vector<Choice<Enum>>& choices) {
  std::size_t index = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i].value == value) index = i;
  }
  word(key, index, wordsOf(choices));
  value = choices[index].value;
}

}  // namespace depthservo::detail
