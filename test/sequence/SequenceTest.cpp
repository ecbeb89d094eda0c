#include <gtest/gtest.h>
#include <visp3/blob/vpDot2.h>
#include <visp3/core/vpIoTools.h>
#include <visp3/core/vpPixelMeterConversion.h>
#include <visp3/vision/vpPose.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "depthservo/motion/Motion.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/visp/using.h"
#include "support/InputErrors.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::inputErrorOf;
using test::isRefusal;

const std::string kCamera =
    "image_width: 8\nimage_height: 6\ncamera_name: c\n"
    "camera_matrix: {rows: 3, cols: 3, data: [10, 0, 3.5, 0, 11, 2.5, 0, 0, 1]}\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
    "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
    "projection_matrix: {rows: 3, cols: 4, data: [10, 0, 3.5, 0, 0, 11, 2.5, 0, 0, 0, 1, 0]}\n";
const std::string kPgm = "P5\n8 6\n255\n" + std::string(48, '\x50');

/// A small complete sequence, of which tests break one file.
class SequenceTest : public testing::Test {
 protected:
  SequenceTest() {
    folder_.write("camera.yaml", kCamera);
    folder_.write(
        "sequence.yaml",
        "name: small\ndepth_scale: 1000\ntarget: {type: dots, points: [[0, 0, 0], [0.1, 0, "
        "0]], radius: 0.01}\ndots: [[1, 2], [3, 4]]\n");
    folder_.write("rgb.txt", "# timestamp path\n100.1 a.pgm\n100.2 b.pgm\n");
    folder_.write("a.pgm", kPgm);
    folder_.write("b.pgm", kPgm);
    folder_.write("depth.txt", "100.1 d.png\n100.2 e.png\n");
    folder_.write("tracks.csv", "timestamp,id,u,v\n100.1,1,3,4\n100.1,0,1,2\n100.2,1,3.5,4\n");
    folder_.write("truth.csv", "timestamp,id,Z\n100.1,0,2\n100.2,0,1.9\n");
    folder_.write("twist.csv",
                  "timestamp,vx,vy,vz,wx,wy,wz\n100,1,2,3,4,5,6\n100.05,0,0,0,0,0,0\n");
    folder_.write("groundtruth.txt", "# t\n100 1 2 3 0 0 0 1\n100.1 1 2 3 0.5 -0.5 0.5 0.5\n");
  }
  Sequence open(const SequenceOptions& options = {}) const {
    return Sequence(folder_.path(), options);
  }
  void remove(const std::string& name) const { fs::remove(folder_ / name); }
  std::string refusal(const SequenceOptions& options = {}) const {
    return inputErrorOf([&] {
      const Sequence sequence = open(options);
      for (std::size_t i = 0; i < sequence.frames().size(); ++i) {
        if (sequence.hasImages()) sequence.readImage(i);
      }
    });
  }

  test::TemporaryFolder folder_;
};

