#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "report/TimeRows.h"
#include "report/gnuplot.h"
#include "report/headline.h"
#include "report/interest.h"
#include "report/joinedEvents.h"
#include "support/TemporaryFolder.h"
#include "support/exampleLog.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

TEST(TimeRows, are_few_increasing_and_end_where_the_run_does) {
  for (std::size_t frames = 1; frames < 400; ++frames) {
    for (const std::size_t most : {4u, 10u, 100u}) {
      const TimeRows rows(frames, most);
      ASSERT_LE(rows.size(), std::max<std::size_t>(most, 4)) << frames;
      ASSERT_EQ(rows.frameOf(0), 0u);
      ASSERT_EQ(rows.frameOf(rows.size() - 1), frames - 1);
      for (std::size_t row = 1; row < rows.size(); ++row) {
        ASSERT_LT(rows.frameOf(row - 1), rows.frameOf(row)) << frames << ' ' << most;
      }
      for (std::size_t frame = 0; frame < frames; ++frame) {
        const auto [first, second] = rows.placeOf(frame);
        ASSERT_LT(second, rows.size());
        ASSERT_LE(first, second);
      }
    }
  }
}

TEST(ThinnedColumn, keeps_every_extreme_and_the_order_in_which_they_came) {
  const std::size_t frames = 10000;
  const TimeRows rows(frames, 100);
  ThinnedColumn column(rows, Shown::extremes), lowest(rows, Shown::lowest);
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  double high = -1e9, low = 1e9, first = 0, last = 0;
  for (std::size_t k = 0; k < frames; ++k) {
    const double value = k == 5432 ? 77 : k == 5433 ? -99 : noise(random);
    high = std::max(high, value);
    low = std::min(low, value);
    if (k == 0) first = value;
    last = value;
    column.add(k, value);
    lowest.add(k, value);
  }
  const auto& values = column.values();
  const auto highest = std::max_element(values.begin(), values.end());
  EXPECT_EQ(*highest, high);
  EXPECT_EQ(*std::next(highest), low) << "it came next";
  EXPECT_EQ(values.front(), first);
  EXPECT_EQ(values.back(), last);
  EXPECT_EQ(*std::min_element(lowest.values().begin(), lowest.values().end()), low);
}

TEST(ThinnedColumn, of_a_short_run_is_the_run_and_leaves_the_unknown_unknown) {
  const TimeRows rows(5, 10);
  ThinnedColumn column(rows, Shown::sample);
  column.add(1, 4.5);
  column.add(2, kUnknown);
  EXPECT_EQ(column.values().size(), 5u);
  EXPECT_EQ(column.values()[1], 4.5);
  EXPECT_TRUE(std::isnan(column.values()[2]));
}

TEST(MostTelling, is_all_of_few_and_the_longest_and_the_worst_of_many) {
  std::vector<PointMetrics> points(100);
  for (int i = 0; i < 100; ++i) {
    PointMetrics& point = points[static_cast<std::size_t>(i)];
    point.id = i;
    point.Z = 1;
    point.Z_true = 1;
    point.sigma_Z = 0.01;
    point.relative_error = 0;
    point.status = DepthStatus::valid;
    point.measured_frames = i == 7 ? 500 : 10;
  }
  points[50].relative_error = 0.2;
  points[51].relative_error = 0.9;
  points[51].status = DepthStatus::lost;  // claims nothing
  const std::vector<int> chosen = mostTelling(points, 8);
  EXPECT_EQ(chosen.size(), 8u);
  EXPECT_EQ(chosen[0], 7);
  EXPECT_EQ(chosen[1], 50);
  EXPECT_EQ(mostTelling(points, 100).size(), 100u);
  EXPECT_EQ(mostTelling(points, 100)[42], 42);
}

TEST(JoinedEvents, say_how_many_and_from_when_to_when) {
  std::vector<Event> events;
  for (int i = 0; i < 200; ++i) {
    events.push_back({10.0 + i, "unexcited: no translation (point " + std::to_string(i) + ")"});
  }
  events.push_back({5, "odometry: empty"});
  for (int i = 0; i < 6; ++i) {
    events.push_back({2.0 * i, "dot " + std::to_string(i % 3) + " hidden"});
  }
  const auto all = joined(events, 4);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].what, "dots hidden");
  EXPECT_EQ(all[0].count, 6u);
  EXPECT_EQ(all[1].what, "odometry: empty");
  EXPECT_EQ(all[1].count, 1u);
  EXPECT_EQ(all[2].what, "unexcited: no translation");
  EXPECT_EQ(all[2].count, 200u);
  EXPECT_EQ(all[2].first_s, 10);
  EXPECT_EQ(all[2].last_s, 209);
}

