// A target of known shape through the command line.
#include <gtest/gtest.h>

#include <cmath>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

class MovingPlate : public testing::Test {
 protected:
  void SetUp() override {
    record(data("scenarios/moving-target.yaml") + " --set duration=3 --set expect=null", sequence_);
  }
  TemporaryFolder folder_;
  std::string sequence_ = folder_ / "sequence";
};

TEST_F(MovingPlate, replays_with_the_right_depths_and_says_what_the_frame_rate_means) {
  const std::string out = folder_ / "out";
  const Result result = depthservo("replay " + sequence_ + " --estimator pose --json --out " + out);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  ASSERT_EQ(json["points"].size(), 4u);
  for (const auto& point : json["points"]) EXPECT_LT(point["relative_error"], 0.01) << point;
  EXPECT_EQ(json["frame_rate"]["verdict"], "likely");
  EXPECT_NE(folder_.read("out/report.html").find("Frame rate down to 30 Hz"), std::string::npos);
  const auto run = nlohmann::json::parse(folder_.read("out/run.json"));
  EXPECT_EQ(run["frame_rate"], json["frame_rate"]);
  EXPECT_FALSE(run["events"].empty());
}

TEST_F(MovingPlate, takes_a_gain) {
  const auto rate = [&](const std::string& options) {
    return depthservo("replay " + sequence_ + " --estimator pose --json" + options)
        .json()["frame_rate"];
  };
  EXPECT_EQ(rate(" --ke 4")["ke"], 4);
  EXPECT_EQ(rate(" --ke 4")["verdict"], "guaranteed");
  EXPECT_EQ(depthservo("replay " + sequence_ + " --ke 0").exitCode, 2);
  EXPECT_FALSE(depthservo("replay " + sequence_ + " --estimator filter --json")
                   .json()
                   .contains("frame_rate"));
}

TEST(KnownTarget, is_asked_for_when_a_sequence_has_none) {
  const TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  record(data("scenarios/unicycle-4dots.yaml") + " --set sensing.source=geometry --set duration=1",
         sequence);
  folder.write("sequence/sequence.yaml", "name: no-target\n");
  const Result result = depthservo("replay " + sequence + " --estimator pose");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.err.find("known target"), std::string::npos) << result.err;
}

TEST(Gains, likely_gain_is_the_best_of_lag_and_noise) {
  const Result result =
      depthservo("gains --law observer --fps 18 --kappa 0.02 --pose-noise 0.003 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const double ke = result.json()["likely"]["ke"], T = 1. / 18;
  const auto error2 = [T](double k) {
    return std::pow(.02 / k, 2) + std::pow(.003, 2) * k * T / (2 - k * T);
  };
  EXPECT_LE(ke, 9 + 1e-6);
  EXPECT_LE(error2(ke), error2(1.01 * ke) + (ke > 8.9 ? 1 : 0));
  EXPECT_LE(error2(ke), error2(.99 * ke));
  EXPECT_EQ(depthservo("gains --law observer --fps 18 --pose-noise 0.003").exitCode, 2);
}

}  // namespace
}  // namespace depthservo::test
