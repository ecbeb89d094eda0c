#pragma once

#include <string>
#include <vector>

#include "text/Fields.h"
#include "text/StrictYaml.h"

namespace depthservo::detail {

/// Fills a configuration from YAML; keys that are not there keep their default.
class FieldReader : public Fields {
 public:
  /// Reads at once. \param path of the mapping, "" for the whole file \throw InputError
  FieldReader(const YamlValue& value, const std::string& file, const std::string& path,
              const Describe& describe);

  void number(const Key& key, double& value, const Range& range, const char* unit) override;
  void number(const Key& key, std::optional<double>& value, const Range& range,
              const char* unit) override;
  void flag(const Key& key, bool& value) override;
  void text(const Key& key, std::string& value) override;
  void texts(const Key& key, std::vector<std::string>& value) override;
  void oneOrMore(const Key& key, std::vector<double>& value, const Range& range,
                 const char* unit) override;
  void integers(const Key& key, std::vector<int>& value, const Range& range) override;
  void section(const Key& key, const Describe& describe) override;

 protected:
  void integerOf(const Key& key, long long& value, const Range& range, const char* unit) override;
  void numbersOf(const Key& key, std::size_t size, std::optional<Numbers>& value,
                 const Range& range, const char* unit) override;
  void rowsOf(const Key& key, std::size_t width, Rows& value, const Range& range,
              const char* unit) override;
  void word(const Key& key, std::size_t& index, const std::vector<std::string>& words) override;
  void optionalSection(const Key& key, bool exists, const std::function<void()>& create,
                       const Describe& describe) override;
  void listOf(const Key& key, const std::vector<std::string>& shortForm, std::size_t size,
              const std::function<void(std::size_t)>& resize,
              const std::function<void(Fields&, std::size_t)>& describe) override;
  void refuse(const Key& key, const std::string& message) const override;

 private:
  bool reads(const Key& key) const;
  bool isSet(const Key& key) const;

  StrictMapping mapping_;
};

}  // namespace depthservo::detail