TEST(GnuplotString, is_on_one_line_and_nothing_in_it_is_executed) {
  EXPECT_EQ(gnuplot::quoted("a'b"), "'a''b'");
  EXPECT_EQ(gnuplot::quoted("x\nsystem(\"id > pwned\")\n#"), "'x system(\"id > pwned\") #'");
  EXPECT_EQ(gnuplot::quoted("\r\t\x01\x7f"), "'    '");
  EXPECT_EQ(gnuplot::quoted("caf\xe9"), "'caf\xef\xbf\xbd'");
  EXPECT_EQ(gnuplot::quoted("m\xc3\xbc"), "'m\xc3\xbc'");
  EXPECT_EQ(gnuplot::quoted("`id`$(id)@x"), "'`id`$(id)@x'") << "plain text in single quotes";
}

/// Natural corners that come and go, a tenth of them in every image.
RunLog manyCorners(int frames, int corners) {
  RunLog log;
  log.command = "live";
  log.name = "corners";
  log.camera = {640, 480, 600, 600, 319.5, 239.5};
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  for (int k = 0; k < frames; ++k) {
    FrameRecord frame;
    frame.time_s = k / 30.0;
    for (int i = 0; i < corners; ++i) {
      FeatureRecord feature;
      feature.id = i + corners * ((k + i) / 60);
      feature.measured = true;
      feature.u = 20 + 600.0 * i / corners + noise(random);
      feature.v = 240 + 100 * noise(random) / 3;
      feature.Z_true = 1 + 0.01 * i;
      feature.estimate.sigma_chi = 0.01;
      feature.estimate.chi = 1 / feature.Z_true + 0.01 * noise(random);
      feature.estimate.status = DepthStatus::valid;
      feature.estimate.excitation = 0.1;
      frame.features.push_back(feature);
    }
    std::sort(frame.features.begin(), frame.features.end(),
              [](const auto& a, const auto& b) { return a.id < b.id; });
    log.frames.push_back(frame);
  }
  return log;
}

TEST(Page, of_many_points_and_images_stays_below_ten_megabytes_and_says_what_it_leaves_out) {
  const TemporaryFolder place;
  const RunLog log = manyCorners(1300, 100);
  writeRunFolder(log, place / "run");
  EXPECT_LT(fs::file_size(place / "run/report.html"), 6u << 20);
  const std::string page = place.read("run/report.html");
  const std::string mark = R"(id="data">)";
  const auto begin = page.find(mark) + mark.size();
  const auto data =
      nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  EXPECT_EQ(data["all_points"], 100);
  EXPECT_EQ(data["points"].size(), 32u);
  EXPECT_EQ(data["run"]["points"].size(), 32u);
  EXPECT_EQ(data["last"]["Z"].size(), 100u);
  EXPECT_LE(data["time"].size(), 1200u);
  EXPECT_EQ(data["bucket"], 3);
  EXPECT_GT(data["run"]["metrics"]["points_gone"], 1000);
}

TEST(Metrics, are_of_the_points_at_the_end_and_count_those_that_came_and_went) {
  const RunLog log = manyCorners(200, 10);
  const Metrics metrics = computeMetrics(log);
  EXPECT_EQ(metrics.points.size(), 10u);
  std::set<int> all;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) all.insert(feature.id);
  }
  EXPECT_EQ(metrics.points_seen, all.size());
  EXPECT_EQ(metrics.points_gone(), all.size() - 10);
  for (const PointMetrics& point : metrics.points) EXPECT_LE(point.measured_frames, 60u);
}

TEST(Metrics, are_the_same_image_by_image_whatever_the_log_still_has) {
  RunLog log = test::exampleLog();
  MetricsMeter meter(log.camera, log.goals);
  for (const FrameRecord& frame : log.frames) meter.add(frame);
  const std::string all = toJson(log);
  log.frames.erase(log.frames.begin(), log.frames.end() - 5);
  EXPECT_EQ(toJson(log, meter.result(log)), all);
}

