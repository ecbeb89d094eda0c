#pragma once

#include <string>
#include <vector>

#include "depthservo/api.h"
#include "text/TextFile.h"

namespace depthservo::detail {

/// A YAML value that remembers where it was written.
struct DEPTHSERVO_INNER YamlValue {
  enum class Kind { null, scalar, list, mapping };
  struct Entry;

  Kind kind = Kind::null;
  std::string scalar;            ///< text of a scalar
  bool isString = false;         ///< a scalar in quotes: never a number
  int line = 0;                  ///< from 1
  std::string option;            ///< "--set key=value" when it comes from there
  std::vector<YamlValue> items;  ///< of a list
  std::vector<Entry> entries;    ///< of a mapping, in the order of the file

  const YamlValue* find(const std::string& key) const;
  YamlValue* find(const std::string& key);
};
struct YamlValue::Entry {
  std::string key;
  int line = 0;
  YamlValue value;
};

/// Reads one YAML document. Throws InputError: not readable, not text, not YAML, several documents,
/// aliases, more nested or larger than any file of ours, a key twice in a mapping.
DEPTHSERVO_INNER YamlValue loadYaml(const std::string& path);
/// The text of such a file, not yet parsed. \throw InputError as readTextFile
DEPTHSERVO_INNER std::string readYamlText(const std::string& path);
DEPTHSERVO_INNER YamlValue parseYaml(const std::string& text, const std::string& file);

/// A mapping that has no keys but the valid ones. Every fault is an InputError with file, line,
/// key, what was expected and, for an unknown key, the nearest valid one.
class DEPTHSERVO_INNER StrictMapping {
 public:
  /// \param path of the mapping itself, "" for the whole file
  StrictMapping(const YamlValue& value, std::string file, std::string path,
                const std::vector<std::string>& validKeys);

  bool has(const std::string& key) const { return mapping_->find(key) != nullptr; }

  double number(const std::string& key, const Range& range, const char* unit) const;
  long long integer(const std::string& key, const Range& range, const char* unit) const;
  bool flag(const std::string& key) const;
  std::string text(const std::string& key) const;  ///< 1 to 200 characters

  /// A list of scalars as they are written, 1 to 200 characters each.
  std::vector<std::string> texts(const std::string& key) const;

  /// A list of numbers. \param size how many; 0: any number up to `kLongestList`
  std::vector<double> numbers(const std::string& key, std::size_t size, const Range& range,
                              const char* unit) const;

  /// A list, maybe empty, of lists of `width` numbers.
  std::vector<std::vector<double>> rows(const std::string& key, std::size_t width,
                                        const Range& range, const char* unit) const;

  StrictMapping mapping(const std::string& key, const std::vector<std::string>& validKeys) const;

  /// The value of a key that must be there.
  const YamlValue& value(const std::string& key) const;
  const YamlValue& list(const std::string& key) const;

  std::string pathOf(const std::string& key) const;
  const std::string& file() const { return file_; }

  [[noreturn]] void fail(const std::string& key, const std::string& message) const;
  [[noreturn]] void fail(const YamlValue& at, const std::string& path,
                         const std::string& message) const;

  static constexpr std::size_t kLongestList = 1000;

 private:
  double numberAt(const YamlValue& at, const std::string& path, const Range& range,
                  const char* unit) const;

  std::string textAt(const YamlValue& at, const std::string& path) const;

  const YamlValue* mapping_;
  std::string file_, path_;
};

/// The value as short text for a message.
std::string described(const YamlValue& value);

}  // namespace depthservo::detail
