#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <vector>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

/// Where real recordings may be; they are not part of the sources.
fs::path recordings() {
  const char* folder = std::getenv("DEPTHSERVO_RECORDINGS");
  return folder ? folder : DEPTHSERVO_RECORDINGS;
}

/// Arguments of `depthservo replay` after the folder, by recording, as doc/sources.md has them.
std::map<std::string, std::string> commands() {
  std::ifstream page(data("../doc/sources.md"));
  std::map<std::string, std::string> all;
  const std::regex row(R"(^\| `([\w-]+)` \| `depthservo replay ([\w-]+) ([^`]*) --out \w+` \|)");
  for (std::string line; std::getline(page, line);) {
    std::smatch match;
    if (std::regex_search(line, match, row)) {
      EXPECT_EQ(match[1], match[2]) << line;
      all[match[1]] = match[3];
    }
  }
  return all;
}

/// The page is whole, no larger than promised, and has something to draw.
void expectPage(const fs::path& page) {
  constexpr std::uintmax_t kMost = 10'000'000;
  ASSERT_TRUE(fs::exists(page));
  EXPECT_LE(fs::file_size(page), kMost);
  std::ifstream in(page);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string begin = R"(<script type="application/json" id="data">)";
  const std::size_t from = text.find(begin);
  ASSERT_NE(from, std::string::npos);
  const std::size_t to = text.find("</script>", from);
  ASSERT_NE(to, std::string::npos);
  const auto drawn =
      nlohmann::json::parse(text.substr(from + begin.size(), to - from - begin.size()));
  EXPECT_GT(drawn.at("time").size(), 5u);
  ASSERT_FALSE(drawn.at("points").empty());
  for (const auto& point : drawn.at("points")) {
    EXPECT_EQ(point.at("columns").at("Z").size(), drawn.at("time").size());
  }
}

TEST(Recordings, open_by_one_command_each_with_a_page) {
  if (!fs::is_directory(recordings())) {
    GTEST_SKIP() << "no folder with recordings: " << recordings() << " (DEPTHSERVO_RECORDINGS)";
  }
  const auto all = commands();
  EXPECT_GE(all.size(), 7u);
  std::size_t opened = 0;
  for (const auto& folder : fs::directory_iterator(recordings())) {
    if (!folder.is_directory()) continue;
    const std::string name = folder.path().filename();
    SCOPED_TRACE(name);
    ASSERT_TRUE(all.count(name)) << "doc/sources.md has no command for it";
    const TemporaryFolder out;
    const Result result = depthservo("replay '" + folder.path().string() + "' " + all.at(name) +
                                     " --out '" + (out / "out").string() + "'");
    EXPECT_EQ(result.exitCode, 0) << result.err;
    expectPage(out / "out/report.html");
    ++opened;
  }
  EXPECT_GT(opened, 0u);
}

/// Share of the depths called valid that are within two sigma, in all images of a run folder.
double coverage(const fs::path& features) {
  std::ifstream in(features);
  std::string line;
  std::getline(in, line);
  int valid = 0, covered = 0;
  while (std::getline(in, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    constexpr std::size_t kMeasured = 4, kZ = 5, kSigma = 6, kStatus = 7, kTruth = 8;
    if (cells.size() <= kTruth || cells[kTruth].empty()) continue;
    if (cells[kMeasured] != "1" || cells[kStatus] != "valid") continue;
    ++valid;
    const double error = std::abs(std::stod(cells[kZ]) - std::stod(cells[kTruth]));
    covered += error <= 2 * std::stod(cells[kSigma]);
  }
  EXPECT_GT(valid, 100);
  return static_cast<double>(covered) / valid;
}

TEST(Recordings, areHonestWithNothingDeclared) {
  const std::map<std::string, double> least = {
      {"hololens-60", 0.88}, {"franka-chessboard", 0.88}, {"7scenes-80", 0.7}};  // doc/sources.md
  const auto all = commands();
  int judged = 0;
  for (const auto& [name, share] : least) {
    const fs::path folder = recordings() / name;
    if (!fs::is_directory(folder)) continue;
    SCOPED_TRACE(name);
    const TemporaryFolder out;
    const Result result = depthservo("replay '" + folder.string() + "' " + all.at(name) +
                                     " --out '" + (out / "out").string() + "'");
    ASSERT_EQ(result.exitCode, 0) << result.err;
    EXPECT_GE(coverage(out / "out/features.csv"), share);
    ++judged;
  }
  if (judged == 0) GTEST_SKIP() << "none in " << recordings() << " (DEPTHSERVO_RECORDINGS)";
}

}  // namespace
}  // namespace depthservo::test
