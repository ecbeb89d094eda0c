#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "depthservo/experiments/Compare.h"

namespace depthservo {
namespace {

ComparedEstimator estimator(const std::string& name, double rms, double median, double coverage) {
  ComparedEstimator one;
  one.name = name;
  one.error = {1, rms};
  one.sigma = {1, rms};
  one.difference = {0, 0};
  one.median_error = {kUnknown, median};
  one.median_sigma = {kUnknown, median};
  one.median_difference = {kUnknown, 0};
  one.within_5pct = {kUnknown, 0.75};
  one.coverage_2sigma = coverage;
  return one;
}

Comparison example() {
  Comparison comparison;
  comparison.name = "example";
  comparison.points = 4;
  comparison.hasTruth = true;
  comparison.reference = "filter";
  comparison.time_s = {0, 2};
  comparison.shown = {0, 1};
  comparison.estimators = {estimator("constant", 2540.4, 0.5, 0.2),
                           estimator("filter", 0.01, 0.002, 0.95)};
  return comparison;
}

TEST(Comparison, begins_with_who_is_nearest_and_whose_sigma_is_honest) {
  const std::string verdict = verdictOf(example());
  EXPECT_EQ(verdict.rfind("Nearest to the truth at the end: filter 1 %; farthest: constant", 0), 0u)
      << verdict;
  EXPECT_NE(verdict.find("90 % or more: filter"), std::string::npos) << verdict;
  EXPECT_NE(verdict.find("Sigma too small: constant"), std::string::npos) << verdict;
}

TEST(Comparison, without_truth_says_that_nobody_knows_who_is_right) {
  Comparison comparison = example();
  comparison.hasTruth = false;
  const std::string verdict = verdictOf(comparison);
  EXPECT_EQ(verdict.find("Nearest"), std::string::npos);
  EXPECT_NE(verdict.find("nobody knows who is right"), std::string::npos) << verdict;
}

TEST(Comparison, of_points_that_come_and_go_shows_medians_of_the_inverse_depth_and_says_so) {
  Comparison comparison = example();
  EXPECT_EQ(shownStatistic(comparison).error, &ComparedEstimator::error);
  comparison.pointsComeAndGo = true;
  const ShownStatistic shown = shownStatistic(comparison);
  EXPECT_EQ(shown.error, &ComparedEstimator::median_error);
  EXPECT_EQ(shown.ofError, "error of 1/Z, relative, median over the points known for a second");
  EXPECT_NE(verdictOf(comparison).find("filter 0.2 %"), std::string::npos);
}

TEST(Comparison, has_the_old_figures_and_the_new_ones_in_json) {
  const auto json = nlohmann::json::parse(toJson(example()));
  const auto& filter = json["estimators"][1];
  EXPECT_EQ(filter["relative_error"][1], 0.01);
  EXPECT_EQ(filter["median_error"][1], 0.002);
  EXPECT_TRUE(filter["median_error"][0].is_null());
  EXPECT_EQ(filter["within_5pct"][1], 0.75);
  EXPECT_EQ(json["points_come_and_go"], false);
}

}  // namespace
}  // namespace depthservo
