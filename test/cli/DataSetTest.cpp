#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <opencv2/imgcodecs.hpp>

#include "cli/Tool.h"
#include "support/MiniatureDataSet.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

const PinholeCamera kFr3{640, 480, 535.4, 539.2, 320.1, 247.6, {}};
const PinholeCamera kFr1{
    640, 480, 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}};
const PinholeCamera kIcl{640, 480, 481.2, 480, 319.5, 239.5, {}};  // y down, as in our own layout
const PinholeCamera kEuroc{752,
                           480,
                           458.654,
                           457.296,
                           367.215,
                           248.375,
                           {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}};

/// The data sets, each drawn when it is first needed; tests damage copies.
class DataSets : public testing::Test {
 protected:
  static void SetUpTestSuite() { folder_ = std::make_unique<TemporaryFolder>(); }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string set(const std::string& name) {
    const fs::path place = *folder_ / name;
    if (fs::exists(place)) return place;
    if (name == "tum") MiniatureDataSet(kFr3).writeTum(place);
    if (name == "tum-own") MiniatureDataSet(kFr3).writeOwn(place);
    if (name == "icl") MiniatureDataSet(kIcl, 0).writeIcl(place);
    if (name == "icl-own") MiniatureDataSet(kIcl, 0).writeOwn(place, 1);
    if (name == "euroc") MiniatureDataSet(kEuroc).writeEuroc(place);
    if (name == "euroc-own") MiniatureDataSet(kEuroc).writeOwn(place);
    if (name == "fr1-own") MiniatureDataSet(kFr1).writeOwn(place);
    return place;
  }

  /// A copy of a data set to damage; images are links.
  std::string copyOf(const std::string& name) const {
    const fs::path copy = mine_ / name;
    for (fs::recursive_directory_iterator it(set(name)), end; it != end; ++it) {
      const fs::path place = copy / fs::relative(it->path(), set(name));
      if (it->is_directory()) {
        fs::create_directories(place);
      } else if (it->path().extension() == ".png") {
        fs::create_directories(place.parent_path());
        fs::create_symlink(it->path(), place);
      } else {
        fs::create_directories(place.parent_path());
        fs::copy_file(it->path(), place);
      }
    }
    return copy;
  }

