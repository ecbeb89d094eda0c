#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "depthservo/experiments/Sweep.h"
#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/rig/SimulatedRig.h"
#include "depthservo/text/InputError.h"
#include "experiments/Draws.h"
#include "experiments/SweepTable.h"
#include "experiments/sweepStarts.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

/// A sweep of the shipped scenario with these axes and other lines.
Sweep sweepOf(const std::string& axes, const std::string& rest = "",
              const std::string& scenario = "unicycle-4dots") {
  const TemporaryFolder folder;
  const std::string file = folder / "sweep.yaml";
  folder.write("sweep.yaml", "name: s\nscenario: " + scenario +
                                 "\nset: [sensing.source=geometry, duration=1, expect=null]\n" +
                                 rest + "\naxes:\n" + axes);
  return Sweep::load(file, [](const std::string& name) {
    return std::string(DEPTHSERVO_DATA) + "/scenarios/" + name + ".yaml";
  });
}

const std::string kGuesses =
    "  - {name: guess, key: depth.initial, from: 1, to: 100, count: 3, log: true}\n";
const std::string kEstimators =
    "  - {name: estimator, key: depth.estimator, values: [filter, constant]}\n";

TEST(Sweep, runs_every_combination_once_with_the_first_axis_slowest) {
  const Sweep sweep = sweepOf(kEstimators + kGuesses, "repeat: 2");
  ASSERT_EQ(sweep.size(), 2u * 3u * 2u);
  EXPECT_EQ(sweep.columns(), (std::vector<std::string>{"estimator", "guess", "repeat"}));
  std::set<std::vector<std::string>> cells;
  for (std::size_t i = 0; i < sweep.size(); ++i) cells.insert(sweep.row(i).cells);
  EXPECT_EQ(cells.size(), sweep.size());
  EXPECT_EQ(sweep.row(3).cells, (std::vector<std::string>{"filter", "10", "1"}));
  EXPECT_EQ(sweep.row(6).cells, (std::vector<std::string>{"constant", "1", "0"}));
  EXPECT_EQ(sweep.scenario(sweep.row(3)).depth.initial, 10);
}

TEST(Sweep, seeds_each_run_by_its_coordinates_so_that_a_value_more_changes_no_other_run) {
  const Sweep sweep = sweepOf(kEstimators + kGuesses, "repeat: 2");
  const Sweep more = sweepOf(
      "  - {name: estimator, key: depth.estimator, values: [joint, filter, constant]}\n" + kGuesses,
      "repeat: 3");
  std::set<unsigned> seeds;
  for (std::size_t i = 0; i < sweep.size(); ++i) {
    const Sweep::Row row = sweep.row(i);
    seeds.insert(row.seed);
    EXPECT_EQ(sweep.scenario(row).seed, row.seed);
    bool isFound = false;
    for (std::size_t k = 0; k < more.size(); ++k) {
      if (more.row(k).cells != row.cells) continue;
      isFound = true;
      EXPECT_EQ(more.row(k).seed, row.seed);
    }
    EXPECT_TRUE(isFound);
  }
  EXPECT_EQ(seeds.size(), sweep.size());
}

TEST(Sweep, gives_runs_the_same_noise_that_differ_in_other_axes_only) {
  const Sweep sweep = sweepOf(kEstimators + kGuesses, "seeded_by: [guess]");
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(sweep.row(i).seed, sweep.row(i + 3).seed);
  EXPECT_NE(sweep.row(0).seed, sweep.row(1).seed);
  const Sweep given = sweepOf("  - {name: seed1, key: seed, values: [7, 8]}\n");
  EXPECT_EQ(given.row(1).seed, 8u);
}

TEST(Sweep, draws_by_seed_and_name_of_the_axis_and_within_its_range) {
  const auto drawn = [](const std::string& name, const std::string& rest) {
    const Sweep sweep = sweepOf(
        "  - {name: " + name + ", key: depth.initial, draw: uniform, from: 2, to: 3, count: 50}\n",
        rest);
    std::vector<double> values;
    for (std::size_t i = 0; i < sweep.size(); ++i) {
      values.push_back(sweep.scenario(sweep.row(i)).depth.initial);
      EXPECT_GE(values.back(), 2);
      EXPECT_LE(values.back(), 3);
    }
    return values;
  };
  const auto values = drawn("a", "");
  EXPECT_EQ(std::set<double>(values.begin(), values.end()).size(), 50u);
  EXPECT_EQ(values, drawn("a", ""));
  EXPECT_NE(values, drawn("b", ""));
  EXPECT_NE(values, drawn("a", "seed: 2"));
}

