#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "depthservo/sequence/VideoSource.h"
#include "sequence/videoModule.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::inputErrorOf;
using test::isRefusal;

/// What a source gives until its end.
struct Taken {
  std::vector<double> times_s;
  std::vector<int> grays;  // of the pixel in the middle
  std::vector<std::string> skipped;
  std::string end;
};

Taken takeAll(const std::string& source, const VideoOptions& options) {
  VideoSource images(source, options);
  Taken taken;
  TimedImage image;
  for (;;) {
    const ImageStatus status = images.next(image);
    if (status == ImageStatus::ended) break;
    if (status == ImageStatus::skipped) {
      taken.skipped.push_back(images.reason());
      continue;
    }
    taken.times_s.push_back(image.time_s);
    taken.grays.push_back(image.image[image.image.getHeight() / 2][image.image.getWidth() / 2]);
  }
  taken.end = images.reason();
  return taken;
}

class SeriesTest : public testing::Test {
 protected:
  SeriesTest() {
    for (int i = 1; i <= 7; ++i) write(i, cv::Mat(16, 24, CV_8U, cv::Scalar(10 * i)));
  }
  std::string name(int number) const {
    return folder_ / ("shot-0" + std::to_string(number) + ".png");
  }
  void write(int number, const cv::Mat& pixels) const { cv::imwrite(name(number), pixels); }
  Taken take(double fps, const std::vector<double>& times = {}) const {
    VideoOptions options;
    options.fps = fps;
    options.times = times;
    return takeAll(series_, options);
  }
  test::TemporaryFolder folder_;
  std::string series_ = folder_ / "shot-%02d.png";
};

TEST_F(SeriesTest, gives_every_image_and_says_so) {
  const Taken taken = take(20);
  EXPECT_EQ(taken.grays, (std::vector<int>{10, 20, 30, 40, 50, 60, 70}));
  EXPECT_EQ(taken.times_s[6], 0.3);
  EXPECT_TRUE(taken.skipped.empty());
  EXPECT_EQ(taken.end, "all 7 images read");
}

TEST_F(SeriesTest, leaves_out_what_is_missing_damaged_or_of_another_depth_and_names_it) {
  fs::remove(name(2));
  fs::resize_file(name(4), 60);
  write(6, cv::Mat(16, 24, CV_16U, cv::Scalar(60000)));
  const Taken taken = take(0, {1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(taken.grays, (std::vector<int>{10, 30, 50, 70}));
  EXPECT_EQ(taken.times_s, (std::vector<double>{1, 3, 5, 7}));
  ASSERT_EQ(taken.skipped.size(), 3u);
  EXPECT_TRUE(isRefusal(taken.skipped[0], {"shot-02.png", "missing"}));
  EXPECT_TRUE(isRefusal(taken.skipped[1], {"shot-04.png", "cut off"}));
  EXPECT_TRUE(isRefusal(taken.skipped[2], {"shot-06.png", "16 bits"}));
  EXPECT_TRUE(isRefusal(taken.end, {"4 of 7 images", "shot-02.png", "shot-04.png", "shot-06.png"}));
}

TEST_F(SeriesTest, says_when_there_are_more_times_or_fewer_than_images) {
  EXPECT_TRUE(isRefusal(take(0, {1, 2, 3, 4, 5, 6, 7, 8, 9}).end,
                        {"7 of 9 images", "9 times given", "7 images"}));
  EXPECT_TRUE(isRefusal(take(0, {1, 2, 3, 4}).end, {"4 of 7 images", "4 times given"}));
  fs::remove(name(1));
  EXPECT_TRUE(isRefusal(inputErrorOf([&] {
                          take(0, {1, 2, 3, 4, 5, 6, 7});
                        }),
                        {"7 times", "6 images", "shot-02.png", "first image missing"}));
}

TEST_F(SeriesTest, of_16_bits_is_stretched_as_a_sequence_is) {
  for (int i = 1; i <= 7; ++i) write(i, cv::Mat(16, 24, CV_16U, cv::Scalar(100 * i)));
  EXPECT_EQ(take(20).grays[6], 174);  // 700 of 1023
}

TEST_F(SeriesTest, without_times_or_files_is_refused) {
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { take(0); }), {"shot-", "--fps", "--times"}));
  series_ = folder_ / "none-%d.png";
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { take(20); }), {"none-", "no first image"}));
  series_ = folder_ / "%s.png";
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { take(20); }), {"%06d"}));
}

std::string bigEndian(unsigned value) {
  std::string digits;
  for (int i = 3; i >= 0; --i) digits += static_cast<char>(value >> (8 * i) & 0xFF);
  return digits;
}

