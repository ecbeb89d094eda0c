#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "depthservo/report/Report.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/text/InputError.h"
#include "support/TemporaryFolder.h"
#include "support/exampleLog.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

/// The plots are not looked at here; gnuplot takes most of the time.
class WithoutGnuplot : public testing::Environment {
  void SetUp() override { setenv("PATH", "/nonexistent", 1); }
};
[[maybe_unused]] const testing::Environment* const kWithoutGnuplot =
    testing::AddGlobalTestEnvironment(new WithoutGnuplot);

std::string reportOf(const RunLog& log) {
  const TemporaryFolder place;
  writeRunFolder(log, place / "run");
  return place.read("run/report.html");
}

/// What stands between two texts.
std::string between(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string::npos) return "";
  const std::size_t from = begin + before.size();
  return text.substr(from, text.find(after, from) - from);
}

nlohmann::json dataOf(const std::string& report) {
  return nlohmann::json::parse(
      between(report, R"(<script type="application/json" id="data">)", "</script>"));
}

std::string verdictOf(const std::string& report) {
  return between(between(report, "<h1 ", "</h1>") + "\n", ">", "\n");
}

std::size_t occurrences(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(Report, begins_with_a_verdict_in_plain_words) {
  EXPECT_EQ(verdictOf(reportOf(test::exampleLog())),
            "Converged after 12.0 s: image error 4.47 px rms, worst depth error 0.8 %");
  const std::string replay = verdictOf(reportOf(test::exampleReplay()));
  EXPECT_EQ(replay.rfind("Replayed 361 frames, 12.0 s: depths known to within ", 0), 0u) << replay;
}

TEST(Report, has_words_of_its_own_for_every_outcome) {
  std::vector<std::string> verdicts;
  for (int i = 0; i <= static_cast<int>(Outcome::timeout); ++i) {
    RunLog log = test::exampleLog(3);
    log.outcome = static_cast<Outcome>(i);
    const std::string report = reportOf(log);
    EXPECT_EQ(occurrences(report, "<h1 class=\"neutral\""), 0u) << toString(log.outcome);
    verdicts.push_back(verdictOf(report));
  }
  std::sort(verdicts.begin(), verdicts.end());
  EXPECT_EQ(std::unique(verdicts.begin(), verdicts.end()), verdicts.end());
}

TEST(Report, loads_nothing_from_elsewhere) {
  const std::string report = reportOf(test::exampleLog());
  EXPECT_EQ(occurrences(report, "default-src 'none'"), 1u);
  const std::string page = report.substr(0, report.find("<script type="));
  EXPECT_EQ(occurrences(page, "src="), occurrences(page, "src=\"data:"));
  for (const char* load : {"href=", "url(", "@import"})
    EXPECT_EQ(occurrences(page, load), 0u) << load;
  EXPECT_EQ(occurrences(report, "<link"), 0u);
  EXPECT_EQ(occurrences(report, "<script src"), 0u);
  EXPECT_EQ(occurrences(report, "sourceMappingURL"), 0u);
}

TEST(Report, embeds_the_images_and_goes_without_them) {
  const std::string image = R"(camera image" src="data:image/png;base64,iVBORw0KGgo)";
  EXPECT_EQ(occurrences(reportOf(test::exampleLog()), image), 2u);
  EXPECT_EQ(occurrences(reportOf(test::exampleReplay()), image), 0u);
}

TEST(Report, has_every_point_aligned_with_the_frames) {
  RunLog log = test::exampleLog();
  log.frames[0].features.erase(log.frames[0].features.begin() + 3);  // seen later than the others
  const nlohmann::json data = dataOf(reportOf(log));
  ASSERT_EQ(data["points"].size(), 4u);
  ASSERT_EQ(data["time"].size(), 361u);
  const nlohmann::json& columns = data["points"][3]["columns"];
  EXPECT_EQ(columns["Z"].size(), 361u);
  EXPECT_TRUE(columns["Z"][0].is_null());
  EXPECT_NEAR(columns["Z_true"][30].get<double>(), log.frames[30].features[3].Z_true, 1e-4);
  EXPECT_EQ(data["statuses"][data["points"][2]["columns"]["status"][160].get<int>()], "coasting");
}

TEST(Report, counts_time_from_the_first_frame) {
  const nlohmann::json data = dataOf(reportOf(test::exampleReplay()));
  EXPECT_NEAR(data["start"].get<double>(), 1305031102.175304, 1e-6);
  EXPECT_EQ(data["time"][0], 0);
  EXPECT_NEAR(data["time"][360].get<double>(), 12, 1e-6);
}

TEST(Report, runs_no_script_hidden_in_a_name) {
  const std::string attack =
      "</script><script>alert(1)</script><!--<img src=x onerror=alert(2)>{{data}}";
  RunLog log = test::exampleLog(5);
  log.name = log.reason = log.commandNames[0] = log.events[0].what = attack;
  log.configuration = nlohmann::json{{"name", attack}}.dump();
  const std::string clean = reportOf(test::exampleLog(5)), report = reportOf(log);
  EXPECT_EQ(occurrences(report, "<script"), occurrences(clean, "<script"));
  EXPECT_EQ(occurrences(report, "</script"), occurrences(clean, "</script"));
  EXPECT_EQ(occurrences(report, "<img"), occurrences(clean, "<img"));
  EXPECT_EQ(occurrences(report, "<!--"), occurrences(clean, "<!--"));
  EXPECT_EQ(dataOf(report)["run"]["name"], attack);
}

TEST(Report, accepts_names_that_are_not_utf8) {
  RunLog log = test::exampleLog(5);
  log.name = "caf\xe9";
  EXPECT_EQ(dataOf(reportOf(log))["run"]["name"], "caf\xef\xbf\xbd");
}

TEST(Report, made_again_from_the_files_is_the_same) {
  const TemporaryFolder place;
  writeRunFolder(test::exampleLog(), place / "run");
  const std::string written = place.read("run/report.html");
  for (const char* unneeded : {"report.html", "timing.json"}) fs::remove(place / "run" / unneeded);
  writeReport(place / "run");
  EXPECT_EQ(place.read("run/report.html"), written);
}

TEST(Report, of_a_long_run_stays_small) {
  RunLog log = test::exampleLog(5000);  // 20 000 feature rows
  log.images.clear();
  EXPECT_LT(reportOf(log).size(), 4u << 20);
}

/// A file of a good run folder is spoilt; the report must name it and write nothing.
void expectRefused(const std::string& file, const std::string& contents, int line) {
  SCOPED_TRACE(file + ": " + contents.substr(0, 60));
  const TemporaryFolder place;
  writeRunFolder(test::exampleLog(3), place / "run");
  fs::remove(place / "run/report.html");
  place.write("run/" + file, contents);
  try {
    writeReport(place / "run");
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), (place / "run" / file).string());
    EXPECT_EQ(error.line(), line) << error.what();
  }
  EXPECT_FALSE(fs::exists(place / "run/report.html"));
  EXPECT_FALSE(fs::exists(place / "run/.report.html"));
}