TEST_F(SequenceTest, reads_every_file_of_the_layout) {
  const Sequence s = open();
  EXPECT_EQ(s.name(), "small");
  EXPECT_EQ(s.camera().width, 8);
  EXPECT_EQ(s.camera().fy, 11);
  ASSERT_EQ(s.frames().size(), 2u);
  EXPECT_EQ(s.frames()[1].time_s, 100.2);
  ASSERT_EQ(s.frames()[0].tracks.size(), 2u);
  EXPECT_EQ(s.frames()[0].tracks[1].u, 3);
  EXPECT_EQ(s.frames()[1].tracks[0].id, 1);
  EXPECT_EQ(s.frames()[1].truth[0].Z, 1.9);
  ASSERT_EQ(s.odometry().size(), 2u);
  EXPECT_EQ(s.odometry()[0].twist.linear, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(s.odometry()[0].twist.angular, Eigen::Vector3d(4, 5, 6));
  ASSERT_EQ(s.poses().size(), 2u);
  EXPECT_EQ(s.poses()[0].wMc.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(s.depthImages().size(), 2u);
  EXPECT_EQ(s.depthScale(), 1000);
  EXPECT_EQ(s.target().points.size(), 2u);
  EXPECT_EQ(s.dots()[1].v, 4);
  EXPECT_EQ(s.readImage(0)[5][7], 0x50);
  EXPECT_TRUE(s.warnings().empty());
}

TEST_F(SequenceTest, without_images_the_times_of_tracks_and_truth_are_the_frames) {
  remove("rgb.txt");
  folder_.write("truth.csv",
                "timestamp,id,Z\n100.1,0,2\n100.15,0,1.95\n100.2,0,1.9\n100.3,0,1.8\n");
  const Sequence s = open();
  EXPECT_FALSE(s.hasImages());
  ASSERT_EQ(s.frames().size(), 4u);
  EXPECT_TRUE(s.frames()[1].tracks.empty());  // all hidden
  EXPECT_EQ(s.frames()[1].truth[0].Z, 1.95);
  EXPECT_EQ(s.frames()[2].tracks.size(), 1u);
}

TEST_F(SequenceTest, tracks_at_other_times_than_images_are_reported) {
  folder_.write("tracks.csv", "timestamp,id,u,v\n100.1,1,3,4\n100.15,0,1,2\n");
  EXPECT_EQ(open().warnings().size(), 1u);
  folder_.write("tracks.csv", "timestamp,id,u,v\n0.1,1,3,4\n0.15,0,1,2\n");
  EXPECT_TRUE(isRefusal(refusal(), {"tracks.csv", "rgb.txt"}));
}

TEST_F(SequenceTest, a_downloaded_tum_folder_opens_with_a_preset_and_its_lens_distortion) {
  for (const char* file :
       {"camera.yaml", "sequence.yaml", "tracks.csv", "truth.csv", "twist.csv"}) {
    remove(file);
  }
  EXPECT_TRUE(isRefusal(refusal(), {"camera.yaml", "--camera"}));
  remove("a.pgm");
  const Sequence s = open({"tum-fr1", 0});
  EXPECT_EQ(s.camera().fx, 517.3);
  EXPECT_EQ(s.camera().distortion.k1(), 0.2624);
  EXPECT_EQ(s.warnings().size(), 0u);
  EXPECT_EQ(open({"icl", 0}).camera().fy, -480);
  EXPECT_TRUE(open({"tum-fr3", 0}).camera().distortion.isNone());
  EXPECT_TRUE(isRefusal(refusal({"tum-fr4", 0}), {"tum-fr4", "nearest", "tum-fr"}));
}

TEST_F(SequenceTest, a_numbered_image_folder_opens_with_camera_and_fps) {
  test::TemporaryFolder images;
  images.write("camera.yaml", kCamera);
  for (const char* name : {"image.0009.pgm", "image.0010.pgm", "image.0011.pgm"}) {
    images.write(name, kPgm);
  }
  images.write("notes.txt", "x");
  const Sequence s(images.path(), {images / "camera.yaml", 25});
  ASSERT_EQ(s.frames().size(), 3u);
  EXPECT_EQ(s.frames()[2].time_s, 2 / 25.);
  EXPECT_NE(s.frames()[2].image.find("image.0011.pgm"), std::string::npos);
  const auto refusal = [&](double fps) {
    return inputErrorOf([&] { Sequence(images.path(), {"", fps}); });
  };
  EXPECT_TRUE(isRefusal(refusal(0), {"--fps"}));
  EXPECT_TRUE(isRefusal(refusal(-1), {"--fps", "Hz"}));
  fs::remove(images / "image.0010.pgm");
  EXPECT_TRUE(isRefusal(refusal(25), {"10", "missing"}));
  images.write("other1.png", "x");
  EXPECT_TRUE(isRefusal(refusal(25), {"two series"}));
}

TEST_F(SequenceTest, images_elsewhere_are_found_in_the_folder_and_below_visp_input_image_path) {
  remove("rgb.txt");
  remove("tracks.csv");
  remove("truth.csv");
  remove("depth.txt");
  remove("twist.csv");
  remove("groundtruth.txt");
  test::TemporaryFolder data;
  fs::create_directories(data / "ViSP-images/run-1");
  data.write("ViSP-images/run-1/i3.pgm", kPgm);
  setenv("VISP_INPUT_IMAGE_PATH", data.path().c_str(), 1);
  for (const char* name : {"run-1", "ViSP-images/run-1"}) {
    folder_.write("sequence.yaml",
                  std::string("images: {folder: ") + name + ", pattern: i%d.pgm, rate: 10}\n");
    EXPECT_EQ(open().frames().size(), 1u) << name;
  }
  unsetenv("VISP_INPUT_IMAGE_PATH");
  EXPECT_TRUE(isRefusal(refusal(), {"sequence.yaml:1: images.folder", "visp-images-data"}));
  fs::create_directory(folder_ / "ViSP-images");
  fs::create_directory(folder_ / "ViSP-images/run-1");
  EXPECT_TRUE(isRefusal(refusal(), {"sequence.yaml:1: images.pattern", "no file"}));
  folder_.write("ViSP-images/run-1/i1.pgm", kPgm);
  EXPECT_EQ(open({"", 5}).frames().size(), 1u);
  for (const char* pattern : {"i.pgm", "i%s.pgm", "i%d%d.pgm", "i%04x.pgm", "i%n%d", "i%"}) {
    folder_.write("sequence.yaml", std::string("images: {folder: ViSP-images/run-1, pattern: '") +
                                       pattern + "', rate: 10}\n");
    EXPECT_TRUE(isRefusal(refusal(), {"images.pattern", "%04d"})) << pattern;
  }
}

TEST_F(SequenceTest, points_of_a_target_may_lie_off_a_plane) {
  folder_.write("target.yaml", "target: {points: [[0, 0, 0.5], [0.1, 0, -0.2]]}\n");
  const auto points = readTarget(folder_ / "target.yaml").target.points;
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0], Eigen::Vector3d(0, 0, 0.5));
  EXPECT_EQ(points[1], Eigen::Vector3d(0.1, 0, -0.2));
}