TEST(Draws, have_the_moments_of_their_distribution) {
  constexpr int kCount = 20000;
  Draws draws("moments");
  double sum = 0, squares = 0, even = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = draws.normal(3, 2);
    sum += x;
    squares += (x - 3) * (x - 3);
    even += draws.uniform(-1, 1);
  }
  const double root = std::sqrt(kCount);
  EXPECT_NEAR(sum / kCount, 3, 4 * 2 / root);
  EXPECT_NEAR(squares / kCount, 4, 4 * 4 * std::sqrt(2.) / root);
  EXPECT_NEAR(even / kCount, 0, 4 * std::sqrt(1. / 3) / root);
}

class StartPoses : public testing::TestWithParam<const char*> {};

/// The target is where the start says, worked out from the camera that the simulation builds.
TEST_P(StartPoses, put_the_camera_where_they_say) {
  const Sweep sweep = sweepOf(
      "  - {name: d, key: start.distance, values: [1.5, 2.5]}\n"
      "  - {name: b, key: start.bearing, values: [-0.4, 0, 0.3]}\n"
      "  - {name: a, key: start.aim, values: [0, 0.1]}\n",
      "", GetParam());
  for (std::size_t i = 0; i < sweep.size(); ++i) {
    const auto cells = sweep.row(i).cells;
    const double distance = std::stod(cells[0]), bearing = std::stod(cells[1]),
                 aim = std::stod(cells[2]);
    const Scenario scenario = sweep.scenario(sweep.row(i));
    const SimulatedRig rig(scenario);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    const auto truth = rig.truth();
    for (const TruePoint& p : truth) {
      middle += p.Z * scenario.camera.pinhole().normalise(p.u, p.v).homogeneous() /
                static_cast<double>(truth.size());
    }
    EXPECT_NEAR(std::hypot(middle.x(), middle.z()), distance, 1e-6);
    EXPECT_NEAR(std::atan2(middle.x(), middle.z()), aim, 1e-6)
        << "to the left: it is right of the axis";
    // Counter-clockwise from above: to the right of who looks at the plate, whose right end is
    // nearer then.
    const double slant = truth[1].Z - truth[0].Z;
    if (bearing != 0) {
      EXPECT_LT(slant * bearing, 0) << bearing;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Robots, StartPoses, testing::Values("unicycle-4dots", "free-general"));

TEST(StartPoses, of_a_cone_see_the_whole_target) {
  for (const char* scenario : {"unicycle-4dots", "free-general"}) {
    const Sweep sweep = sweepOf(
        "  - {name: start, count: 60, cone: {angle: 0.6, distance: [1.5, 4], aim: 0.4, margin: "
        "5}}\n",
        "", scenario);
    double nearest = 9, farthest = 0;
    for (std::size_t i = 0; i < sweep.size(); ++i) {
      const auto cells = sweep.row(i).cells;
      nearest = std::min(nearest, std::stod(cells[1]));
      farthest = std::max(farthest, std::stod(cells[1]));
      const Scenario started = sweep.scenario(sweep.row(i));
      for (const TruePoint& p : SimulatedRig(started).truth()) {
        EXPECT_GT(p.u, 4.9);
        EXPECT_LT(p.u, started.camera.width - 5.9);
        EXPECT_GT(p.v, 4.9);
        EXPECT_LT(p.v, started.camera.height - 5.9);
      }
    }
    EXPECT_LT(nearest, 1.9) << scenario;
    EXPECT_GT(farthest, 3.6) << scenario;
  }
}

TEST(Sweep, refuses_what_cannot_be_run_and_says_where) {
  const struct {
    const char *axes, *rest, *key, *words;
  } cases[] = {
      {"  - {name: g, key: depth.initial, values: [1, -2]}\n", "", "axes.g", "-2"},
      {"  - {name: g, key: depth.inital, values: [1]}\n", "", "axes.g", "depth.initial"},
      {"  - {name: g, key: start.distant, values: [1]}\n", "", "axes.g", "start.distance"},
      {"  - {name: g, key: depth.initial}\n", "", "axes.g", "exactly one of"},
      {"  - {name: g, key: depth.initial, values: [1], from: 1, to: 2, count: 2}\n", "", "axes.g",
       "exactly one of"},
      {"  - {name: g, key: depth.initial, from: 1, to: 2}\n", "", "axes.g", "count"},
      {"  - {name: g, key: depth.initial, values: [1, 1.0]}\n", "", "axes.g", "twice"},
      {"  - {name: seed, key: depth.initial, values: [1]}\n", "", "axes", "seed"},
      {"  - {name: g h, key: depth.initial, values: [1]}\n", "", "axes.g h", "letters"},
      {"  - {name: g, count: 2, cone: {angle: 0.5, distance: [0.05, 0.1]}}\n", "", "axes.g",
       "not seen"},
      {"  - {name: g, key: depth.initial, values: [1]}\n", "metrics: [final_eror_px]", "metrics",
       "final_error_px"},
      {"  - {name: g, key: depth.initial, values: [1]}\n", "maps: [{x: g, y: h}]", "maps.y", "'g'"},
      {"  - {name: g, key: depth.initial, values: [1]}\n", "success: [won]", "success",
       "converged"},
      {"  - {name: g, key: depth.initial, values: [1]}\n",
       "claims: [{id: c, claim: x, expected: 1, within: near}]", "claims.c.within", "factor"},
      {"  - {name: g, key: depth.initial, values: [1]}\n", "repeat: 0", "repeat", "1"},
      {"  - {name: g, key: depth.initial, values: [1]}\n", "gess: 1", "gess", "nearest"},
  };
  for (const auto& c : cases) {
    try {
      sweepOf(c.axes, c.rest);
      ADD_FAILURE() << c.axes << c.rest;
    } catch (const InputError& error) {
      EXPECT_EQ(error.key(), c.key) << error.what();
      EXPECT_NE(std::string(error.what()).find(c.words), std::string::npos) << error.what();
    }
  }
}

/// Wilson 1927, with the figures of Newcombe 1998, table I.
TEST(Successes, have_the_score_interval_of_the_literature) {
  const struct {
    std::size_t successes, runs;
    double low, high;
  } cases[] = {{81, 263, 0.2553, 0.3662},
               {15, 148, 0.0624, 0.1605},
               {0, 20, 0, 0.1611},
               {1, 29, 0.0061, 0.1718},
               {29, 29, 0.8830, 1}};
  for (const auto& c : cases) {
    const auto [low, high] = Successes{c.successes, c.runs}.interval();
    EXPECT_NEAR(low, c.low, 5e-5);
    EXPECT_NEAR(high, c.high, 5e-5);
  }
}

TEST(SweepShard, has_each_run_in_exactly_one_of_them) {
  for (const std::size_t runs : {0, 1, 7, 8, 9, 100}) {
    std::size_t sum = 0;
    for (std::size_t i = 1; i <= 8; ++i) {
      const SweepShard shard{i, 8};
      std::size_t mine = 0;
      for (std::size_t row = 0; row < runs; ++row) mine += shard.has(row) ? 1 : 0;
      EXPECT_EQ(mine, shard.sizeOf(runs));
      sum += mine;
    }
    EXPECT_EQ(sum, runs);
  }
}

std::string contents(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(ShippedSweeps, are_whole_and_their_keys_stand_in_the_documentation) {
  const std::string folder = std::string(DEPTHSERVO_DATA) + "/sweeps";
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(Sweep::load(entry.path(), [](const std::string& name) { return name; }))
        << entry.path();
    ++count;
  }
  EXPECT_GE(count, 3);
  EXPECT_NE(
      contents(std::string(DEPTHSERVO_DATA) + "/../doc/formats.md").find(sweepKeysAsMarkdown()),
      std::string::npos)
      << "write it anew: depthservo keys --sweep --markdown";
  EXPECT_EQ(contents(folder + "/sweep.schema.json"), sweepSchema())
      << "write it anew: depthservo keys --sweep --schema > data/sweeps/sweep.schema.json";
}

}  // namespace
}  // namespace depthservo::test