TEST(Report, names_the_file_that_is_bad) {
  const TemporaryFolder place;
  writeRunFolder(test::exampleLog(3), place / "run");
  const std::string frames = place.read("run/frames.csv"),
                    features = place.read("run/features.csv");
  expectRefused("run.json", "{", 0);
  expectRefused("run.json", "[]", 0);
  expectRefused("run.json", R"({"command": "run"})", 0);
  expectRefused("frames.csv", "", 0);
  expectRefused("frames.csv", "timestamp\n1\n", 1);
  expectRefused("frames.csv", frames + "nan" + frames.substr(frames.rfind("\n0.0666") + 12), 5);
  expectRefused("features.csv", "", 0);
  expectRefused("features.csv", features + "9.000000000,0,1,1,1,2,0.1,valid,2,1,3,0\n", 14);
  expectRefused("features.csv", features + "0.066666667,7,1,1,1,-2,0.1,valid,2,1,3,0\n", 14);
  expectRefused("features.csv", features + "0.066666667,7,1,1,1,2,0.1,splendid,2,1,3,0\n", 14);
  expectRefused("last.png", "GIF89a", 0);
}

TEST(Report, names_the_file_that_is_missing) {
  for (const char* file : {"run.json", "frames.csv", "features.csv"}) {
    const TemporaryFolder place;
    writeRunFolder(test::exampleLog(3), place / "run");
    fs::remove(place / "run" / file);
    try {
      writeReport(place / "run");
      ADD_FAILURE() << file;
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), (place / "run" / file).string());
    }
  }
  EXPECT_THROW(writeReport("/no/such/run"), InputError);
}

}  // namespace
}  // namespace depthservo