TEST(Metrics, know_when_a_depth_is_known_though_the_estimator_forecasts_nothing) {
  RunLog log = test::exampleLog();
  const Metrics metrics = computeMetrics(log);
  ASSERT_TRUE(std::isnan(log.frames.back().features[0].frames_to_5pct));
  EXPECT_EQ(metrics.points[0].frames_to_5pct, 0);
  double known_s = kUnknown;
  for (const FrameRecord& frame : log.frames) {
    const DepthEstimate& e = frame.features[0].estimate;
    if (std::isnan(known_s) && e.sigma_Z() <= 0.05 * e.Z()) known_s = frame.time_s;
  }
  EXPECT_EQ(metrics.points[0].time_to_5pct_s, known_s);
  for (FrameRecord& frame : log.frames) {
    for (FeatureRecord& feature : frame.features) feature.estimate.sigma_chi = 1;
  }
  EXPECT_TRUE(std::isnan(computeMetrics(log).points[0].time_to_5pct_s)) << "never known";
}

nlohmann::ordered_json runOf(const RunLog& log) {
  const TemporaryFolder place;
  writeRunFolder(log, place / "run");
  return nlohmann::ordered_json::parse(place.read("run/run.json"));
}

TEST(Headline, gives_no_accuracy_where_the_pose_grades_itself) {
  RunLog log = test::exampleReplay();
  for (FrameRecord& frame : log.frames) {
    for (FeatureRecord& feature : frame.features) feature.Z_true = feature.estimate.Z() * 1.001;
  }
  EXPECT_FALSE(runOf(log)["metrics"]["coverage_2sigma"].is_null());
  EXPECT_NE(headlineOf(runOf(log)).sentence.find("worst depth error 0.1 %"), std::string::npos);
  log.isTruthOfMotion = true;
  EXPECT_TRUE(runOf(log)["metrics"]["coverage_2sigma"].is_null()) << "no evidence is no agreement";
  const std::string sentence = headlineOf(runOf(log)).sentence;
  EXPECT_NE(sentence.find("agree with the pose of the target to 0.1 %"), std::string::npos)
      << sentence;
  EXPECT_EQ(sentence.find("error"), std::string::npos) << sentence;
}

TEST(Headline, says_what_is_known_without_boasting_or_absurd_figures) {
  RunLog log = test::exampleReplay();
  const std::string known = headlineOf(runOf(log)).sentence;
  EXPECT_NE(known.find("depths known to within 0.8"), std::string::npos) << known;
  for (FeatureRecord& feature : log.frames.back().features) feature.estimate.sigma_chi *= 1e5;
  const std::string unknown = headlineOf(runOf(log)).sentence;
  EXPECT_NE(unknown.find("no depth is known to better than 20 %"), std::string::npos) << unknown;
  log.frames.back().features[1].estimate.sigma_chi /= 1e5;
  const std::string one = headlineOf(runOf(log)).sentence;
  EXPECT_NE(one.find("1 of 4 depths known to within"), std::string::npos) << one;
  log.frames.back().features[1].estimate.status = DepthStatus::rejected;
  const std::string refuted = headlineOf(runOf(log)).sentence;
  EXPECT_NE(refuted.find("no depth is known to better than 20 %"), std::string::npos) << refuted;
}

TEST(Headline, names_a_live_observation_and_a_run_without_a_goal_for_what_they_are) {
  RunLog log = test::exampleReplay();
  log.command = "live";
  EXPECT_EQ(headlineOf(runOf(log)).sentence.rfind("Observed 361 frames", 0), 0u);
  log = test::exampleLog();
  log.outcome = Outcome::timeout;
  EXPECT_EQ(headlineOf(runOf(log)).sentence.rfind("Not yet at the goal", 0), 0u);
  log.goals.clear();
  EXPECT_EQ(headlineOf(runOf(log)).sentence.rfind("Ran for 12.0 s without a goal", 0), 0u);
}

TEST(InPercent, never_needs_powers_of_ten) {
  EXPECT_EQ(inPercent(0.00065), "0.065 %");
  EXPECT_EQ(inPercent(0.034), "3.4 %");
  EXPECT_EQ(inPercent(7.6), "760 %");
  EXPECT_EQ(inPercent(2540.4), "254040 %");
}

}  // namespace
}  // namespace depthservo
