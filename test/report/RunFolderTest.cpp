#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/text/InputError.h"
#include "support/TemporaryFolder.h"
#include "support/exampleLog.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::TemporaryFolder;

std::vector<std::vector<std::string>> rowsOf(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream cells(line + ',');
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

TEST(Metrics, say_what_happened_to_the_example) {
  const RunLog log = test::exampleLog();
  const Metrics metrics = computeMetrics(log);
  EXPECT_DOUBLE_EQ(metrics.duration_s, 12);
  EXPECT_EQ(metrics.frames, 361u);
  // The image error is that of the mean positions over the last two seconds.
  double squared = 0;
  for (std::size_t id = 0; id < 4; ++id) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
    for (const FrameRecord& frame : log.frames) {
      if (frame.time_s < log.frames.back().time_s - 2 - 1e-6) continue;
      sum += Eigen::Vector2d(frame.features[id].u, frame.features[id].v) - log.goals[id];
      ++count;
    }
    squared += (sum / count).squaredNorm() / 4;
  }
  EXPECT_NEAR(metrics.final_error_px, std::sqrt(squared), 1e-9);
  // Point 2 is last seen at 149/30 s and seen again at 6 s.
  EXPECT_NEAR(metrics.max_gap_s, 6 - 149 / 30.0, 1e-9);
  EXPECT_TRUE(metrics.all_in_image);
  ASSERT_EQ(metrics.points.size(), 4u);
  EXPECT_EQ(metrics.points[2].hidden_frames, 30u);
  EXPECT_EQ(metrics.points[2].measured_frames, 331u);
  EXPECT_EQ(metrics.points[0].hidden_frames, 0u);
  EXPECT_NEAR(metrics.points[0].relative_error, 0.008, 1e-4);
  EXPECT_NEAR(metrics.final_depth_error_max, 0.008, 1e-4);
}

TEST(Metrics, see_a_dot_that_leaves_the_image_while_hidden) {
  RunLog log = test::exampleLog();
  FeatureRecord& hidden = log.frames[160].features[2];
  ASSERT_FALSE(hidden.measured);
  hidden.u_true = -3.5;
  const Metrics metrics = computeMetrics(log);
  EXPECT_FALSE(metrics.all_in_image);
  EXPECT_DOUBLE_EQ(metrics.min_border_px, -3);
}

TEST(Metrics, count_coverage_in_inverse_depth_and_only_where_a_depth_is_claimed) {
  RunLog log = test::exampleLog(4);
  for (FrameRecord& frame : log.frames) frame.features.resize(1);
  const auto set = [&](std::size_t frame, double chi, DepthStatus status) {
    FeatureRecord& feature = log.frames[frame].features[0];
    feature.Z_true = 2;
    feature.estimate.chi = chi;
    feature.estimate.sigma_chi = 0.1;
    feature.estimate.status = status;
  };
  set(0, 0.69, DepthStatus::converging);  // within 2 sigma of 1/2
  set(1, 0.71, DepthStatus::valid);       // not
  set(2, 0.31, DepthStatus::valid);       // within
  set(3, 0.90, DepthStatus::coasting);    // claims nothing
  EXPECT_DOUBLE_EQ(computeMetrics(log).coverage_2sigma, 2.0 / 3);
}

TEST(Metrics, of_an_empty_log_are_unknown) {
  const Metrics metrics = computeMetrics(RunLog{});
  EXPECT_EQ(metrics.frames, 0u);
  EXPECT_FALSE(metrics.all_in_image);
  EXPECT_TRUE(json::parse(toJson(RunLog{}))["metrics"]["min_border_px"].is_null());
}