TEST_F(SequenceTest, files_may_be_links) {
  fs::rename(folder_ / "a.pgm", folder_ / "real.pgm");
  fs::create_symlink(folder_ / "real.pgm", folder_ / "a.pgm");
  EXPECT_EQ(refusal(), "");
}

struct BrokenSequence {
  const char* name;
  std::string file, content;
  std::vector<std::string> words;
};
void PrintTo(const BrokenSequence& broken, std::ostream* out) { *out << broken.name; }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

class BrokenSequenceTest : public SequenceTest,
                           public testing::WithParamInterface<BrokenSequence> {};

TEST_P(BrokenSequenceTest, is_refused_naming_the_file) {
  folder_.write(GetParam().file, GetParam().content);
  EXPECT_TRUE(isRefusal(refusal(), GetParam().words));
}

INSTANTIATE_TEST_SUITE_P(
    , BrokenSequenceTest,
    testing::Values(
        BrokenSequence{"image_size",
                       "camera.yaml",
                       replaced(kCamera, "width: 8", "width: 9"),
                       {"camera.yaml", "9x6", "8x6", "a.pgm"}},
        BrokenSequence{"second_image_size",
                       "b.pgm",
                       "P5\n4 4\n255\n" + std::string(16, 'x'),
                       {"camera.yaml", "8x6", "4x4", "b.pgm"}},
        BrokenSequence{"distortion_that_folds",
                       "camera.yaml",
                       replaced(kCamera, "data: [0, 0, 0, 0, 0]", "data: [-9, 0, 0, 0, 0]"),
                       {"camera.yaml:6: distortion_coefficients", "folds", "pixel (0, 0)"}},
        BrokenSequence{"distortion_model",
                       "camera.yaml",
                       replaced(replaced(kCamera, "data: [0, 0, 0, 0, 0]", "data: [1, 0, 0, 0, 0]"),
                                "plumb_bob", "equidistant"),
                       {"camera.yaml:5: distortion_model", "equidistant", "plumb_bob"}},
        BrokenSequence{"skew",
                       "camera.yaml",
                       replaced(kCamera, "[10, 0,", "[10, 1,"),
                       {"camera.yaml:4: camera_matrix", "fx, 0, cx"}},
        BrokenSequence{"no_focal_length",
                       "camera.yaml",
                       replaced(kCamera, "[10, 0,", "[0, 0,"),
                       {"camera.yaml:4: camera_matrix", "px"}},
        BrokenSequence{"camera_nan",
                       "camera.yaml",
                       replaced(kCamera, "3.5, 0, 11", ".nan, 0, 11"),
                       {"camera.yaml:4: camera_matrix.data", "finite"}},
        BrokenSequence{"camera_short",
                       "camera.yaml",
                       replaced(kCamera, ", 0, 0, 1]", ", 0, 0]"),
                       {"camera.yaml:4: camera_matrix.data", "9 numbers"}},
        BrokenSequence{"camera_rows",
                       "camera.yaml",
                       replaced(kCamera, "rows: 3", "rows: 2"),
                       {"camera.yaml:4: camera_matrix.rows"}},
        BrokenSequence{"camera_key",
                       "camera.yaml",
                       replaced(kCamera, "camera_name", "camera_nam"),
                       {"camera.yaml:3: camera_nam", "'camera_name'"}},
        BrokenSequence{"camera_missing_key",
                       "camera.yaml",
                       "image_width: 8\n",
                       {"camera.yaml", "image_height", "missing"}},
        BrokenSequence{
            "missing_image", "rgb.txt", "100.1 a.pgm\n100.2 none.pgm\n", {"none.pgm", "no such"}},
        BrokenSequence{"folder_as_image", "rgb.txt", "100.1 a.pgm\n100.2 .\n", {"folder"}},
        BrokenSequence{"truncated_pgm", "b.pgm", kPgm.substr(0, 40), {"b.pgm", "cut off"}},
        BrokenSequence{"pgm_header", "b.pgm", "P5\n8 x", {"b.pgm"}},
        BrokenSequence{"empty_image", "b.pgm", "", {"b.pgm", "not an image"}},
        BrokenSequence{"text_as_image", "b.pgm", "hello", {"b.pgm", "not an image"}},
        BrokenSequence{"rgb_twice", "rgb.txt", "1 a.pgm\n1 b.pgm\n", {"rgb.txt:2", "twice"}},
        BrokenSequence{
            "rgb_backwards", "rgb.txt", "2 a.pgm\n1 b.pgm\n", {"rgb.txt:2", "backwards"}},
        BrokenSequence{"rgb_empty", "rgb.txt", "# nothing\n", {"rgb.txt", "no row"}},
        BrokenSequence{"rgb_without_path", "rgb.txt", "1\n", {"rgb.txt:1: path", "missing column"}},
        BrokenSequence{"depth_backwards", "depth.txt", "2 a\n1 b\n", {"depth.txt:2"}},
        BrokenSequence{"track_twice",
                       "tracks.csv",
                       "timestamp,id,u,v\n1,3,1,1\n1,2,1,1\n1,3,1,1\n",
                       {"tracks.csv:4: id", "3", "twice"}},
        BrokenSequence{"track_nan",
                       "tracks.csv",
                       "timestamp,id,u,v\n1,3,nan,1\n",
                       {"tracks.csv:2: u", "finite"}},
        BrokenSequence{"truth_twice",
                       "truth.csv",
                       "timestamp,id,Z\n1,3,1\n1,3,1\n",
                       {"truth.csv:3: id", "twice"}},
        BrokenSequence{"truth_zero", "truth.csv", "timestamp,id,Z\n1,3,0\n", {"truth.csv:2: Z"}},
        BrokenSequence{"twist_equal_times",
                       "twist.csv",
                       "timestamp,vx,vy,vz,wx,wy,wz\n1,0,0,0,0,0,0\n1,0,0,0,0,0,0\n",
                       {"twist.csv:3", "twice"}},
        BrokenSequence{"twist_column",
                       "twist.csv",
                       "timestamp,vx,vy,vz,wx,wy\n1,0,0,0,0,0\n",
                       {"twist.csv:1", "header"}},
        BrokenSequence{"quaternion",
                       "groundtruth.txt",
                       "1 0 0 0 0 0 0 0.5\n",
                       {"groundtruth.txt:1: qx", "unit quaternion", "0.5"}},
        BrokenSequence{"pose_column",
                       "groundtruth.txt",
                       "1 0 0 0 0 0 1\n",
                       {"groundtruth.txt:1: qw", "missing column"}},
        BrokenSequence{
            "settings_key", "sequence.yaml", "nmae: x\n", {"sequence.yaml:1: nmae", "'name'"}},
        BrokenSequence{"dots_and_points",
                       "sequence.yaml",
                       "target: {points: [[0, 0, 0]]}\ndots: [[1, 1], [2, 2]]\n",
                       {"sequence.yaml:2: dots", "1 points", "2"}},
        BrokenSequence{"tag_family",
                       "sequence.yaml",
                       "target: {type: apriltag, family: 36h12, tags: [{id: 1}]}\n",
                       {"sequence.yaml:1: target.family", "'36h11'"}},
        BrokenSequence{"tag_id",
                       "sequence.yaml",
                       "target: {type: apriltag, family: 16h5, tags: [{id: 30}]}\n",
                       {"sequence.yaml:1: target.tags.id", "29"}},
        BrokenSequence{"tag_twice",
                       "sequence.yaml",
                       "target: {type: apriltag, tags: [{id: 3}, {id: 3}]}\n",
                       {"sequence.yaml:1: target.tags.id", "twice"}},
        BrokenSequence{"no_tags",
                       "sequence.yaml",
                       "target: {type: apriltag, tags: []}\n",
                       {"sequence.yaml:1: target.tags", "at least 1"}},
        BrokenSequence{"tag_quaternion",
                       "sequence.yaml",
                       "target: {type: apriltag, tags: [{id: 3, quaternion: [0, 0, 0, 0]}]}\n",
                       {"sequence.yaml:1: target.tags.quaternion", "norm"}},
        BrokenSequence{"tags_and_points",
                       "sequence.yaml",
                       "target: {type: apriltag, points: [[0, 0, 0]], tags: [{id: 3}]}\n",
                       {"sequence.yaml:1: target.points", "dots"}},
        BrokenSequence{"images_and_rgb",
                       "sequence.yaml",
                       "images: {folder: '.', pattern: '%d.pgm', rate: 1}\n",
                       {"sequence.yaml"}}),
    [](const auto& param) { return std::string(param.param.name); });