  static std::vector<std::string> lines(const std::string& file) {
    std::ifstream in(file);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
  static void write(const std::string& file, const std::vector<std::string>& lines) {
    std::ofstream out(file);
    for (const std::string& line : lines) out << line << '\n';
  }
  /// Replaces the first `from` in line `number` (from 1) of a file.
  static void edit(const std::string& file, std::size_t number, const std::string& from,
                   const std::string& to) {
    auto all = lines(file);
    const std::size_t at = all.at(number - 1).find(from);
    ASSERT_NE(at, std::string::npos) << from << " in " << all[number - 1];
    all[number - 1].replace(at, from.size(), to);
    write(file, all);
  }
  static void swapLines(const std::string& file, std::size_t a, std::size_t b) {
    auto all = lines(file);
    std::swap(all.at(a - 1), all.at(b - 1));
    write(file, all);
  }
  static void replaceImage(const std::string& file, const cv::Mat& image) {
    fs::remove(file);
    cv::imwrite(file, image);
  }

  Result replay(const std::string& folder, const std::string& more = "") const {
    return depthservo("replay " + folder + " --json " + more);
  }
  void expectReplayRefused(const std::string& folder, const std::string& options,
                           const std::vector<std::string>& words) const {
    const std::string out = mine_ / "refused";
    expectRefused(replay(folder, options + " --out " + out), words);
    EXPECT_FALSE(fs::exists(out));
  }

  static std::unique_ptr<TemporaryFolder> folder_;
  TemporaryFolder mine_;
};
std::unique_ptr<TemporaryFolder> DataSets::folder_;

/// Every depth near the truth, told by the depth images where there are some.
void expectGood(const Result& result, const MiniatureDataSet& scene) {
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  ASSERT_EQ(json["points"].size(), 4u);
  for (const auto& point : json["points"]) {
    const double Z = scene.trueDepth(scene.size() - 1, point["id"].get<std::size_t>());
    EXPECT_NEAR(point["Z"], Z, 0.01 * Z) << point;
    EXPECT_GE(point["measured_frames"], scene.size() - 1) << point;
    if (!point["Z_true"].is_null()) {
      EXPECT_NEAR(point["Z_true"], Z, 3e-4 * Z) << point;
    }
  }
}

TEST_F(DataSets, tum_opens_as_downloaded_and_estimates_as_our_own_layout) {
  const std::string a = mine_ / "a", b = mine_ / "b";
  const Result tum = replay(set("tum"), "--camera tum-fr3 --out " + a);
  expectGood(tum, MiniatureDataSet(kFr3));
  EXPECT_FALSE(tum.json()["points"][0]["Z_true"].is_null()) << "the depth images tell the truth";
  ASSERT_EQ(replay(set("tum-own"), "--out " + b).exitCode, 0);
  expectSameEstimates(a, b, 1e-9);
}

TEST_F(DataSets, icl_nuim_opens_as_downloaded_and_estimates_as_our_own_layout) {
  const std::string a = mine_ / "a", b = mine_ / "b";
  const Result icl = replay(set("icl"), "--camera icl --out " + a);
  expectGood(icl, MiniatureDataSet(kIcl, 0));
  ASSERT_EQ(replay(set("icl-own"), "--out " + b).exitCode, 0);
  expectSameEstimates(a, b, 1e-9);
}

TEST_F(DataSets, icl_nuim_with_a_positive_fy_would_estimate_otherwise) {
  mine_.write("camera.yaml",
              "image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, data: "
              "[481.2, 0, 319.5, 0, 480, 239.5, 0, 0, 1]}\n");
  const Result wrong = replay(set("icl"), "--camera " + (mine_ / "camera.yaml").string());
  ASSERT_EQ(wrong.exitCode, 0) << wrong.err;
  const MiniatureDataSet scene(kIcl, 0);
  double worst = 0;
  const auto json = wrong.json();
  for (const auto& point : json["points"]) {
    const double Z = scene.trueDepth(scene.size() - 1, point["id"].get<std::size_t>());
    worst = std::max(worst, std::abs(point["Z"].get<double>() / Z - 1));
  }
  EXPECT_GT(worst, 0.02);
}

TEST_F(DataSets, euroc_opens_as_downloaded_and_estimates_as_our_own_layout) {
  const std::string a = mine_ / "a", b = mine_ / "b", c = mine_ / "c";
  const Result euroc = replay(set("euroc"), "--out " + a);
  expectGood(euroc, MiniatureDataSet(kEuroc));
  ASSERT_EQ(replay(set("euroc-own"), "--out " + b).exitCode, 0);
  expectSameEstimates(a, b, 1e-9);
  const std::string sensor = set("euroc") + "/mav0/cam0/sensor.yaml";
  ASSERT_EQ(replay(set("euroc-own"), "--out " + c + " --camera " + sensor).exitCode, 0);
  expectSameEstimates(a, c, 1e-9);
}

TEST_F(DataSets, a_distorted_camera_estimates_the_truth_and_a_neglected_distortion_does_not) {
  const MiniatureDataSet scene(kFr1);
  expectGood(replay(set("fr1-own")), scene);
  expectGood(replay(set("fr1-own"), "--camera tum-fr1"), scene);

  const MiniatureDataSet euroc(kEuroc);
  const auto worstError = [&](const std::string& folder) {
    const auto json = replay(folder).json();
    double worst = 0;
    for (const auto& point : json["points"]) {
      const double Z = euroc.trueDepth(euroc.size() - 1, point["id"].get<std::size_t>());
      worst = std::max(worst, std::abs(point["Z"].get<double>() / Z - 1));
    }
    return worst;
  };
  const std::string copy = copyOf("euroc");
  edit(copy + "/mav0/cam0/sensor.yaml", 20, "[-0.28340811, 0.07395907, 0.00019359", "[0, 0, 0");
  edit(copy + "/mav0/cam0/sensor.yaml", 20, "1.76187114e-05", "0");
  EXPECT_GT(worstError(copy), 5 * worstError(set("euroc")));
}

TEST_F(DataSets, tum_poses_that_are_nan_or_listed_twice_are_skipped_and_counted) {
  const std::string copy = copyOf("tum"), poses = copy + "/groundtruth.txt";
  auto all = lines(poses);
  all[40] = all[40].substr(0, all[40].find(' ')) + " nan nan nan nan nan nan nan";
  all[41] = all[41].substr(0, all[41].find(' ')) + " 1 1 1 0 0 0 0";
  all.insert(all.begin() + 60, all[59]);
  write(poses, all);
  const Result result = replay(copy, "--camera tum-fr3");
  expectGood(result, MiniatureDataSet(kFr3));
  EXPECT_NE(result.err.find("3 of"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("skipped"), std::string::npos) << result.err;
}

TEST_F(DataSets, images_in_a_gap_of_the_ground_truth_are_not_used) {
  const std::string copy = copyOf("tum"), poses = copy + "/groundtruth.txt";
  auto all = lines(poses);
  all.erase(all.begin() + 110, all.begin() + 150);  // 0.4 s without a pose
  write(poses, all);
  const std::string out = mine_ / "out";
  const Result result = replay(copy, "--camera tum-fr3 --out " + out);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto measured = readCsv(out + "/features.csv").at("measured");
  const auto hidden = std::count(measured.begin(), measured.end(), "0");
  EXPECT_GE(hidden, 4 * 10);
  EXPECT_LE(hidden, 4 * 12);
  EXPECT_NE(readCsv(out + "/features.csv").at("Z").back(), "");
  std::ifstream run(out + "/run.json");
  const auto json = nlohmann::json::parse(run);
  EXPECT_NE(json["events"].dump().find("no pose for 0.41 s"), std::string::npos) << json["events"];
  const auto depths = result.json();
  const MiniatureDataSet scene(kFr3);
  for (const auto& point : depths["points"]) {
    const double Z = scene.trueDepth(scene.size() - 1, point["id"].get<std::size_t>());
    EXPECT_NEAR(point["Z"], Z, 0.01 * Z) << point;
  }
}

TEST_F(DataSets, images_without_a_depth_image_are_counted_and_their_truth_is_unknown) {
  const std::string copy = copyOf("tum"), depth = copy + "/depth.txt";
  auto all = lines(depth);
  all.erase(all.end() - 5, all.end());
  write(depth, all);
  const Result result = replay(copy, "--camera tum-fr3");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("5 of 45 images have no depth image"), std::string::npos) << result.err;
}

TEST_F(DataSets, depth_is_unknown_at_edges_and_where_the_sensor_saw_nothing) {
  const std::string copy = copyOf("tum");
  for (const auto& entry : fs::directory_iterator(copy + "/depth")) {
    cv::Mat levels = cv::imread(entry.path().string(), cv::IMREAD_UNCHANGED);
    levels.colRange(0, 320).setTo(0);                       // two dots without depth
    for (int u = 320; u < 640; u += 3) levels.col(u) *= 2;  // two with a jump beside them
    replaceImage(entry.path(), levels);
  }
  const Result result = replay(copy, "--camera tum-fr3");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto json = result.json();
  for (const auto& point : json["points"]) EXPECT_TRUE(point["Z_true"].is_null()) << point;
}

struct Damage {
  const char* name;
  const char* set;
  const char* options;
  void (*damage)(const std::string& folder);
  std::vector<std::string> words;
};
void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }

