// What is said of robots of which one thing errs, observed with the profile `typical`.
#include <gtest/gtest.h>

#include "support/OneSource.h"

namespace depthservo {
namespace {

using Cause = ConsistencyMonitor::Cause;
constexpr unsigned kRobots = 8;

class OneSource : public testing::TestWithParam<test::ErrorSource> {};

INSTANTIATE_TEST_SUITE_P(Sources, OneSource, testing::ValuesIn(test::errorSources()),
                         [](const auto& tested) {
                           std::string name = tested.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST_P(OneSource, of_everyday_size_is_no_fault) {
  int named = 0;
  for (unsigned seed = 100; seed < 100 + kRobots; ++seed) {
    named += test::diagnosed(GetParam(), 1, seed).cause != Cause::none;
  }
  EXPECT_LE(named, 1);  // robots are drawn: a mount may be off by more than the profile allows
}

TEST_P(OneSource, four_times_as_large_is_named_or_nothing_is) {
  const Cause cause = GetParam().cause;
  int named = 0;
  for (unsigned seed = 100; seed < 100 + kRobots; ++seed) {
    const auto d = test::diagnosed(GetParam(), 4, seed);
    if (d.cause == Cause::none) continue;
    EXPECT_TRUE(d.cause == cause || d.rival == cause) << seed << ": " << d.message();
    ++named;
  }
  const bool mustBeNamed = cause == Cause::latency || cause == Cause::gyroBias ||
                           cause == Cause::mount || cause == Cause::slip;
  if (mustBeNamed) {
    EXPECT_GE(named, 6);
  }
}

}  // namespace
}  // namespace depthservo