TEST_F(SequenceTest, refuses_what_is_not_a_sequence) {
  const auto refusal = [](const std::string& path) {
    return inputErrorOf([&] { Sequence{path}; });
  };
  test::TemporaryFolder empty;
  EXPECT_TRUE(isRefusal(refusal(empty.path()), {"not a sequence", "rgb.txt"}));
  EXPECT_TRUE(isRefusal(refusal(empty / "none"), {"none", "no such folder"}));
  EXPECT_TRUE(isRefusal(refusal(folder_ / "a.pgm"), {"a.pgm", "neither a folder nor a bag"}));
  EXPECT_TRUE(isRefusal(refusal(""), {"no such folder"}));
}

TEST_F(SequenceTest, fps_is_refused_where_the_images_have_times) {
  EXPECT_TRUE(isRefusal(refusal({"", 30}), {"--fps", "rgb.txt"}));
}

/// Every way to lose the end of a file, or one byte of it, for each image format.
TEST_F(SequenceTest, damaged_images_give_an_image_or_an_input_error) {
  cv::Mat picture(6, 8, CV_8UC3);
  cv::randu(picture, 0, 255);
  test::Random random(3);
  for (const char* format : {".png", ".jpg", ".ppm", ".pgm"}) {
    cv::Mat pixels = picture;
    if (std::string(format) == ".pgm") pixels = picture.reshape(1).colRange(0, 8).clone();
    std::vector<unsigned char> bytes;
    cv::imencode(format, pixels, bytes);
    const std::string whole(bytes.begin(), bytes.end());
    folder_.write("b.pgm", whole);
    ASSERT_EQ(refusal(), "") << format;
    for (std::size_t length = 0; length < whole.size(); length += 3) {
      folder_.write("b.pgm", whole.substr(0, length));
      EXPECT_TRUE(isRefusal(refusal(), {"b.pgm"})) << format << " cut at " << length;
    }
    if (std::string(format) != ".png") continue;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      std::string damaged = whole;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << random.integer(0, 7)));
      folder_.write("b.pgm", damaged);
      EXPECT_TRUE(isRefusal(refusal(), {"b.pgm"})) << format << " byte " << i;
    }
  }
}

