#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

/// Runs that last a second, many of them failures of one kind or another.
std::string shortSweep(int repeat) {
  return "name: short\ntitle: A short one\nscenario: " + data("scenarios/unicycle-4dots.yaml") +
         "\nset: [sensing.source=geometry, duration=1, expect=null, camera.rate=10]\n"
         "axes:\n"
         "  - {name: estimator, key: depth.estimator, values: [filter, constant]}\n"
         "  - {name: guess, key: depth.initial, from: 0.5, to: 50, count: 4, log: true}\n"
         "  - {name: start, count: 5, cone: {angle: 0.6, distance: [1.2, 4], aim: 0.3}}\n"
         "metrics: [duration_s, final_error_px, final_depth_error_max, final_distance_m, "
         "final_angle_rad]\nsuccess: [timeout, converged]\nworst: 1\nrepeat: " +
         std::to_string(repeat) + "\n";
}

class SweepTool : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_ / name; }
  Result sweep(const std::string& out, const std::string& more = "",
               const std::string& before = "") const {
    return depthservo("sweep " + file("s.yaml") + " --out " + file(out) + " " + more, before);
  }
  std::string csv(const std::string& out) const { return folder_.read(out + "/runs.csv"); }

  TemporaryFolder folder_;
};

TEST_F(SweepTool, gives_the_same_bytes_for_any_number_of_threads) {
  folder_.write("s.yaml", shortSweep(1));
  for (const char* jobs : {"1", "2", "5"}) {
    const Result result = sweep(jobs, std::string("--jobs ") + jobs);
    ASSERT_EQ(result.exitCode, 0) << result.err;
    EXPECT_EQ(csv(jobs), csv("1"));
    EXPECT_EQ(folder_.read(std::string(jobs) + "/map-1.svg"), folder_.read("1/map-1.svg"));
  }
  const auto table = readCsv(file("1/runs.csv"));
  EXPECT_EQ(table.at("row").size(), 40u);
  EXPECT_EQ(table.at("seed").size(), 40u);
  for (const std::string& outcome : table.at("outcome")) EXPECT_NE(outcome, "refused");
}

/// Twenty times, at any moment of its life: while it begins, stores, ends.
TEST_F(SweepTool, loses_nothing_and_does_nothing_twice_when_it_is_killed) {
  folder_.write("s.yaml", shortSweep(40));
  ASSERT_EQ(sweep("whole").exitCode, 0);
  std::mt19937 random(std::random_device{}());
  std::uniform_int_distribution<int> moment_ms(10, 250);
  int killed = 0;
  for (int i = 0; i < 20; ++i) {
    const std::string when = std::to_string(0.001 * moment_ms(random));
    const Result result = sweep("killed", "--jobs 1", "timeout -s KILL " + when);
    killed += result.exitCode == 137 ? 1 : 0;
  }
  EXPECT_GE(killed, 10) << "too fast a machine for this test: make the sweep longer";
  const Result last = sweep("killed");
  ASSERT_EQ(last.exitCode, 0) << last.err;
  EXPECT_EQ(csv("killed"), csv("whole"));
  const std::string whole = csv("whole");
  EXPECT_EQ(std::count(whole.begin(), whole.end(), '\n'), 1601);
  const Result again = sweep("killed");
  EXPECT_EQ(again.err.find(" per second"), std::string::npos) << "ran again: " << again.err;
}

TEST_F(SweepTool, ends_cleanly_at_ctrl_c_and_goes_on) {
  folder_.write("s.yaml", shortSweep(80));
  const std::string database = file("out/sweep.sqlite");
  for (const bool isNew : {true, false}) {
    const auto before = isNew ? 0 : std::filesystem::file_size(database);
    const Result stopped = depthservoInterrupted(
        "sweep " + file("s.yaml") + " --jobs 1 --out " + file("out"), SIGINT, [&] {
          return std::filesystem::exists(database) && std::filesystem::file_size(database) > before;
        });
    EXPECT_EQ(stopped.exitCode, 130);
    EXPECT_NE(stopped.err.find("the same command goes on"), std::string::npos) << stopped.err;
  }
  ASSERT_EQ(sweep("out").exitCode, 0);
  ASSERT_EQ(sweep("whole").exitCode, 0);
  EXPECT_EQ(csv("out"), csv("whole"));
}

