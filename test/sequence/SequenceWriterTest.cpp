#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/visp/using.h"
#include "support/InputErrors.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::inputErrorOf;
using test::isRefusal;

class SequenceWriterTest : public testing::Test {
 protected:
  SequenceSettings settings() {
    SequenceSettings settings;
    settings.name = "a \"quoted\": name # \xc3\xa9";
    settings.camera = {16, 12, 600 + random_.uniform(0, 1), -random_.uniform(500, 600), 7.1, 5.3};
    settings.target = {{random_.vector(1), random_.vector(1)}, random_.uniform(0, 0.1)};
    for (auto& point : settings.target.points) point.z() = 0;
    settings.dots = {{0, random_.uniform(0, 16), 2.5}, {1, 3, random_.uniform(0, 12)}};
    return settings;
  }
  vpImage<unsigned char> noise() {
    vpImage<unsigned char> image(12, 16);
    for (unsigned i = 0; i < image.getSize(); ++i) {
      image.bitmap[i] = static_cast<unsigned char>(random_.integer(0, 255));
    }
    return image;
  }

  test::TemporaryFolder folder_;
  test::Random random_{5};
};

TEST_F(SequenceWriterTest, everything_comes_back_to_the_bit) {
  const SequenceSettings written = settings();
  std::vector<vpImage<unsigned char>> images;
  std::vector<double> times;
  std::vector<Twist> twists;
  std::vector<PixelPoint> points;
  std::vector<double> depths;
  std::vector<Eigen::Vector3d> positions;
  {
    SequenceWriter writer(folder_ / "s");
    for (int i = 0; i < 20; ++i) {
      times.push_back(fileTime((i < 10 ? 0 : 1305031102.0) + i / 30.));
      images.push_back(noise());
      writer.addImage(times.back(), images.back());
      twists.push_back(random_.twist(1, 1));
      writer.addOdometry(times.back(), twists.back());
      points.push_back({i % 2, random_.uniform(0, 16), random_.uniform(0, 12)});
      writer.addTrack(times.back(), points.back());
      depths.push_back(random_.uniform(0.1, 3));
      writer.addTruth(times.back(), {0, depths.back()});
      Eigen::Isometry3d wMc = Eigen::Isometry3d::Identity();
      positions.push_back(random_.vector(3));
      wMc.translation() = positions.back();
      writer.addPose(times.back(), wMc);
    }
    writer.finish(written);
  }
  const Sequence read(folder_ / "s");
  EXPECT_EQ(read.name(), written.name);
  EXPECT_EQ(read.camera().fx, written.camera.fx);
  EXPECT_EQ(read.camera().fy, written.camera.fy);
  EXPECT_EQ(read.camera().cx, written.camera.cx);
  EXPECT_EQ(read.target().points, written.target.points);
  EXPECT_EQ(read.target().radius, written.target.radius);
  ASSERT_EQ(read.dots().size(), 2u);
  EXPECT_EQ(read.dots()[1].v, written.dots[1].v);
  ASSERT_EQ(read.frames().size(), times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const SequenceFrame& frame = read.frames()[i];
    EXPECT_EQ(frame.time_s, times[i]);
    EXPECT_TRUE(read.readImage(i) == images[i]);
    ASSERT_EQ(frame.tracks.size(), 1u);
    EXPECT_EQ(frame.tracks[0].id, points[i].id);
    EXPECT_EQ(frame.tracks[0].u, points[i].u);
    EXPECT_EQ(frame.tracks[0].v, points[i].v);
    EXPECT_EQ(frame.truth[0].Z, depths[i]);
    EXPECT_EQ(read.odometry()[i].time_s, times[i]);
    EXPECT_EQ(read.odometry()[i].twist.linear, twists[i].linear);
    EXPECT_EQ(read.odometry()[i].twist.angular, twists[i].angular);
    EXPECT_EQ(read.poses()[i].wMc.translation(), positions[i]);
  }
}

TEST_F(SequenceWriterTest, file_time_is_a_fixed_point) {
  for (const double epoch : {0., 1e6, 1305031102., 1.7e9}) {
    for (int i = 0; i < 1000; ++i) {
      const double t = fileTime(epoch + random_.uniform(0, 100));
      EXPECT_EQ(fileTime(t), t);
    }
  }
}

TEST_F(SequenceWriterTest, file_time_is_that_of_the_text) {
  const auto expectText = [](double t) {
    char text[64];
    std::snprintf(text, sizeof text, "%.9f", t);
    EXPECT_EQ(fileTime(t), std::strtod(text, nullptr)) << text;
  };
  for (int i = 0; i < 20000; ++i) {
    expectText(i / 30.);
    expectText(random_.uniform(-1e7, 1e7));
    expectText(i / 1024.);         // halves of a nanosecond
    expectText((i + 0.5) * 1e-9);  // nearly
    expectText(4e6 + i / 1024.);
  }
  EXPECT_TRUE(std::isnan(fileTime(std::nan(""))));
}

TEST_F(SequenceWriterTest, leaves_nothing_when_it_is_not_finished) {
  {
    SequenceWriter writer(folder_ / "s");
    writer.addImage(0, noise());
    writer.addTrack(0, {0, 1, 1});
    EXPECT_FALSE(fs::exists(folder_ / "s"));
  }
  EXPECT_TRUE(folder_.isEmpty());
}

TEST_F(SequenceWriterTest, refuses_a_folder_that_exists_before_or_in_the_meantime) {
  fs::create_directory(folder_ / "s");
  EXPECT_TRUE(
      isRefusal(inputErrorOf([&] { SequenceWriter(folder_ / "s"); }), {"/s", "exists already"}));
  {
    SequenceWriter writer(folder_ / "t");
    writer.addTrack(0, {0, 1, 1});
    fs::create_directory(folder_ / "t");
    EXPECT_TRUE(isRefusal(inputErrorOf([&] { writer.finish(settings()); }), {"/t", "exists"}));
  }
  EXPECT_TRUE(fs::is_empty(folder_ / "t"));
}

TEST_F(SequenceWriterTest, refuses_a_place_that_cannot_be_written) {
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { SequenceWriter(folder_ / "none/s"); }),
                        {"none/s", "is not a folder"}));
  EXPECT_TRUE(isRefusal(inputErrorOf([] { SequenceWriter("/proc/s"); }), {"/proc/s"}));
  EXPECT_TRUE(isRefusal(inputErrorOf([] { SequenceWriter(""); }), {"folder"}));
  folder_.write("file", "");
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { SequenceWriter(folder_ / "file/s"); }), {"file/s"}));
}

TEST_F(SequenceWriterTest, writes_no_files_without_rows) {
  SequenceWriter writer(folder_ / "s/");
  writer.addTrack(0, {0, 1, 1});
  SequenceSettings bare;
  bare.camera = settings().camera;
  writer.finish(bare);
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_ / "s")) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"camera.yaml", "sequence.yaml", "tracks.csv"}));
  EXPECT_EQ(Sequence(folder_ / "s").name(), "s");
}

}  // namespace
}  // namespace depthservo