TEST_F(SequenceTest, colour_images_become_gray) {
  cv::imwrite(folder_ / "c.png", cv::Mat(6, 8, CV_8UC3, cv::Scalar(10, 100, 200)));  // B, G, R
  folder_.write("rgb.txt", "100.1 c.png\n");
  EXPECT_NEAR(open().readImage(0)[3][3], 0.299 * 200 + 0.587 * 100 + 0.114 * 10, 1);
}

TEST_F(SequenceTest, images_of_12_bits_are_stretched_and_this_is_said) {
  cv::imwrite(folder_ / "c.png", cv::Mat(6, 8, CV_16U, cv::Scalar(3000)));
  cv::imwrite(folder_ / "d16.png", cv::Mat(6, 8, CV_16U, cv::Scalar(4000)));
  folder_.write("rgb.txt", "100.1 c.png\n100.2 d16.png\n");
  const Sequence s = open();
  EXPECT_EQ(int(s.readImage(0)[0][0]), 187);  // of 4095
  EXPECT_EQ(int(s.readImage(1)[5][7]), 249);
  EXPECT_TRUE(isRefusal(s.warnings().at(0), {"c.png", "12 are used", "4095", "image_bits: 16"}));
  const std::string settings = folder_.read("sequence.yaml");
  folder_.write("sequence.yaml", settings + "image_bits: 16\n");
  EXPECT_EQ(int(open().readImage(0)[0][0]), 12);
  EXPECT_TRUE(open().warnings().empty());
  folder_.write("sequence.yaml", settings + "image_bits: 11\n");
  EXPECT_TRUE(isRefusal(refusal(), {"c.png", "3000", "11 of 16 bits", "image_bits"}));
  folder_.write("sequence.yaml", settings + "image_bits: 17\n");
  EXPECT_TRUE(isRefusal(refusal(), {"sequence.yaml:5: image_bits", "[8, 16]"}));
}

