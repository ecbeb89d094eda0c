#include <gtest/gtest.h>

#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"
#include "text/StrictYaml.h"

namespace depthservo::detail {
namespace {

using test::inputErrorOf;
using test::isRefusal;

const std::vector<std::string> kKeys = {"name", "gain", "on", "size", "list", "rows", "sub"};

/// Reads every kind of value there is from a text.
void readAll(const std::string& text) {
  const YamlValue root = parseYaml(text, "f.yaml");
  const StrictMapping all(root, "f.yaml", "", kKeys);
  if (all.has("name")) all.text("name");
  if (all.has("gain")) all.number("gain", Range::above(0, 10), "1/s");
  if (all.has("on")) all.flag("on");
  if (all.has("size")) all.integer("size", {1, 100}, "px");
  if (all.has("list")) all.numbers("list", 2, {0, 1}, "m");
  if (all.has("rows")) all.rows("rows", 2, {0, 1}, "m");
  if (all.has("sub")) all.mapping("sub", {"fx", "fy"}).number("fx", {0, 1}, "px");
}

TEST(StrictYamlTest, reads_values_in_both_yaml_styles) {
  const YamlValue root = parseYaml(
      "name: 'a: b'\ngain: .5\non: true\nsize: 5\nlist: [0, 1e-3]\nrows:\n  - [0, 1]\n  - [1, 0]\n"
      "sub: {fx: 0.25}\n",
      "f.yaml");
  const StrictMapping all(root, "f.yaml", "", kKeys);
  EXPECT_EQ(all.text("name"), "a: b");
  EXPECT_EQ(all.number("gain", {0, 1}, ""), 0.5);
  EXPECT_TRUE(all.flag("on"));
  EXPECT_EQ(all.integer("size", {0, 9}, ""), 5);
  EXPECT_EQ(all.numbers("list", 2, {0, 1}, ""), (std::vector<double>{0, 1e-3}));
  EXPECT_EQ(all.rows("rows", 2, {0, 1}, "")[1], (std::vector<double>{1, 0}));
  EXPECT_EQ(all.mapping("sub", {"fx"}).number("fx", {0, 1}, ""), 0.25);
}

struct BrokenYaml {
  const char* name;
  std::string text;
  std::vector<std::string> words;
};
void PrintTo(const BrokenYaml& yaml, std::ostream* out) { *out << yaml.name; }

std::string aliasBomb() {
  std::string text = "a0: &a0 [0, 0]\n";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before + ", " + before +
            ", " + before + "]\n";
  }
  return text;
}

class BrokenYamlTest : public testing::TestWithParam<BrokenYaml> {};

TEST_P(BrokenYamlTest, is_refused_with_file_line_key_and_reason) {
  std::vector<std::string> words = GetParam().words;
  words.push_back("f.yaml");
  EXPECT_TRUE(isRefusal(inputErrorOf([] { readAll(GetParam().text); }), words));
}

INSTANTIATE_TEST_SUITE_P(
    , BrokenYamlTest,
    testing::Values(
        BrokenYaml{"unknown_key", "name: x\n\ngian: 1\n", {":3: gian:", "unknown", "'gain'"}},
        BrokenYaml{"unknown_below", "sub:\n  fz: 1\n", {":2: sub.fz:", "'sub.fx'"}},
        BrokenYaml{"missing_key", "sub: {fy: 1}\n", {":1: sub.fx:", "missing"}},
        BrokenYaml{"twice", "gain: 1\ngain: 2\n", {":2: gain:", "twice", "line 1"}},
        BrokenYaml{"twice_below", "sub: {fx: 1, fx: 1}\n", {":1: fx:", "twice"}},
        BrokenYaml{"not_a_mapping", "- 1\n- 2\n", {"mapping", "list"}},
        BrokenYaml{"empty", "", {"mapping", "nothing"}},
        BrokenYaml{"only_comment", "# x\n", {"mapping"}},
        BrokenYaml{"scalar_for_mapping", "sub: 3\n", {":1: sub:", "mapping", "'3'"}},
        BrokenYaml{"word_for_number", "gain: high\n", {":1: gain:", "(0, 10] 1/s", "'high'"}},
        BrokenYaml{"text_for_number", "gain: \"1\"\n", {"gain:", "the text '1'"}},
        BrokenYaml{"nothing_for_number", "gain:\n", {"gain:", "nothing"}},
        BrokenYaml{"nan", "gain: .nan\n", {"gain:", "finite"}},
        BrokenYaml{"nan_word", "gain: nan\n", {"gain:", "finite"}},
        BrokenYaml{"infinite", "gain: .inf\n", {"gain:", "finite"}},
        BrokenYaml{"overflow", "gain: 1e999\n", {"gain:", "finite"}},
        BrokenYaml{"open_end", "gain: 0\n", {"gain:", "(0, 10]"}},
        BrokenYaml{"out_of_range", "gain: 11\n", {"gain:", "(0, 10] 1/s", "'11'"}},
        BrokenYaml{"fraction_for_integer", "size: 5.5\n", {"size:", "whole", "[1, 100] px"}},
        BrokenYaml{"yes_for_flag", "on: yes\n", {"on:", "true or false"}},
        BrokenYaml{"short_list", "list: [1]\n", {"list:", "2 numbers"}},
        BrokenYaml{"long_list", "list: [1, 1, 1]\n", {"list:", "2 numbers"}},
        BrokenYaml{"bad_item", "list:\n - 1\n - 2\n", {":3: list:", "[0, 1] m"}},
        BrokenYaml{"narrow_row", "rows: [[0, 1], [0]]\n", {"rows:", "2 numbers"}},
        BrokenYaml{"row_of_words", "rows: [[0, a]]\n", {"rows:", "'a'"}},
        BrokenYaml{"list_for_text", "name: [a]\n", {"name:", "text"}},
        BrokenYaml{"long_text", "name: " + std::string(300, 'n') + "\n", {"name:", "200"}},
        BrokenYaml{"syntax", "name: x\ngain: [1, 2\n", {"not valid YAML"}},
        BrokenYaml{"tab", "sub:\n\tfx: 1\n", {":2:", "not valid YAML"}},
        BrokenYaml{"unknown_alias", "gain: *a\n", {"not valid YAML"}},
        BrokenYaml{"mapping_as_key", "{a: 1}: 2\n", {"key"}},
        BrokenYaml{"two_documents", "gain: 1\n---\ngain: 2\n", {":2:", "second"}},
        BrokenYaml{"alias_bomb", aliasBomb(), {"aliases"}},
        BrokenYaml{"endless_alias", "sub: &a {fx: *a}\n", {"f.yaml"}},
        BrokenYaml{"many_values", "list: [" + std::string(30000, ',') + "]\n", {"f.yaml"}},
        BrokenYaml{"stray_bracket", "gain: 1\n]\n", {"f.yaml"}},
        BrokenYaml{"deep", std::string(300, '[') + std::string(300, ']'), {"levels"}},
        BrokenYaml{"very_deep", std::string(60000, '['), {"f.yaml"}},
        BrokenYaml{"binary", std::string("gain: 1\n\0\x02", 10), {":2:", "not a text file"}},
        BrokenYaml{"megabyte_line", "name: " + std::string(1 << 20, 'x'), {":1:", "longer"}}),
    [](const auto& param) { return std::string(param.param.name); });

TEST(StrictYamlTest, refuses_an_enormous_file) {
  test::TemporaryFolder folder;
  std::string text;
  while (text.size() < (1 << 20)) text += "- 1\n";
  folder.write("f.yaml", text);
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { loadYaml(folder / "f.yaml"); }), {"f.yaml", "bytes"}));
}

}  // namespace
}  // namespace depthservo::detail
