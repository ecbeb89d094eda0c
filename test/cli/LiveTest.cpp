#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

/// A recorded drive, its replay, and what live makes of its images.
class LiveOfRecording : public testing::Test {
 protected:
  void SetUp() override {
    record(data("scenarios/unicycle-4dots.yaml") + " --set duration=2 --set expect=null",
           sequence_);
    series_ = sequence_ + "/rgb/%06d.png";
    fifo_ = folder_ / "twists";
    ASSERT_EQ(mkfifo(fifo_.c_str(), 0600), 0);
  }

  /// The run folder is that of a replay with these options.
  void expectReplayed(const std::string& options = "") const {
    const std::string replayed = folder_ / "replayed";
    const Result replay = depthservo("replay " + sequence_ + " " + options + " --out " + replayed);
    ASSERT_EQ(replay.exitCode, 0) << replay.err;
    expectSameEstimates(replayed, out(), 1e-9);
    EXPECT_EQ(log()["configuration"],
              nlohmann::json::parse(folder_.read("replayed/run.json"))["configuration"]);
  }

  /// \param meanwhile a shell command that runs beside it \param launcher runs what stands behind
  /// it
  Result live(const std::string& source, const std::string& more, const std::string& meanwhile = "",
              const std::string& launcher = "") const {
    return depthservo("live --source '" + source + "' --fps 30 --no-window --camera " + sequence_ +
                          "/camera.yaml --target " + sequence_ + "/sequence.yaml " + more,
                      (meanwhile.empty() ? "" : "(" + meanwhile + ") & ") + launcher);
  }
  std::string out() const { return folder_ / "out"; }
  std::string twistFile() const { return sequence_ + "/twist.csv"; }
  nlohmann::json log() const { return nlohmann::json::parse(folder_.read("out/run.json")); }

  TemporaryFolder folder_;
  std::string sequence_ = folder_ / "sequence", series_, fifo_;
};