TEST_F(SequenceTest, an_image_of_16_bits_among_those_of_8_is_refused) {
  cv::imwrite(folder_ / "c.png", cv::Mat(6, 8, CV_16U, cv::Scalar(60000)));
  folder_.write("rgb.txt", "100.1 a.pgm\n100.2 c.png\n");
  EXPECT_TRUE(isRefusal(refusal(), {"c.png", "16 bits", "image_bits"}));
}

TEST_F(SequenceTest, is_refused_when_no_image_falls_in_the_time_of_the_motion) {
  folder_.write("twist.csv", "timestamp,vx,vy,vz,wx,wy,wz\n7,1,2,3,4,5,6\n8,0,0,0,0,0,0\n");
  EXPECT_TRUE(isRefusal(refusal(), {"twist.csv", "100.1 to 100.2 s", "odometry from 7 to 9 s"}));
  remove("twist.csv");
  folder_.write("groundtruth.txt", "900 1 2 3 0 0 0 1\n900.1 1 2 3 0 0 0 1\n");
  EXPECT_TRUE(isRefusal(refusal(), {"100.2 s", "ground truth from 900 to 900.2 s", "clock"}));
}

TEST_F(SequenceTest, tells_how_clocks_fit_together) {
  folder_.write("twist.csv",
                "timestamp,vx,vy,vz,wx,wy,wz\n99,1,2,3,4,5,6\n99.01,0,0,0,0,0,0\n"
                "99.02,0,0,0,0,0,0\n100.15,0,0,0,0,0,0\n");
  const Sequence s = open();
  ASSERT_TRUE(s.clocks());
  ASSERT_EQ(s.clocks()->holes.size(), 1u);
  EXPECT_EQ(s.clocks()->holes[0].from_s, 99.02);
  EXPECT_TRUE(isRefusal(s.warnings().back(), {"no odometry from 99.02 to 100.15 s"}));
  remove("twist.csv");
  remove("groundtruth.txt");
  EXPECT_FALSE(open().clocks());
}