/// Left by 3 cm and 0.4 rad.
TEST(Metrics, of_the_way_left_are_those_of_the_camera_and_say_why_of_a_converged_run) {
  RunLog log = test::exampleLog(4);
  log.cdMc = Eigen::Isometry3d(Eigen::Translation3d(0.01, -0.02, 0.02) *
                               Eigen::AngleAxisd(-0.4, Eigen::Vector3d(1, 2, 2) / 3));
  const Metrics metrics = computeMetrics(log);
  EXPECT_NEAR(metrics.final_distance_m, 0.03, 1e-15);
  EXPECT_NEAR(metrics.final_angle_rad, 0.4, 1e-15);
  EXPECT_EQ(wayLeft(log, metrics).find("30.0 mm and 23 deg from its goal: two velocities"), 0u);
  log.commandNames.resize(6);
  EXPECT_EQ(wayLeft(log, metrics),
            "30.0 mm and 23 deg from its goal: what is left shows little in the image");
  log.outcome = Outcome::stalled;
  EXPECT_EQ(wayLeft(log, metrics), "30.0 mm and 23 deg from its goal") << "`reason` says why";
  log.outcome = Outcome::converged;
  log.cdMc->setIdentity();
  EXPECT_EQ(wayLeft(log, computeMetrics(log)), "0.0 mm and 0.00 deg from its goal");
  log.cdMc.reset();
  EXPECT_EQ(wayLeft(log, computeMetrics(log)), "");
}

TEST(ToJson, has_an_outcome_for_a_run_only_and_null_for_the_unknown) {
  const json run = json::parse(toJson(test::exampleLog()));
  EXPECT_EQ(run["command"], "run");
  EXPECT_EQ(run["outcome"], "converged");
  EXPECT_EQ(run["seed"], 7);
  EXPECT_EQ(run["points"].size(), 4u);
  const json replay = json::parse(toJson(test::exampleReplay()));
  EXPECT_FALSE(replay.contains("outcome"));
  EXPECT_TRUE(replay["metrics"]["final_error_px"].is_null());
  EXPECT_TRUE(replay["metrics"]["final_depth_error_max"].is_null());
  EXPECT_TRUE(replay.at("way_left").is_null());
  EXPECT_TRUE(replay["metrics"].at("final_distance_m").is_null());
  EXPECT_TRUE(replay["metrics"].at("final_angle_rad").is_null());
  EXPECT_TRUE(replay["metrics"]["coverage_2sigma"].is_null());
  EXPECT_TRUE(replay["points"][0]["Z_true"].is_null());
}

TEST(RunFolder, features_csv_has_every_point_in_every_frame_and_reads_back_exactly) {
  const TemporaryFolder place;
  RunLog log = test::exampleLog(31);
  log.frames[3].features[1].estimate.chi = 0.01;  // may be arbitrarily far
  log.frames[3].features[1].estimate.sigma_chi = 0.1;
  log.frames[0].features[3].estimate.status = DepthStatus::unset;  // not seen yet
  log.frames[1].features[2].frames_to_5pct = 24;
  writeRunFolder(log, place / "run");
  const auto rows = rowsOf(place.read("run/features.csv"));
  EXPECT_EQ(rows[0], (std::vector<std::string>{"timestamp", "id", "u", "v", "measured", "Z",
                                               "sigma_Z", "status", "Z_true", "Z_low", "Z_high",
                                               "excitation", "frames_to_5pct", "sigma_uv"}));
  ASSERT_EQ(rows.size(), 1 + 31 * 4 - 1u);
  const FeatureRecord& feature = log.frames[1].features[2];
  const auto& row = rows[1 + 3 + 2];
  EXPECT_EQ(row[0], "0.033333333");
  EXPECT_EQ(row[1], "2");
  EXPECT_EQ(std::stod(row[2]), feature.u);
  EXPECT_EQ(row[4], "1");
  EXPECT_EQ(std::stod(row[5]), feature.estimate.Z());
  EXPECT_EQ(std::stod(row[6]), feature.estimate.sigma_Z());
  EXPECT_EQ(row[7], "converging");
  EXPECT_EQ(std::stod(row[8]), feature.Z_true);
  EXPECT_EQ(row[12], "24");
  const auto& far = rows[1 + 11 + 1];
  EXPECT_EQ(far[10], "");
  EXPECT_EQ(std::stod(far[5]), 100);
}

