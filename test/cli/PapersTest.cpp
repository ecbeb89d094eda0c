#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

void expectRows(const Result& result) {
  std::set<std::string> ids;
  for (const auto& row : result.json()) {
    ids.insert(row["id"]);
    EXPECT_TRUE(row["ours"].is_number()) << row;
    EXPECT_FALSE(row["tolerance"].get<std::string>().empty()) << row;
    EXPECT_TRUE(row["pass"].is_boolean() && row["reproduces"].is_boolean()) << row;
  }
  EXPECT_EQ(ids.size(), result.json().size());
  EXPECT_GE(ids.size(), 6u);
}

void expectWordsOfTheClaims(const Result& result, const TemporaryFolder& folder) {
  std::size_t printed = 0, met = 0;
  for (const auto& row : result.json()) {
    if (row["paper"] == "") continue;
    ++printed;
    met += row["reproduces"] ? 1 : 0;
  }
  const std::string words =
      fmt::format("{} of the {} claims that the papers print hold, ", met, printed);
  EXPECT_EQ(result.err.substr(result.err.find('\n') + 1).find(words), 0u) << result.err;
  EXPECT_NE(folder.read("paper/report.html").find(words), std::string::npos);
}

TEST(Reproduce, prints_whole_lines_in_their_order_when_data_and_words_go_to_one_file) {
  const TemporaryFolder folder;
  // The tool's own redirections come after, but the shell inside is already underway.
  const Result result =
      depthservo("reproduce ibuki2023 >" + (folder / "log").string() + " 2>&1; :");
  ASSERT_EQ(result.exitCode, 0);
  const std::string log = folder.read("log");
  const std::size_t last = log.rfind('\n', log.size() - 2) + 1;
  EXPECT_NE(log.find("claims that the papers print hold", last), std::string::npos);
  EXPECT_EQ(log.find("claims that the papers print hold"),
            log.rfind("claims that the papers print"));
}

void expectFolder(const Result& result, const TemporaryFolder& folder) {
  EXPECT_EQ(nlohmann::json::parse(folder.read("paper/rows.json")), result.json());
  const std::string page = folder.read("paper/report.html");
  for (const auto& row : result.json()) {
    const std::string id = row["id"];
    EXPECT_NE(page.find(id.substr(id.find('/', id.find('/') + 1) + 1)), std::string::npos) << id;
    if (row["reproduces"]) continue;
    EXPECT_NE(page.find(">" + id + "<"), std::string::npos) << id;
    EXPECT_NE(row["note"], "") << id;
  }
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  std::size_t figures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "paper")) {
    figures += entry.path().extension() == ".png" ? 1 : 0;
  }
  std::size_t embedded = 0;
  for (std::size_t at = 0; (at = page.find("data:image/png", at)) != std::string::npos; ++at) {
    ++embedded;
  }
  EXPECT_EQ(embedded, figures);
  EXPECT_GE(figures, 3u);
}

TEST(Reproduce, gives_rows_words_and_a_folder_and_does_not_overwrite_it) {
  const TemporaryFolder folder;
  const std::string command = "reproduce ibuki2023 --json --out " + (folder / "paper").string();
  const Result result = depthservo(command);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectRows(result);
  expectWordsOfTheClaims(result, folder);
  expectFolder(result, folder);
  EXPECT_EQ(depthservo(command).exitCode, 2);
}

TEST(Reproduce, refused_leaves_nothing) {
  const TemporaryFolder folder;
  const Result unknown = depthservo("reproduce einstein1905 --out " + (folder / "out").string());
  EXPECT_EQ(unknown.exitCode, 2);
  EXPECT_NE(unknown.err.find("durand2010"), std::string::npos) << unknown.err;
  expectRefused(depthservo("reproduce deluca"), {"the nearest is 'deluca2008'"});
  expectRefused(depthservo("reproduce ibuki"), {"the nearest is 'ibuki2023'"});
  EXPECT_EQ(depthservo("reproduce ibuki2023 --out /proc/nowhere/out").exitCode, 2);
  EXPECT_TRUE(folder.isEmpty());
}