TEST_F(SequenceTest, a_lens_that_is_no_pinhole_is_refused_whatever_its_coefficients) {
  for (const char* model : {"equidistant", "fisheye", "kannala_brandt4", "fov"}) {
    std::string camera = replaced(kCamera, "plumb_bob", model);
    for (const bool hasCoefficients : {true, false}) {
      if (!hasCoefficients) {
        const std::size_t first = camera.find("distortion_coeff");
        camera.erase(first, camera.find("rectification") - first);
      }
      folder_.write("camera.yaml", camera);
      EXPECT_TRUE(
          isRefusal(refusal(), {"camera.yaml:5: distortion_model", model, "plumb_bob", "zeros"}))
          << camera;
    }
  }
  for (const char* model : {"radtan", "rational_polynomial", "none"}) {
    folder_.write("camera.yaml", replaced(kCamera, "plumb_bob", model));
    EXPECT_EQ(refusal(), "") << model;
  }
}

TEST(OdometryFromPosesTest, leads_from_pose_to_pose) {
  test::Random random(1);
  std::vector<CameraPose> poses(20);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    poses[i].time_s = 1305031102.0 + 0.1 * static_cast<double>(i) + random.uniform(0, 0.05);
    poses[i].wMc.linear() =
        Eigen::AngleAxisd(random.uniform(0, 1.4), random.direction()).toRotationMatrix();
    poses[i].wMc.translation() = random.vector(2);
  }
  const std::vector<OdometryRow> rows = odometryFromPoses(poses);
  ASSERT_EQ(rows.size(), poses.size());
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    EXPECT_EQ(rows[i].time_s, poses[i].time_s);
    // A camera with twist (v, w) moves by exp(+(v, w) dt), here through the matrix exponential's
    // series.
    const double dt = poses[i + 1].time_s - poses[i].time_s;
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    const Eigen::Vector3d w = rows[i].twist.angular * dt;
    generator.topLeftCorner<3, 3>() << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    generator.topRightCorner<3, 1>() = rows[i].twist.linear * dt;
    Eigen::Matrix4d step = Eigen::Matrix4d::Identity(), term = step;
    for (int k = 1; k < 40; ++k) step += term = term * generator / k;
    EXPECT_LT((poses[i].wMc.matrix() * step - poses[i + 1].wMc.matrix()).norm(), 1e-9);
  }
  EXPECT_EQ(rows.back().time_s, poses.back().time_s);
  EXPECT_TRUE(odometryFromPoses({poses[0]}).empty());
}

TEST(Mire2Test, the_plate_points_fit_the_dots_of_the_images) {
  if (vpIoTools::getViSPImagesDataPath().empty()) GTEST_SKIP() << "visp-images-data is missing";
  const Sequence sequence(std::string(DEPTHSERVO_DATA) + "/sequences/mire-2");
  ASSERT_EQ(sequence.frames().size(), 501u);
  EXPECT_EQ(sequence.frames()[500].time_s, 20);
  const PinholeCamera& pinhole = sequence.camera();
  const vpCameraParameters camera(pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy);
  const vpImage<unsigned char> image = sequence.readImage(0);
  vpPose pose;
  for (std::size_t i = 0; i < 4; ++i) {
    vpDot2 dot;
    dot.initTracking(image, vpImagePoint(sequence.dots()[i].v, sequence.dots()[i].u));
    const Eigen::Vector3d& position = sequence.target().points[i];
    vpPoint point(position.x(), position.y(), 0);
    double x = 0, y = 0;
    vpPixelMeterConversion::convertPoint(camera, dot.getCog(), x, y);
    point.set_x(x);
    point.set_y(y);
    pose.addPoint(point);
  }
  vpHomogeneousMatrix cMo;
  pose.computePose(vpPose::DEMENTHON_VIRTUAL_VS, cMo);
  const double residual_px = pinhole.fx * std::sqrt(pose.computeResidual(cMo) / 4);
  EXPECT_LT(residual_px, 0.65);  // a wrong order gives 3.5
  EXPECT_NEAR(cMo[2][3], 0.6, 0.1);
}

}  // namespace
}  // namespace depthservo