TEST(RunFolder, depths_csv_has_a_row_per_image_and_columns_by_point) {
  const TemporaryFolder place;
  RunLog log = test::exampleLog(31);
  log.frames[0].features[3].estimate.status = DepthStatus::unset;  // not seen yet
  log.frames[2].features[1].Z_true = kUnknown;
  writeRunFolder(log, place / "run");
  const auto rows = rowsOf(place.read("run/depths.csv"));
  ASSERT_EQ(rows.size(), 1 + 31u);
  EXPECT_EQ(rows[0], (std::vector<std::string>{"timestamp", "Z_0", "sigma_Z_0", "Z_true_0", "Z_1",
                                               "sigma_Z_1", "Z_true_1", "Z_2", "sigma_Z_2",
                                               "Z_true_2", "Z_3", "sigma_Z_3", "Z_true_3"}));
  EXPECT_EQ(rows[1][10], "");
  EXPECT_NE(rows[2][10], "");
  EXPECT_EQ(rows[3][6], "");
  const FeatureRecord& feature = log.frames[2].features[2];
  EXPECT_EQ(rows[3][0], "0.066666667");
  EXPECT_EQ(std::stod(rows[3][7]), feature.estimate.Z());
  EXPECT_EQ(std::stod(rows[3][8]), feature.estimate.sigma_Z());
  EXPECT_EQ(std::stod(rows[3][9]), feature.Z_true);
}

TEST(RunFolder, depths_are_finite_and_positive_whatever_the_log_says) {
  const TemporaryFolder place;
  RunLog log = test::exampleLog(3);
  const double infinity = std::numeric_limits<double>::infinity();
  log.frames[1].features[0].estimate.chi = kUnknown;
  log.frames[1].features[1].estimate.chi = 0;
  log.frames[1].features[2].estimate.sigma_chi = infinity;
  log.frames[1].features[3].estimate.chi = -1;
  log.frames[2].features[0].u = infinity;
  writeRunFolder(log, place / "run");
  const auto rows = rowsOf(place.read("run/features.csv"));
  ASSERT_EQ(rows.size(), 13u);
  for (std::size_t i = 1; i < rows.size(); ++i) {
    EXPECT_GT(std::stod(rows[i][5]), 0);
    EXPECT_TRUE(std::isfinite(std::stod(rows[i][5])) && std::isfinite(std::stod(rows[i][6])));
  }
  EXPECT_EQ(rows[5][7], "lost");
  EXPECT_EQ(rows[9][2], "");
}

TEST(RunFolder, frames_csv_has_one_row_per_frame_with_what_was_asked_and_applied) {
  const TemporaryFolder place;
  const RunLog log = test::exampleLog(31);
  writeRunFolder(log, place / "run");
  const auto rows = rowsOf(place.read("run/frames.csv"));
  EXPECT_EQ(rows[0],
            (std::vector<std::string>{"timestamp", "error_px", "measured", "command_v", "command_w",
                                      "applied_v", "applied_w", "vx", "vy", "vz", "wx", "wy", "wz",
                                      "robot_x", "robot_y", "robot_theta"}));
  ASSERT_EQ(rows.size(), 32u);
  EXPECT_EQ(std::stod(rows[5][3]), log.frames[4].command[0]);
  EXPECT_EQ(std::stod(rows[5][5]), log.frames[4].applied[0]);
  EXPECT_EQ(std::stod(rows[5][13]), log.frames[4].robotPose[0]);
}

TEST(RunFolder, of_a_replay_has_no_commands_and_leaves_the_unknown_empty) {
  const TemporaryFolder place;
  writeRunFolder(test::exampleReplay(), place / "run");
  const auto rows = rowsOf(place.read("run/frames.csv"));
  EXPECT_EQ(rows[0].size(), 12u);
  EXPECT_EQ(rows[1][0], "1305031102.175303936");  // the nearest double
  EXPECT_EQ(rows[1][1], "");
  EXPECT_EQ(rows[1][11], "");
  EXPECT_EQ(rowsOf(place.read("run/features.csv"))[1][8], "");
}

TEST(RunFolder, run_json_has_configuration_versions_and_metrics) {
  const TemporaryFolder place;
  writeRunFolder(test::exampleLog(), place / "run");
  const json run = json::parse(place.read("run/run.json"));
  EXPECT_EQ(run["outcome"], "converged");
  EXPECT_EQ(run["configuration"]["robot"]["goal"]["x"], -1);
  EXPECT_EQ(run["events"][0]["what"], "point 2 hidden");
  EXPECT_EQ(run["metrics"]["frames"], 361);
  for (const char* library : {"depthservo", "visp", "opencv", "eigen"}) {
    EXPECT_TRUE(run["versions"].contains(library)) << library;
  }
  const json timing = json::parse(place.read("run/timing.json"));
  EXPECT_DOUBLE_EQ(timing["estimate"]["p50_s"].get<double>(), 2e-6);
}

