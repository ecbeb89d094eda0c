#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "text/Fields.h"

namespace depthservo::detail {

/// A key as documentation and schema need it.
struct KeyNode {
  enum class Type {
    number,
    integer,
    flag,
    text,
    texts,
    word,
    numbers,    ///< `size` of them; 0: any number
    oneOrMore,  ///< a number or a list of them
    integers,
    rows,  ///< lists of `size` numbers
    section,
    list  ///< of mappings
  };

  std::string name, meaning;
  Need need;
  std::string otherwise;
  Type type = Type::number;
  bool mayBeNull = false;  ///< there is a value that is not set
  Range range{0, 0};
  std::string unit;
  std::size_t size = 0;
  std::vector<std::string> words, shortForm;
  nlohmann::ordered_json value;  ///< as it is now; null: not set
  std::vector<KeyNode> below;    ///< of a section, or of one item of a list
};

/// The keys with the values that they have.
DEPTHSERVO_INNER std::vector<KeyNode> keyTree(const Fields::Describe& describe);

/// All keys that there can be, with their defaults. \param describe of a configuration that has
/// just been made; it is changed
DEPTHSERVO_INNER std::vector<KeyNode> allKeys(const Fields::Describe& describe);

/// The values of a tree as one JSON object, in its order. Keys that do not apply are left out.
DEPTHSERVO_INNER nlohmann::ordered_json toJson(const std::vector<KeyNode>& keys);

}  // namespace depthservo::detail
