#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "depthservo/scenario/Scenario.h"
#include "depthservo/scenario/keyPages.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

const std::string kData = DEPTHSERVO_DATA;

std::string contents(const std::string& file) {
  std::ifstream in(file);
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What stands in the documentation between the markers of a table.
std::string documented(const std::string& table) {
  const std::string text = contents(kData + "/../doc/formats.md");
  const std::string begin = "<!-- written by: depthservo keys " + table + " -->\n";
  const std::size_t start = text.find(begin);
  EXPECT_NE(start, std::string::npos) << begin;
  const std::size_t from = start + begin.size(), end = text.find("<!-- end -->", from);
  EXPECT_NE(end, std::string::npos);
  return text.substr(from, end - from);
}

TEST(KeyPages, the_tables_in_the_documentation_are_those_of_the_code) {
  EXPECT_EQ(documented("--markdown"), keysAsMarkdown(KeySet::scenario))
      << "write the table anew: depthservo keys --markdown";
  EXPECT_EQ(documented("--replay --markdown"), keysAsMarkdown(KeySet::replay))
      << "write the table anew: depthservo keys --replay --markdown";
  EXPECT_EQ(documented("--errors --markdown"), keysAsMarkdown(KeySet::errors))
      << "write the table anew: depthservo keys --errors --markdown";
  EXPECT_EQ(documented("--robot --markdown"), keysAsMarkdown(KeySet::robot))
      << "write the table anew: depthservo keys --robot --markdown";
}

TEST(KeyPages, the_shipped_schema_is_that_of_the_code) {
  EXPECT_EQ(contents(kData + "/scenarios/scenario.schema.json"), scenarioSchema())
      << "write it anew: depthservo keys --schema > data/scenarios/scenario.schema.json";
}

TEST(KeyPages, text_has_one_line_for_every_key) {
  const std::string text = keysAsText(KeySet::scenario);
  const auto keys = Scenario::keys();
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), keys.size());
  std::istringstream lines(text);
  for (const std::string& key : keys) {
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line.rfind(key + " ", 0), 0u) << line;
    EXPECT_GT(line.size(), line.find_last_of(' ') + 1) << "no meaning: " << line;
  }
}

TEST(KeyPages, a_prefix_chooses_keys_and_a_wrong_one_is_refused) {
  const std::string gains = keysAsText(KeySet::scenario, "depth.gains.");
  EXPECT_EQ(std::count(gains.begin(), gains.end(), '\n'), 4);
  for (const char* word : {"depth.gains.settling", "1.5", "(0, 1000]", "time to 2 %"}) {
    EXPECT_NE(gains.find(word), std::string::npos) << word << " in\n" << gains;
  }
  EXPECT_TRUE(test::isRefusal(test::inputErrorOf([] { keysAsText(KeySet::scenario, "dpeth"); }),
                              {"dpeth", "'depth'"}));
}

TEST(Schema, tells_types_limits_words_defaults_and_what_is_required) {
  const auto schema = nlohmann::json::parse(scenarioSchema());
  const auto& camera = schema["properties"]["camera"];
  EXPECT_EQ(camera["additionalProperties"], false);
  EXPECT_EQ(camera["required"],
            nlohmann::json({"width", "height", "fx", "fy", "cx", "cy", "rate"}));
  const auto& fx = camera["properties"]["fx"];
  EXPECT_EQ(fx["exclusiveMinimum"], 0);
  EXPECT_EQ(fx["maximum"], 1e5);
  EXPECT_FALSE(fx.contains("minimum") || fx.contains("default"));
  EXPECT_EQ(schema["properties"]["control"]["properties"]["gain"]["default"], 0.57);
  EXPECT_EQ(schema["properties"]["robot"]["properties"]["initial"].contains("required"), false);
  const auto& law = schema["properties"]["control"]["properties"]["law"];
  EXPECT_EQ(law["enum"], nlohmann::json({"vpServo", "task", "profile", "regulation"}));
  EXPECT_NE(law["description"].get<std::string>().find("Durand"), std::string::npos);
}

/// Judges scenarios by the schema, with the validator that editors have, too: one line for each
/// that is refused.
class SchemaValidator : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("python3 -c 'import jsonschema, yaml' 2>/dev/null") != 0) {
      GTEST_SKIP() << "needs python3-jsonschema and python3-yaml";
    }
  }
  std::string judge(const std::string& folder) const {
    folder_.write(
        "judge.py",
        "import glob, json, sys, yaml, jsonschema\n"
        "schema = json.load(open(sys.argv[1]))\n"
        "jsonschema.Draft7Validator.check_schema(schema)\n"
        "for f in sorted(glob.glob(sys.argv[2] + '/**/*.yaml', recursive=True)):\n"
        "  errors = jsonschema.Draft7Validator(schema).iter_errors(yaml.safe_load(open(f)))\n"
        "  for e in errors: print(f, e.json_path, e.message)\n"
        "print('judged')\n");
    folder_.write("schema.json", scenarioSchema());
    const std::string command = "python3 " + (folder_ / "judge.py").string() + " " +
                                (folder_ / "schema.json").string() + " " + folder + " > " +
                                (folder_ / "out").string() + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << folder_.read("out");
    return folder_.read("out");
  }
  test::TemporaryFolder folder_;
};

TEST_F(SchemaValidator, accepts_the_shipped_scenarios) {
  EXPECT_EQ(judge(kData + "/scenarios"), "judged\n");
}

TEST_F(SchemaValidator, accepts_short_forms_and_refuses_what_the_reader_refuses) {
  const Scenario scenario = Scenario::load(kData + "/scenarios/unicycle-4dots.yaml");
  const std::string valid = scenario.toJson();
  const auto with = [&](const std::string& name, const std::string& from, const std::string& to) {
    std::string text = valid;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder_.write("some/" + name + ".yaml", text.replace(at, from.size(), to));
  };
  std::filesystem::create_directory(folder_ / "some");
  with("unknown", "\"seed\"", "\"sead\"");
  with("range", "\"duration\":30.0", "\"duration\":0");
  with("word", "\"unicycle\"", "\"unicycel\"");
  with("missing", "\"name\":\"unicycle-4dots\",", "");
  with("hidden", "\"hidden\":[]", "\"hidden\":[[1, 2, 3]]");
  folder_.write("some/fine.yaml",
                Scenario::load(kData + "/scenarios/unicycle-4dots.yaml",
                               {"sensing.hidden=[[1, 2]]", "depth.estimator=true", "expect=null"})
                    .toJson());
  const std::string said = judge((folder_ / "some").string());
  for (const char* name : {"unknown", "range", "word", "missing", "hidden"}) {
    EXPECT_NE(said.find(std::string("/") + name + ".yaml"), std::string::npos) << name << said;
  }
  EXPECT_EQ(said.find("/fine.yaml"), std::string::npos) << said;
}

TEST(ShippedScenarios, name_the_schema_in_their_first_line) {
  namespace fs = std::filesystem;
  for (const auto& entry : fs::recursive_directory_iterator(kData + "/scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    std::ifstream file(entry.path());
    std::string line, marker = "# yaml-language-server: $schema=";
    std::getline(file, line);
    ASSERT_EQ(line.rfind(marker, 0), 0u) << entry.path();
    const fs::path schema = entry.path().parent_path() / line.substr(marker.size());
    EXPECT_TRUE(fs::equivalent(schema, kData + "/scenarios/scenario.schema.json")) << schema;
  }
}

}  // namespace
}  // namespace depthservo