/// An MP4 file, with its index behind the images, whose boxes tests change.
class Mp4Test : public testing::Test {
 protected:
  void SetUp() override {
    cv::VideoWriter writer(video_, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 25,
                           {64, 48});
    if (!writer.isOpened()) GTEST_SKIP() << "this OpenCV writes no MP4";
    for (int i = 0; i < kImages; ++i) {
      writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(10 * i)));
    }
    writer.release();
    bytes_ = folder_.read("video.mp4");
  }

  /// The duration of the first images stays what it is, that of the others becomes `factor` times
  /// longer: a second entry in the table `stts`, in all boxes around it.
  void slowDown(unsigned first, unsigned factor) {
    const std::size_t stts = bytes_.find("stts");
    ASSERT_NE(stts, std::string::npos);
    ASSERT_LT(bytes_.find("mdat"), stts);
    const std::string delta = bytes_.substr(stts + 16, 4);
    unsigned ticks = 0;
    for (const char c : delta) ticks = ticks << 8 | static_cast<unsigned char>(c);
    bytes_.replace(stts + 8, 12,
                   bigEndian(2) + bigEndian(first) + delta + bigEndian(kImages - first) +
                       bigEndian(factor * ticks));
    bytes_.replace(bytes_.find("edts"), 4, "free");  // the list of what is shown ends too early
    for (const char* box : {"stts", "stbl", "minf", "mdia", "trak", "moov"}) {
      const std::size_t at = bytes_.rfind(box, stts);
      unsigned size = 0;
      for (int i = 0; i < 4; ++i) size = size << 8 | static_cast<unsigned char>(bytes_[at - 4 + i]);
      bytes_.replace(at - 4, 4, bigEndian(size + 8));
    }
    folder_.write("video.mp4", bytes_);
  }

  static constexpr int kImages = 24;
  test::TemporaryFolder folder_;
  std::string video_ = folder_ / "video.mp4", bytes_;
};

TEST_F(Mp4Test, of_constant_rate_has_exact_times) {
  const Taken taken = takeAll(video_, {});
  ASSERT_EQ(taken.times_s.size(), std::size_t{kImages});
  for (int i = 0; i < kImages; ++i) EXPECT_EQ(taken.times_s[static_cast<std::size_t>(i)], i / 25.);
  EXPECT_NEAR(taken.grays[10], 100, 3);
  EXPECT_EQ(taken.end, "end of the file: 24 images");
}

TEST_F(Mp4Test, of_variable_rate_has_the_times_of_the_container) {
  slowDown(10, 5);
  VideoOptions options;
  options.start_s = 100;
  const Taken taken = takeAll(video_, options);
  ASSERT_EQ(taken.times_s.size(), std::size_t{kImages});
  EXPECT_NEAR(taken.times_s[9], 100 + 9 / 25., 1e-6);
  EXPECT_NEAR(taken.times_s[23], 100 + 10 / 25. + 13 * 0.2, 1e-6);
  EXPECT_NEAR(VideoSource(video_, {}).fps(), 25, 1e-9);  // not the mean
  EXPECT_TRUE(isRefusal(taken.end, {"24 images", "container", "3.000 s"}));
  options.fps = 50;
  EXPECT_EQ(takeAll(video_, options).times_s[23], 100.46);
}

TEST_F(Mp4Test, to_be_shown_turned_is_refused) {
  constexpr std::size_t kMatrix = 44;  // from the type of the box on
  const std::size_t header = bytes_.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  const std::string one = bigEndian(1u << 16), zero = bigEndian(0);
  bytes_.replace(header + kMatrix, 20, zero + one + zero + bigEndian(0xFFFF0000u) + zero);
  folder_.write("video.mp4", bytes_);
  EXPECT_TRUE(
      isRefusal(inputErrorOf([&] { takeAll(video_, {}); }), {"video.mp4", "turned", "ffmpeg"}));
}

TEST(VideoModule, that_is_missing_or_rubbish_is_named) {
  test::TemporaryFolder folder;
  const auto refusal = [&] {
    return inputErrorOf([&] {
      detail::loadVideoModule({folder / "none.so", folder / "video.so"});
    });
  };
  EXPECT_TRUE(isRefusal(refusal(), {"video.so", "missing", "%06d.png"}));
  folder.write("video.so", "this is no library");
  EXPECT_TRUE(isRefusal(refusal(), {"video.so", "cannot be loaded"}));
}

}  // namespace
}  // namespace depthservo