TEST(RunFolder, equal_logs_give_equal_bytes_but_for_the_times) {
  const TemporaryFolder place;
  RunLog log = test::exampleLog();
  writeRunFolder(log, place / "one");
  log.timings[0].second[0] = 5e-6;
  writeRunFolder(log, place / "two");
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(place / "one")) {
    const std::string name = entry.path().filename().string();
    ++files;
    if (name == "timing.json") continue;
    EXPECT_EQ(place.read("one/" + name), place.read("two/" + name)) << name;
  }
  EXPECT_GE(files, 7u);
  EXPECT_NE(place.read("one/timing.json"), place.read("two/timing.json"));
}

TEST(RunFolder, has_no_plots_and_says_so_when_gnuplot_is_not_there) {
  const TemporaryFolder place;
  const std::string path = getenv("PATH");
  setenv("PATH", place.path().c_str(), 1);
  const bool plotted = writeRunFolder(test::exampleLog(31), place / "run");
  setenv("PATH", path.c_str(), 1);
  EXPECT_FALSE(plotted);
  EXPECT_TRUE(fs::exists(place / "run/report.html"));
  EXPECT_FALSE(fs::exists(place / "run/depth.png"));
  EXPECT_FALSE(fs::exists(place / "run/plots.gnuplot"));
}

TEST(RunFolder, has_its_plots_when_gnuplot_is_there) {
  const TemporaryFolder place;
  if (!writeRunFolder(test::exampleLog(), place / "run"))
    GTEST_SKIP() << "gnuplot is not installed";
  for (const char* plot : {"depth.png", "error.png", "image.png"}) {
    EXPECT_GT(fs::file_size(place / "run" / plot), 5000u) << plot;
  }
  EXPECT_FALSE(fs::exists(place / "run/plots.gnuplot"));
}

TEST(RunFolder, needs_a_frame_but_no_point) {
  const TemporaryFolder place;
  EXPECT_THROW(writeRunFolder(RunLog{}, place / "run"), InputError);
  EXPECT_TRUE(place.isEmpty());
  RunLog log = test::exampleLog(3);
  for (FrameRecord& frame : log.frames) frame.features.clear();
  writeRunFolder(log, place / "run");
  EXPECT_TRUE(fs::exists(place / "run/report.html"));
}

TEST(RunFolder, never_touches_a_folder_that_exists) {
  const TemporaryFolder place;
  fs::create_directory(place / "run");
  EXPECT_THROW(writeRunFolder(test::exampleLog(3), place / "run"), InputError);
  EXPECT_THROW(writeRunFolder(test::exampleLog(3), place / "run/"), InputError);
  EXPECT_THROW(requireNewRunFolder(place / "run"), InputError);
  EXPECT_TRUE(fs::is_empty(place / "run"));
  EXPECT_NO_THROW(requireNewRunFolder(place / "other"));
}

TEST(RunFolder, in_a_place_that_cannot_be_written_is_refused_with_its_name) {
  const TemporaryFolder place;
  std::ofstream(place / "file") << "not a folder";
  for (const fs::path& folder :
       {place / "missing/run", place / "file/run", fs::path("/proc/run")}) {
    try {
      writeRunFolder(test::exampleLog(3), folder);
      ADD_FAILURE() << folder << " was accepted";
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), folder.string());
    }
  }
}

TEST(RunFolder, leaves_nothing_behind_when_it_fails_half_way) {
  const TemporaryFolder place;
  RunLog log = test::exampleLog(3);
  log.configuration = "{not json";
  EXPECT_ANY_THROW(writeRunFolder(log, place / "run"));
  log = test::exampleLog(3);
  log.images[0].first = "no/such/folder";
  EXPECT_THROW(writeRunFolder(log, place / "run"), InputError);
  EXPECT_TRUE(place.isEmpty());
}

}  // namespace
}  // namespace depthservo