class DamagedDataSet : public DataSets, public testing::WithParamInterface<Damage> {
 public:
  using DataSets::edit;
  using DataSets::lines;
  using DataSets::replaceImage;
  using DataSets::swapLines;
  using DataSets::write;
};

TEST_P(DamagedDataSet, is_refused_in_one_line) {
  const std::string copy = copyOf(GetParam().set);
  GetParam().damage(copy);
  expectReplayRefused(copy, GetParam().options, GetParam().words);
}

using D = DamagedDataSet;
const char* const kFr3Camera = "--camera tum-fr3";
const char* const kIclCamera = "--camera icl";
const cv::Mat kSmall(24, 32, CV_8U, cv::Scalar(99));
const cv::Mat kSmallDepth(24, 32, CV_16U, cv::Scalar(5000));

std::string firstImage(const std::string& folder) {
  std::vector<fs::path> files(fs::directory_iterator(folder), fs::directory_iterator{});
  return *std::min_element(files.begin(), files.end());
}

INSTANTIATE_TEST_SUITE_P(
    , DamagedDataSet,
    testing::Values(
        // TUM RGB-D
        Damage{
            "tum_without_a_camera", "tum", "", [](const std::string&) {}, {"--camera", "tum-fr1"}},
        Damage{"tum_without_rgb_txt",
               "tum",
               kFr3Camera,
               [](const std::string& f) { fs::remove(f + "/rgb.txt"); },
               {"rgb.txt"}},
        Damage{"tum_without_ground_truth",
               "tum",
               kFr3Camera,
               [](const std::string& f) { fs::remove(f + "/groundtruth.txt"); },
               {"groundtruth.txt", "motion"}},
        Damage{"tum_without_an_image",
               "tum",
               kFr3Camera,
               [](const std::string& f) { fs::remove(firstImage(f + "/rgb")); },
               {"rgb/1305031102", "no such"}},
        Damage{"tum_without_a_depth_image",
               "tum",
               kFr3Camera,
               [](const std::string& f) { fs::remove(firstImage(f + "/depth")); },
               {"depth/1305031102", "no such"}},
        Damage{"tum_image_size",
               "tum",
               kFr3Camera,
               [](const std::string& f) { D::replaceImage(firstImage(f + "/rgb"), kSmall); },
               {"640x480", "32x24"}},
        Damage{"tum_depth_size",
               "tum",
               kFr3Camera,
               [](const std::string& f) { D::replaceImage(firstImage(f + "/depth"), kSmallDepth); },
               {"depth/1305031102", "640x480", "32x24"}},
        Damage{"tum_depth_8_bit",
               "tum",
               kFr3Camera,
               [](const std::string& f) {
                 D::replaceImage(firstImage(f + "/depth"), cv::Mat(480, 640, CV_8U, cv::Scalar(9)));
               },
               {"depth/1305031102", "16-bit"}},
        Damage{"tum_rgb_backwards",
               "tum",
               kFr3Camera,
               [](const std::string& f) { D::swapLines(f + "/rgb.txt", 8, 9); },
               {"rgb.txt:9", "backwards"}},
        Damage{"tum_depth_backwards",
               "tum",
               kFr3Camera,
               [](const std::string& f) { D::swapLines(f + "/depth.txt", 8, 9); },
               {"depth.txt:9", "backwards"}},
        Damage{"tum_poses_backwards",
               "tum",
               kFr3Camera,
               [](const std::string& f) { D::swapLines(f + "/groundtruth.txt", 8, 9); },
               {"groundtruth.txt:9", "backwards"}},
        Damage{"tum_rgb_columns",
               "tum",
               kFr3Camera,
               [](const std::string& f) {
                 auto all = D::lines(f + "/rgb.txt");
                 for (auto& line : all) {
                   const std::size_t space = line.find(' ');
                   if (line[0] != '#') line = line.substr(space + 1) + " " + line.substr(0, space);
                 }
                 D::write(f + "/rgb.txt", all);
               },
               {"rgb.txt:4", "timestamp"}},
        Damage{"tum_pose_columns",
               "tum",
               kFr3Camera,
               [](const std::string& f) {
                 D::edit(f + "/groundtruth.txt", 3, "qx qy qz qw", "qw qx qy qz");
               },
               {"groundtruth.txt:3", "another order", "qx qy qz qw"}},
        Damage{"tum_depth_at_other_times",
               "tum",
               kFr3Camera,
               [](const std::string& f) {
                 auto all = D::lines(f + "/depth.txt");
                 for (auto& line : all) {
                   if (line[0] != '#') line.replace(0, 4, "1205");
                 }
                 D::write(f + "/depth.txt", all);
               },
               {"depth.txt", "0.02 s"}},
        // ICL-NUIM
        Damage{"icl_without_associations",
               "icl",
               kIclCamera,
               [](const std::string& f) { fs::remove(f + "/associations.txt"); },
               {"not a sequence", "associations.txt"}},
        Damage{"icl_without_ground_truth",
               "icl",
               kIclCamera,
               [](const std::string& f) { fs::remove(f + "/livingRoom2.gt.freiburg"); },
               {"motion", "gt.freiburg"}},
        Damage{"icl_with_two_ground_truths",
               "icl",
               kIclCamera,
               [](const std::string& f) {
                 fs::copy_file(f + "/livingRoom2.gt.freiburg", f + "/livingRoom3.gt.freiburg");
               },
               {"two ground truths"}},
        Damage{"icl_without_an_image",
               "icl",
               kIclCamera,
               [](const std::string& f) { fs::remove(f + "/rgb/7.png"); },
               {"rgb/7.png", "no such"}},
        Damage{"icl_columns_in_one_row",
               "icl",
               kIclCamera,
               [](const std::string& f) {
                 D::edit(f + "/associations.txt", 5, "4 depth/4.png 4 rgb/4.png",
                         "4 rgb/4.png 4 depth/4.png");
               },
               {"associations.txt:5", "swapped"}},
        Damage{"icl_two_depth_columns",
               "icl",
               kIclCamera,
               [](const std::string& f) {
                 D::edit(f + "/associations.txt", 1, "rgb/0.png", "depth/0.png");
               },
               {"associations.txt:1", "two depth images"}},
        Damage{"icl_backwards",
               "icl",
               kIclCamera,
               [](const std::string& f) { D::swapLines(f + "/associations.txt", 5, 6); },
               {"associations.txt:6", "backwards"}},
        Damage{"icl_image_size",
               "icl",
               kIclCamera,
               [](const std::string& f) { D::replaceImage(f + "/rgb/7.png", kSmall); },
               {"640x480", "32x24", "7.png"}},
        Damage{"icl_missing_column",
               "icl",
               kIclCamera,
               [](const std::string& f) { D::edit(f + "/associations.txt", 5, " rgb/4.png", ""); },
               {"associations.txt:5", "missing column"}},
        // EuRoC
        Damage{"euroc_without_image_list",
               "euroc",
               "",
               [](const std::string& f) { fs::remove(f + "/mav0/cam0/data.csv"); },
               {"cam0/data.csv"}},
        Damage{"euroc_without_sensor",
               "euroc",
               "",
               [](const std::string& f) { fs::remove(f + "/mav0/cam0/sensor.yaml"); },
               {"cam0/sensor.yaml"}},
        Damage{
            "euroc_without_ground_truth",
            "euroc",
            "",
            [](const std::string& f) { fs::remove_all(f + "/mav0/state_groundtruth_estimate0"); },
            {"motion", "state_groundtruth_estimate0"}},
        Damage{"euroc_without_an_image",
               "euroc",
               "",
               [](const std::string& f) { fs::remove(firstImage(f + "/mav0/cam0/data")); },
               {"cam0/data/1305031102", "no such"}},
        Damage{"euroc_image_size",
               "euroc",
               "",
               [](const std::string& f) {
                 D::replaceImage(firstImage(f + "/mav0/cam0/data"), kSmall);
               },
               {"sensor.yaml", "752x480", "32x24"}},
        Damage{"euroc_image_columns",
               "euroc",
               "",
               [](const std::string& f) {
                 D::edit(f + "/mav0/cam0/data.csv", 1, "timestamp [ns],filename",
                         "filename,timestamp [ns]");
               },
               {"cam0/data.csv:1", "timestamp,filename"}},
        Damage{"euroc_pose_columns",
               "euroc",
               "",
               [](const std::string& f) {
                 D::edit(f + "/mav0/state_groundtruth_estimate0/data.csv", 1,
                         "q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []",
                         "q_RS_x [], q_RS_y [], q_RS_z [], q_RS_w []");
               },
               {"state_groundtruth_estimate0/data.csv:1", "q_RS_w"}},
        Damage{"euroc_nan_pose",
               "euroc",
               "",
               [](const std::string& f) {
                 const std::string file = f + "/mav0/state_groundtruth_estimate0/data.csv";
                 auto all = D::lines(file);
                 all[4] = all[4].substr(0, all[4].find(',')) + ",nan,0,0,1,0,0,0,0,0,0";
                 D::write(file, all);
               },
               {"state_groundtruth_estimate0/data.csv:5: p_RS_R_x", "finite"}},
        Damage{"euroc_backwards",
               "euroc",
               "",
               [](const std::string& f) {
                 D::swapLines(f + "/mav0/state_groundtruth_estimate0/data.csv", 5, 6);
               },
               {"state_groundtruth_estimate0/data.csv:6", "backwards"}},
        Damage{"euroc_seconds_for_nanoseconds",
               "euroc",
               "",
               [](const std::string& f) {
                 auto all = D::lines(f + "/mav0/cam0/data.csv");
                 all[1].insert(10, ".");
                 D::write(f + "/mav0/cam0/data.csv", all);
               },
               {"cam0/data.csv:2", "nanoseconds"}},
        Damage{"euroc_extrinsics",
               "euroc",
               "",
               [](const std::string& f) {
                 D::edit(f + "/mav0/cam0/sensor.yaml", 9, "0.0148655429818", "1.0148655429818");
               },
               {"sensor.yaml:7", "T_BS", "rotation"}}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace depthservo::test
