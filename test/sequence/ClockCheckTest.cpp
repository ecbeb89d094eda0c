#include <gtest/gtest.h>

#include "depthservo/sequence/ClockCheck.h"

namespace depthservo {
namespace {

std::vector<double> times(double from, double to, double period) {
  std::vector<double> list;
  for (int i = 0; from + i * period < to + 1e-9; ++i) list.push_back(from + i * period);
  return list;
}

testing::AssertionResult tells(const ClockCheck& check, const std::vector<std::string>& words) {
  for (const std::string& finding : check.findings) {
    bool hasAll = true;
    for (const std::string& word : words)
      hasAll = hasAll && finding.find(word) != std::string::npos;
    if (hasAll) return testing::AssertionSuccess();
  }
  auto failure = testing::AssertionFailure() << "not among the findings:";
  for (const std::string& finding : check.findings) failure << " [" << finding << "]";
  return failure;
}

TEST(ClockCheck, has_nothing_to_say_of_odometry_that_covers_the_images) {
  for (const double epoch : {0., 1.7e9}) {
    const ClockCheck check =
        describeClocks(times(epoch + 1, epoch + 5, 0.04), times(epoch, epoch + 5, 0.02));
    EXPECT_TRUE(check.overlaps);
    EXPECT_TRUE(check.findings.empty()) << check.findings[0];
    EXPECT_TRUE(check.holes.empty());
    EXPECT_EQ(check.missingBefore_s, 0);
    EXPECT_EQ(check.missingAfter_s, 0);
  }
  // The last row holds for one more period; one second between poses is no hole.
  EXPECT_TRUE(describeClocks({0, 1, 2, 2.9}, {0, 1, 2}).findings.empty());
  EXPECT_TRUE(describeClocks({0.5}, {0.5}).overlaps);
}

TEST(ClockCheck, tells_both_spans_when_they_do_not_overlap) {
  const ClockCheck check = describeClocks(times(20, 22.5, 0.1), times(1.6e9, 1.6e9 + 3, 0.1));
  EXPECT_FALSE(check.overlaps);
  EXPECT_TRUE(tells(check, {"20 to 22.5 s", "1600000000", "overlap", "clock"}));
  EXPECT_FALSE(tells(check, {"milliseconds"}));
  EXPECT_FALSE(describeClocks(times(0, 2, 0.1), times(-9, -1, 0.1)).overlaps);
}

TEST(ClockCheck, names_the_unit_that_would_bring_them_together) {
  EXPECT_TRUE(tells(describeClocks(times(100, 110, 0.1), times(99e3, 111e3, 20)),
                    {"overlap", "the odometry were milliseconds"}));
  EXPECT_TRUE(tells(describeClocks(times(50e6, 58e6, 4e4), times(50, 60, 0.02)),
                    {"overlap", "images' times were microseconds"}));
}

TEST(ClockCheck, tells_what_part_of_the_images_has_no_odometry) {
  const ClockCheck check = describeClocks(times(0, 10, 0.05), times(1.5, 8, 0.1), "ground truth");
  EXPECT_TRUE(check.overlaps);
  EXPECT_NEAR(check.missingBefore_s, 1.5, 1e-9);
  EXPECT_NEAR(check.missingAfter_s, 1.9, 1e-9);
  EXPECT_TRUE(tells(check, {"ground truth begins at 1.5 s", "1.5 s after"}));
  EXPECT_TRUE(tells(check, {"ground truth ends at 8 s", "2 s before the images"}));
}

TEST(ClockCheck, tells_holes_longer_than_four_periods_and_40_ms) {
  std::vector<double> rows = times(0, 2, 0.01);
  for (const double t : times(2.045, 4, 0.01)) rows.push_back(t);  // 45 ms: a hole
  for (const double t : times(4.03, 5, 0.01)) rows.push_back(t);   // 35 ms: none
  for (const double t : times(7.5, 9, 0.01)) rows.push_back(t);
  const ClockCheck check = describeClocks(times(0, 9, 0.1), rows);
  ASSERT_EQ(check.holes.size(), 2u);
  EXPECT_NEAR(check.holes[0].from_s, 2, 1e-9);
  EXPECT_NEAR(check.holes[1].to_s, 7.5, 1e-9);
  EXPECT_TRUE(tells(check, {"no odometry", "to 7.5 s"}));
  EXPECT_TRUE(describeClocks(times(0, 1.5, 0.1), rows).holes.empty());  // not of these images
  std::vector<double> slow = times(0, 2, 0.5);
  slow.push_back(4.1);
  EXPECT_EQ(holesOf(slow).size(), 1u);
  slow.back() = 3.9;
  EXPECT_TRUE(holesOf(slow).empty());
}

TEST(ClockCheck, counts_the_holes_it_does_not_list) {
  std::vector<double> rows;
  for (int burst = 0; burst < 9; ++burst) {
    for (int i = 0; i < 20; ++i) rows.push_back(burst + 0.01 * i);
  }
  const ClockCheck check = describeClocks(times(0, 8, 0.1), rows);
  EXPECT_EQ(check.holes.size(), 8u);
  EXPECT_EQ(check.findings.size(), 4u);
  EXPECT_TRUE(tells(check, {"5 more"}));
}

TEST(ClockCheck, asks_for_the_unit_of_times_that_are_too_far_apart) {
  EXPECT_TRUE(
      tells(describeClocks(times(0, 3000, 50), times(0, 3000, 10)), {"images", "millisec"}));
  EXPECT_TRUE(
      tells(describeClocks(times(0, 3, 0.05), times(0, 3e6, 2e4)), {"odometry", "microsec"}));
  EXPECT_TRUE(tells(describeClocks(times(0, 2e9, 4e7), times(0, 2e9, 4e7)), {"images", "nanosec"}));
  EXPECT_TRUE(
      tells(describeClocks(times(0, 2e-6, 4e-8), times(0, 1, 0.1)), {"images", "seconds?"}));
  EXPECT_TRUE(describeClocks(times(0, 20, 2), times(0, 20, 2)).findings.empty());
}

}  // namespace
}  // namespace depthservo