TEST_F(SweepTool, merges_shards_in_any_order_and_one_of_them_twice) {
  folder_.write("s.yaml", shortSweep(1));
  ASSERT_EQ(sweep("whole").exitCode, 0);
  std::vector<std::string> shards;
  for (int i = 1; i <= 8; ++i) {
    const std::string n = std::to_string(i);
    ASSERT_EQ(sweep("shard" + n, "--shard " + n + "/8").exitCode, 0);
    shards.push_back(file("shard" + n));
  }
  shards.push_back(shards[2]);
  std::mt19937 random(1);
  for (const char* out : {"a", "b"}) {
    std::shuffle(shards.begin(), shards.end(), random);
    std::string names;
    for (const std::string& shard : shards) names += shard + " ";
    const Result merged = depthservo("merge " + names + "--out " + file(out));
    ASSERT_EQ(merged.exitCode, 0) << merged.err;
    EXPECT_EQ(csv(out), csv("whole"));
  }
  expectRefused(depthservo("merge " + shards[0] + " " + shards[1] + " --out " + file("c")),
                {"would lack", "name all shards"});
  folder_.write("s.yaml", shortSweep(1) + "seed: 2\n");
  ASSERT_EQ(sweep("other", "--shard 1/8").exitCode, 0);
  expectRefused(depthservo("merge " + shards[0] + " " + file("other") + " --out " + file("c")),
                {"another sweep"});
  expectRefused(sweep("whole"), {"whole", "another sweep"});
  EXPECT_FALSE(std::filesystem::exists(file("c")));
}

TEST_F(SweepTool, repeats_any_run_with_its_report) {
  folder_.write("s.yaml", shortSweep(1));
  ASSERT_EQ(sweep("out").exitCode, 0);
  const auto table = readCsv(file("out/runs.csv"));
  for (const std::size_t row : {0u, 17u, 39u}) {
    const std::string n = std::to_string(row);
    const Result run =
        depthservo("run --of " + file("out") + " --row " + n + " --json --out " + file("run" + n));
    const auto json = run.json();
    EXPECT_EQ(json["outcome"], table.at("outcome")[row]);
    EXPECT_EQ(std::to_string(json["seed"].get<unsigned>()), table.at("seed")[row]);
    for (const char* metric : {"duration_s", "final_error_px", "final_depth_error_max",
                               "final_distance_m", "final_angle_rad"}) {
      ASSERT_FALSE(table.at(metric)[row].empty());
      EXPECT_EQ(json["metrics"][metric].get<double>(), std::stod(table.at(metric)[row])) << metric;
    }
    EXPECT_TRUE(std::filesystem::exists(file("run" + n + "/report.html")));
  }
  expectRefused(depthservo("run --of " + file("out") + " --row 40"), {"--row", "0 to 39"});
  expectRefused(depthservo("run --of " + folder_.path().string() + " --row 1"), {"sweep.sqlite"});
}

TEST_F(SweepTool, judges_its_claims_and_refuses_bad_input_with_nothing_written) {
  const std::string claim = "claims: [{id: all, claim: all end well, expected: ";
  folder_.write("s.yaml", shortSweep(1) + claim + "1, within: '1'}]\n");
  EXPECT_EQ(sweep("good").exitCode, 0);
  folder_.write("s.yaml", shortSweep(1) + claim + "2, within: '0.5'}]\n");
  const Result bad = sweep("good", "--json");
  EXPECT_EQ(bad.exitCode, 1) << "claims may be changed afterwards";
  EXPECT_EQ(bad.json()["claims"][0]["pass"], false);

  folder_.write("s.yaml",
                "name: x\nscenario: unicycle-4dots\naxes: [{name: a, key: b, values: [1]}]\n");
  expectRefused(sweep("new"), {"s.yaml", "axes.a", "unknown key"});
  expectRefused(sweep("new", "--shard 9/8"), {"--shard", "1 <= i <= n"});
  expectRefused(depthservo("sweep latency-by-gian --out " + file("new")), {"latency-by-gain"});
  expectRefused(depthservo("sweep " + file("s.yaml")), {"--out"});
  EXPECT_FALSE(std::filesystem::exists(file("new")));
}

}  // namespace
}  // namespace depthservo::test