TEST_F(LiveOfRecording, as_image_files_gives_the_estimates_of_replay) {
  const Result result = live(series_, "--twist " + twistFile() + " --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("all 61 images read"), std::string::npos) << result.err;
  expectReplayed();
  for (const char* file : {"run.json", "features.csv", "frames.csv", "report.html", "first.png"}) {
    EXPECT_TRUE(fs::exists(out() + "/" + file)) << file;
  }
}

TEST_F(LiveOfRecording, with_the_twists_of_a_base_gives_the_estimates_of_replay) {
  const std::string place = "--camera-in-base 0.1,-0.02,0.2,0.05,-0.03,0.02";
  const Result result = live(series_, "--twist " + twistFile() + " " + place + " --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed(place);
  expectRefused(live(series_, "--motion target " + place), {"--camera-in-base", "--twist"});
}

TEST_F(LiveOfRecording, as_lossless_video_gives_the_estimates_of_replay) {
  const std::string video = folder_ / "video.avi";
  cv::VideoWriter writer(video, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'P', 'N', 'G'), 30,
                         {640, 480});
  if (!writer.isOpened()) GTEST_SKIP() << "this OpenCV writes no PNG videos";
  for (int i = 1; fs::exists(fmt::format("{}/rgb/{:06}.png", sequence_, i)); ++i) {
    writer.write(cv::imread(fmt::format("{}/rgb/{:06}.png", sequence_, i)));
  }
  writer.release();
  const Result result = depthservo("live --source " + video + " --no-window --camera " + sequence_ +
                                   "/camera.yaml --target " + sequence_ +
                                   "/sequence.yaml --twist " + twistFile() + " --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed();
}

TEST_F(LiveOfRecording, with_twists_from_a_pipe_gives_the_estimates_of_replay) {
  const Result result = live(series_, "--rows hold --twist " + fifo_ + " --out " + out(),
                             "cat " + twistFile() + " > " + fifo_);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed();
}

TEST_F(LiveOfRecording, takes_twists_from_a_pipe_for_means_of_the_time_before) {
  const Result result =
      live(series_, "--twist " + fifo_ + " --out " + out(), "cat " + twistFile() + " > " + fifo_);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed("--rows mean-before");
}

TEST_F(LiveOfRecording, with_times_from_a_table_gives_the_estimates_of_replay) {
  const Result result = live(series_, "--times " + sequence_ + "/rgb.txt --start 99 --twist " +
                                          twistFile() + " --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed();
}

TEST_F(LiveOfRecording, follows_a_known_target_as_replay_does) {
  const Result result = live(series_, "--motion target --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed("--motion target");
}

TEST_F(LiveOfRecording, believes_what_replay_is_told_about_the_sensors) {
  const std::string told =
      "--joint time-offset,focal --focal-sigma 0.05 --prior 6:2 --pixel-noise 0.3 "
      "--odometry-noise 0.01,0.002 --odometry-scale-sigma 0.02";
  const Result result = live(series_, "--twist " + twistFile() + " --out " + out() + " " + told);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed(told);
}

TEST_F(LiveOfRecording, does_not_hang_on_a_pipe_that_nobody_writes_to) {
  const Result result = live(series_, "--twist " + fifo_ + " --patience 0.1 --json --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.json()["metrics"]["frames"], 61);
  EXPECT_NE(log()["events"].dump().find("twists are late"), std::string::npos) << log()["events"];
}

TEST_F(LiveOfRecording, coasts_while_twists_are_late_and_goes_on_when_they_come) {
  const Result result = live(series_, "--twist " + fifo_ + " --patience 0.3 --out " + out(),
                             "(head -n 20 " + twistFile() + "; sleep 1.5) > " + fifo_);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto features = readCsv(out() + "/features.csv");
  EXPECT_EQ(features.at("status").back(), "coasting");
  EXPECT_EQ(features.at("measured").back(), "1") << "it is seen; how far it is, is not known";
  const std::vector<std::string>& sigma_Z = features.at("sigma_Z");
  const auto known = std::find(features.at("status").begin(), features.at("status").end(), "valid");
  ASSERT_NE(known, features.at("status").end());
  const auto then = static_cast<std::size_t>(known - features.at("status").begin());
  EXPECT_GT(std::stod(sigma_Z.back()), 2 * std::stod(sigma_Z[then]));
  EXPECT_NE(log()["events"].dump().find("the motion is not known since"), std::string::npos)
      << log()["events"];
}

TEST_F(LiveOfRecording, counts_what_is_wrong_with_the_twists_and_uses_the_rest) {
  const Result result =
      live(series_, "--rows hold --twist " + fifo_ + " --json --out " + out(),
           "(head -n 10 " + twistFile() + "; echo rubbish; echo 0.1,nan,0,0,0,0,0; tail -n +11 " +
               twistFile() + "; echo 0,0,0,0,0,0,0; printf 99,0,0) > " + fifo_);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  expectReplayed();
  const std::string reason = result.json()["reason"];
  EXPECT_NE(reason.find("2 malformed"), std::string::npos) << reason;
  EXPECT_NE(log()["events"].dump().find("rubbish"), std::string::npos) << log()["events"];
}

TEST_F(LiveOfRecording, ends_at_the_last_whole_image_of_a_cut_video) {
  const std::string video = folder_ / "video.avi";
  cv::VideoWriter writer(video, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                         30, {640, 480});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 1; i <= 60; ++i) {
    writer.write(cv::imread(fmt::format("{}/rgb/{:06}.png", sequence_, i)));
  }
  writer.release();
  fs::resize_file(video, fs::file_size(video) / 2);
  const Result result = live(video, "--twist " + twistFile() + " --json --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_GT(result.json()["metrics"]["frames"], 20);
  EXPECT_LT(result.json()["metrics"]["frames"], 40);
  EXPECT_TRUE(fs::exists(out() + "/report.html"));
}

TEST_F(LiveOfRecording, goes_on_after_images_that_cannot_be_used_and_names_them) {
  const auto image = [&](int i) { return fmt::format("{}/rgb/{:06}.png", sequence_, i); };
  fs::remove(image(20));
  fs::resize_file(image(31), 700);
  cv::imwrite(image(40), cv::Mat(240, 320, CV_8U, cv::Scalar(200)));
  const Result result = live(series_, "--twist " + twistFile() + " --json --out " + out());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.json()["metrics"]["frames"], 58);
  const std::string events = log()["events"].dump(), reason = result.json()["reason"];
  for (const char* words : {"000020.png is missing", "000031.png is damaged", "320x240"}) {
    EXPECT_NE(events.find(words), std::string::npos) << words << " in " << events;
    EXPECT_NE(reason.find(words), std::string::npos) << words << " in " << reason;
  }
}

TEST_F(LiveOfRecording, keeps_its_log_when_it_is_interrupted) {
  // The pipe is silent and patience long: the first image waits. It opens when the tool reads it.
  const std::string id = folder_ / "id";
  const Result result = live(series_, "--patience 60 --twist " + fifo_ + " --out " + out(),
                             "exec 3> " + fifo_ + "; sleep 1; kill -INT $(cat " + id + ")",
                             "sh -c 'echo $$ > " + id + R"(; exec "$0" "$@"' )");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("stopped by the user"), std::string::npos) << result.err;
  EXPECT_TRUE(fs::exists(out() + "/report.html"));
}

TEST_F(LiveOfRecording, stops_after_the_duration) {
  const Result result = live(series_, "--duration 0.5 --json --twist " + twistFile());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.json()["metrics"]["frames"], 16);
}

TEST_F(LiveOfRecording, without_a_display_says_so_and_goes_on) {
  const Result result =
      depthservo("live --source '" + series_ + "' --fps 30 --camera " + sequence_ +
                     "/camera.yaml --target " + sequence_ + "/sequence.yaml --motion target",
                 "DISPLAY= ");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("no window"), std::string::npos) << result.err;
}

TEST_F(LiveOfRecording, refuses_what_cannot_be_used_in_one_line) {
  // Under the sanitizers: whole stacks, so that leaks of OpenCV's camera libraries are known as
  // such.
  setenv("ASAN_OPTIONS", "fast_unwind_on_malloc=0", 0);
  folder_.write("text.avi", "this is no video");
  folder_.write(
      "small.yaml",
      "image_width: 64\nimage_height: 48\ncamera_matrix: {rows: 3, cols: 3, data: [60, 0, "
      "32, 0, 60, 24, 0, 0, 1]}\n");
  folder_.write("nothing.yaml", "name: x\n");
  const std::string camera = " --camera " + sequence_ + "/camera.yaml",
                    target = " --target " + sequence_ + "/sequence.yaml",
                    twist = " --twist " + twistFile();
  const auto refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    SCOPED_TRACE(arguments);
    expectRefused(depthservo("live --no-window --out " + out() + " " + arguments), words);
    EXPECT_FALSE(fs::exists(out()));
  };
  refused("--source 77" + camera + target + twist, {"77", "no camera"});
  refused("--source /dev/video77" + camera + target + twist, {"/dev/video77", "no such camera"});
  refused("--source " + sequence_ + camera + target + twist, {"is a folder", "%06d"});
  refused("--source " + (folder_ / "none.avi").string() + camera + target + twist,
          {"none.avi", "no such file"});
  refused("--source " + (folder_ / "text.avi").string() + camera + target + twist,
          {"text.avi", "no video"});
  refused("--source '" + series_ + "'" + camera + target + twist, {"frame rate", "--fps"});
  const std::string source = "--source '" + series_ + "' --fps 30";
  refused(source + target + twist, {"--camera", "missing"});
  refused(source + " --camera " + (folder_ / "small.yaml").string() + target + twist,
          {"64x48", "640x480"});
  refused(source + camera + twist + " --tracker dots", {"no dots to track"});
  refused(source + camera + target + twist + " --tracker tracks", {"tracks.csv"});
  refused(source + camera + twist + " --target " + (folder_ / "nothing.yaml").string(),
          {"nothing.yaml", "target"});
  refused(source + camera + target + " --twist " + (folder_ / "none").string(), {"none"});
  refused(source + camera + target + twist + " --motion target", {"--twist", "--motion"});
  refused(source + camera + target + " --motion sideways", {"--motion", "sideways"});
  refused(source + camera + target + twist + " --prior -1", {"--prior"});
  refused(source + camera + twist + " --estimator pose", {"'pose'", "known target", "--target"});
  folder_.write("dots.yaml", "dots: [[100, 100], [200, 100], [100, 200], [200, 200]]\n");
  refused(
      source + camera + twist + " --estimator pose --target " + (folder_ / "dots.yaml").string(),
      {"'pose'", "four points", "dots.yaml"});
  folder_.write("pixels.yaml", "dots: [[100, 100]]\nreplay: {k: 20, k_3: 2.0e+9}\n");
  refused(source + camera + twist + " --target " + (folder_ / "pixels.yaml").string(),
          {"pixels.yaml", "replay.k_3", "unit"});
  fs::create_directory(folder_ / "empty");
  refused(
      "--fps 30 --source '" + (folder_ / "empty/%d.png").string() + "'" + camera + target + twist,
      {"first image"});
}

}  // namespace
}  // namespace depthservo::test
