#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

std::string shipped(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(data(name)).rdbuf();
  return text.str();
}

TEST(Regress, tells_which_scenarios_do_not_come_to_what_they_expect) {
  const TemporaryFolder folder;
  const std::string text = shipped("scenarios/faults/no-motion.yaml");
  folder.write("a.yaml", text);
  const std::size_t at = text.find("expect:");
  ASSERT_NE(at, std::string::npos);
  folder.write("b.yaml", text.substr(0, at) + "expect: {outcome: lost, valid: [4, 4]}\n");
  folder.write("notes.txt", "no scenario\n");
  const Result one = depthservo("regress " + (folder / "a.yaml").string());
  EXPECT_EQ(one.exitCode, 0) << one.err;
  const Result both = depthservo("regress --json " + folder.path().string());
  EXPECT_EQ(both.exitCode, 1);
  EXPECT_EQ(both.err, "1 of 2 scenarios are as expected\n");
  const auto rows = both.json();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0]["pass"], true);
  EXPECT_TRUE(rows[0]["coverage_2sigma"].is_null()) << "nothing was claimed";
  EXPECT_EQ(rows[1]["pass"], false);
  EXPECT_EQ(rows[1]["unmet"],
            nlohmann::json({"expected lost, got timeout", "expected 4 to 4 valid depths, got 0"}));
}

TEST(Regress, refuses_what_expects_nothing) {
  const TemporaryFolder folder;
  expectRefused(depthservo("regress " + folder.path().string()), {"has no scenarios"});
  const std::string text = shipped("scenarios/faults/no-motion.yaml");
  folder.write("a.yaml", text.substr(0, text.find("expect:")));
  const Result result = depthservo("regress --json " + (folder / "a.yaml").string());
  expectRefused(result, {"a.yaml", "expect", "is missing"});
}

}  // namespace
}  // namespace depthservo::test