TEST(Gains, of_the_paper_need_the_frame_rates_it_states) {
  const Result result = depthservo(
      "gains --law regulation --fps 30 --kc 6.5 --ke 1.7 --delta 0.95 --gamma 0.83 "
      "--kappa 1.41421356237 --U0 35.41789 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_NEAR(json["eq23"], 30.3903, 1e-4);
  EXPECT_NEAR(json["eq28a"], 59.6042, 1e-4);
  EXPECT_NEAR(json["eq28b"], 55.7196, 1e-4);
  EXPECT_NEAR(json["eq27"], 7.8168, 1e-4);
  EXPECT_EQ(json["satisfied"], false);
}

TEST(Gains, left_out_are_designed_for_the_frame_rate) {
  const Result result = depthservo("gains --law observer --fps 60 --kappa 0.5 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.json()["satisfied"], true);
  EXPECT_GT(result.json()["designed"]["ke"], 0);
  EXPECT_EQ(depthservo("gains --law observer --fps -60").exitCode, 2);
  EXPECT_EQ(depthservo("gains --law jedi --fps 60").exitCode, 2);
}

TEST(Gains, of_the_depth_observer_are_designed_by_settling_time) {
  const Result result =
      depthservo("gains --law depth --settling 1.0 --excitation 0.1 --fps 30 --focal 1096 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  EXPECT_NEAR(json["k1"], 2 * 5.83, 1e-9);
  EXPECT_NEAR(json["k3_normalised"], 5.83 * 5.83 / 0.01, 1e-6);
  EXPECT_NEAR(json["k3_pixel"], 5.83 * 5.83 / 0.01 / 1096 / 1096, 1e-9);
  EXPECT_NEAR(json["damping"], 1, 1e-9);
  EXPECT_GT(json["sigma_Z"]["value"], 0);
  EXPECT_TRUE(json["stability"]["flow_poles"]["margin"].is_null()) << "without bound";
  const auto text = depthservo("gains --law depth --settling 1.0 --fps 30");
  EXPECT_EQ(text.exitCode, 0);
  EXPECT_NE(text.out.find("focal_px^2"), std::string::npos) << text.out;
}

TEST(Gains, of_the_paper_are_judged_at_30_Hz_for_each_way_of_sampling) {
  const Result result = depthservo(
      "gains --law depth --k 48 --k3-px 0.0366 --focal 1096 --excitation 0.135 --fps 30 --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto stability = result.json()["stability"];
  EXPECT_NEAR(stability["euler"]["greatest_excitation"], 0.181, 1e-3);
  EXPECT_NEAR(stability["flow_euler"]["greatest_excitation"], 0.128, 1e-3);
  EXPECT_EQ(stability["euler"]["stable"], true);
  EXPECT_EQ(stability["flow_euler"]["stable"], false);
  EXPECT_EQ(stability["flow_poles"]["stable"], true);
}

TEST(Gains, in_the_wrong_unit_are_refused_and_the_message_says_so) {
  for (const std::string& arguments :
       {std::string("gains --law depth --k 48 --k3-px 44000 --focal 1096 --fps 30"),
        "run " + data("scenarios/unicycle-deadlock.yaml") + " --set depth.gains.k_3=5e10"}) {
    const Result result = depthservo(arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments;
    EXPECT_NE(result.err.find("wrong unit"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("focal_px^2"), std::string::npos) << result.err;
    EXPECT_TRUE(result.out.empty());
  }
}

TEST(Gains, of_the_depth_observer_refuse_what_cannot_be_meant) {
  for (const char* arguments : {"--fps 30", "--settling 1 --k 3 --k3 4 --fps 30", "--k 3 --fps 30",
                                "--settling 0.05 --fps 30", "--settling -1 --fps 30",
                                "--k 48 --k3-px 1 --fps 30", "--settling 1 --fps 0"}) {
    const Result result = depthservo(std::string("gains --law depth ") + arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments;
    EXPECT_TRUE(result.out.empty()) << arguments;
  }
}

}  // namespace
}  // namespace depthservo::test
