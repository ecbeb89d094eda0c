#include "text/KeyTree.h"

namespace depthservo::detail {
namespace {

using Json = nlohmann::ordered_json;
using Type = KeyNode::Type;

class Planter : public Fields {
 public:
  Planter(std::vector<KeyNode>& keys, bool all) : keys_(keys), all_(all) {}

  void number(const Key& key, double& value, const Range& range, const char* unit) override {
    add(key, Type::number, value, range, unit);
  }
  void number(const Key& key, std::optional<double>& value, const Range& range,
              const char* unit) override {
    add(key, Type::number, value ? Json(*value) : Json(), range, unit).mayBeNull = true;
  }
  void flag(const Key& key, bool& value) override { add(key, Type::flag, value); }
  void text(const Key& key, std::string& value) override { add(key, Type::text, value); }
  void texts(const Key& key, std::vector<std::string>& value) override {
    add(key, Type::texts, value);
  }
  void oneOrMore(const Key& key, std::vector<double>& value, const Range& range,
                 const char* unit) override {
    add(key, Type::oneOrMore, value.size() == 1 ? Json(value.front()) : Json(value), range, unit);
  }
  void integers(const Key& key, std::vector<int>& value, const Range& range) override {
    add(key, Type::integers, value, range);
  }
  void section(const Key& key, const Describe& describe) override {
    const std::size_t index = keys_.size();
    add(key, Type::section, Json());
    Planter below(keys_[index].below, all_);
    describe(below);
    keys_[index].value = toJson(keys_[index].below);
  }

 protected:
  void integerOf(const Key& key, long long& value, const Range& range, const char* unit) override {
    add(key, Type::integer, value, range, unit);
  }
  void numbersOf(const Key& key, std::size_t size, std::optional<Numbers>& value,
                 const Range& range, const char* unit) override {
    KeyNode& node = add(key, Type::numbers, value ? Json(*value) : Json(), range, unit);
    node.size = size;
    node.mayBeNull = !value;
  }
  void rowsOf(const Key& key, std::size_t width, Rows& value, const Range& range,
              const char* unit) override {
    add(key, Type::rows, value, range, unit).size = width;
  }
  void word(const Key& key, std::size_t& index, const std::vector<std::string>& words) override {
    add(key, Type::word, words[index]).words = words;
  }
  void optionalSection(const Key& key, bool exists, const std::function<void()>& create,
                       const Describe& describe) override {
    const std::size_t index = keys_.size();
    if (all_ || exists) {
      if (!exists) create();
      section(key, describe);
    } else {
      add(key, Type::section, Json());
    }
    keys_[index].mayBeNull = true;
    if (!exists) keys_[index].value = nullptr;
  }
  void listOf(const Key& key, const std::vector<std::string>& shortForm, std::size_t size,
              const std::function<void(std::size_t)>& resize,
              const std::function<void(Fields&, std::size_t)>& describe) override {
    KeyNode& node = add(key, Type::list, Json::array());
    node.shortForm = shortForm;
    if (all_) resize(1);
    for (std::size_t i = 0; i < (all_ ? 1 : size); ++i) {
      node.below.clear();
      Planter item(node.below, all_);
      describe(item, i);
      if (!all_) node.value.push_back(toJson(node.below));
    }
  }

 private:
  KeyNode& add(const Key& key, Type type, Json value, const Range& range = {0, 0},
               const char* unit = "") {
    KeyNode node;
    node.name = key.name;
    node.meaning = key.meaning;
    node.need = key.need;
    node.otherwise = key.otherwise;
    node.type = type;
    node.range = range;
    node.unit = unit;
    node.value = std::move(value);
    keys_.push_back(std::move(node));
    return keys_.back();
  }

  std::vector<KeyNode>& keys_;
  bool all_;
};

}  // namespace

std::vector<KeyNode> keyTree(const Fields::Describe& describe) {
  std::vector<KeyNode> keys;
  Planter planter(keys, false);
  describe(planter);
  return keys;
}

std::vector<KeyNode> allKeys(const Fields::Describe& describe) {
  std::vector<KeyNode> keys;
  Planter planter(keys, true);
  describe(planter);
  return keys;
}

nlohmann::ordered_json toJson(const std::vector<KeyNode>& keys) {
  Json json = Json::object();
  for (const KeyNode& key : keys) {
    if (key.need.isAllowed) json[key.name] = key.value;
  }
  return json;
}

}  // namespace depthservo::detail
