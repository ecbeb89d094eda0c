#include <gtest/gtest.h>

#include "support/RandomStarts.h"

namespace depthservo {
namespace {

using namespace test;

TEST(RandomStarts, observedDepthIsAsGoodAsTheTruthFromAnyGuess) {
  constexpr unsigned kStarts = 200;
  const StartsOutcome truth = manyStarts(kStarts, UsedDepth::truth, 1);
  EXPECT_GE(truth.success, .99);
  for (const double guess : {.25, 4.}) {
    for (const UsedDepth depth : {UsedDepth::observed, UsedDepth::blended}) {
      SCOPED_TRACE(guess);
      SCOPED_TRACE(depth == UsedDepth::blended ? "blended" : "observed");
      const StartsOutcome outcome = manyStarts(kStarts, depth, guess);
      EXPECT_GE(outcome.success, truth.success - .02);
      EXPECT_NEAR(outcome.median_s, truth.median_s, .02 * truth.median_s);
      RecordProperty("median_s", std::to_string(outcome.median_s));
    }
    EXPECT_LT(manyStarts(50, UsedDepth::constant, guess).success, .6)
        << "what a wrong guess costs without";
  }
}

}  // namespace
}  // namespace depthservo
