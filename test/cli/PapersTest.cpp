#include <gtest/gtest.h>

#include <set>

#include "cli/Tool.h"

namespace depthservo::test {
namespace {

TEST(Reproduce, gives_rows_with_stable_ids_that_all_pass) {
  const Result result = depthservo("reproduce ibuki2023 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  std::set<std::string> ids;
  for (const auto& row : result.json()) {
    ids.insert(row["id"]);
    EXPECT_TRUE(row["ours"].is_number()) << row;
    EXPECT_TRUE(row["pass"].is_boolean() && row["reproduces"].is_boolean()) << row;
  }
  EXPECT_EQ(ids.size(), result.json().size());
  EXPECT_GE(ids.size(), 6u);
  EXPECT_EQ(depthservo("reproduce einstein1905").exitCode, 2);
}

TEST(Gains, of_the_paper_need_the_frame_rates_it_states) {
  const Result result = depthservo(
      "gains --law regulation --fps 30 --kc 6.5 --ke 1.7 --delta 0.95 --gamma 0.83 "
      "--kappa 1.41421356237 --U0 35.41789 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_NEAR(json["eq23"], 30.3903, 1e-4);
  EXPECT_NEAR(json["eq28a"], 59.6042, 1e-4);
  EXPECT_NEAR(json["eq28b"], 55.7196, 1e-4);
  EXPECT_NEAR(json["eq27"], 7.8168, 1e-4);
  EXPECT_EQ(json["satisfied"], false);
}

TEST(Gains, left_out_are_designed_for_the_frame_rate) {
  const Result result = depthservo("gains --law observer --fps 60 --kappa 0.5 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.json()["satisfied"], true);
  EXPECT_GT(result.json()["designed"]["ke"], 0);
  EXPECT_EQ(depthservo("gains --law observer --fps -60").exitCode, 2);
  EXPECT_EQ(depthservo("gains --law jedi --fps 60").exitCode, 2);
}

}  // namespace
}  // namespace depthservo::test
