#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zstd.h>

#include <chrono>
#include <filesystem>

#include "bagParts.h"
#include "depthservo/motion/Motion.h"
#include "depthservo/sequence/RecordingInfo.h"
#include "depthservo/sequence/Sequence.h"
#include "sequence/ImageFile.h"
#include "sequence/bag/rosImage.h"
#include "support/InputErrors.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

/// Of this program so far, at most 512 MiB. Not under the sanitizer, which keeps what was freed.
void expectLittleMemory() {
#ifndef __SANITIZE_ADDRESS__
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 512 * 1024) << "kB";
#endif
}

using test::inputErrorOf;
using test::isRefusal;
using test::McapParts;

const std::string kBags = std::string(DEPTHSERVO_BAGS) + "/";
const char* const kBagFiles[] = {"lz4.bag",   "bz2.bag",    "png.bag", "lz4.mcap",
                                 "zstd.mcap", "little.db3", "big.db3"};

double distance(const Twist& a, const Twist& b) { return (a.vector() - b.vector()).norm(); }

bool hasWarning(const Sequence& sequence, const std::string& words) {
  for (const std::string& warning : sequence.warnings()) {
    if (warning.find(words) != std::string::npos) return true;
  }
  return false;
}

class BagOfOthersTest : public testing::TestWithParam<const char*> {};

TEST_P(BagOfOthersTest, gives_what_our_own_layout_gives) {
  const Sequence own(kBags + "drive");
  SequenceOptions options;
  options.target = kBags + "drive/sequence.yaml";
  const Sequence bag(kBags + GetParam(), options);
  ASSERT_EQ(bag.frames().size(), own.frames().size());
  for (std::size_t k = 0; k < own.frames().size(); ++k) {
    EXPECT_EQ(bag.frames()[k].time_s, own.frames()[k].time_s);
    EXPECT_TRUE(bag.readImage(k) == own.readImage(k)) << k;
  }
  EXPECT_EQ(bag.camera().fx, own.camera().fx);
  EXPECT_EQ(bag.camera().cy, own.camera().cy);
  EXPECT_EQ(bag.seen().rows, RowMeaning::hold);
  ASSERT_EQ(bag.odometry().size(), own.odometry().size());
  for (std::size_t i = 0; i < own.odometry().size(); ++i) {
    EXPECT_EQ(bag.odometry()[i].time_s, own.odometry()[i].time_s);
    EXPECT_LT(distance(bag.odometry()[i].twist, own.odometry()[i].twist), 1e-9);
  }
  EXPECT_TRUE(hasWarning(bag, "0.004 s")) << "the clocks' difference";
}

TEST_P(BagOfOthersTest, is_described) {
  const RecordingInfo info = describeRecording(kBags + GetParam(), {});
  std::size_t used = 0;
  for (const RecordedTopic& topic : info.topics) {
    used += !topic.use.empty();
    if (topic.use != "odometry") continue;
    EXPECT_EQ(topic.messages, 80u);
    EXPECT_NEAR(topic.rate_hz, 50, 1e-6);
    ASSERT_TRUE(topic.age);
    EXPECT_NEAR(topic.age->median_s, 0.004, 1e-9);
  }
  EXPECT_EQ(used, 3u);
  EXPECT_EQ(info.frames.size(), 2u);
  EXPECT_EQ(info.missing, "");
}

/// Everything of a bag, as a replay reads it.
struct Whole {
  explicit Whole(const std::string& path) : sequence(path) {
    for (std::size_t k = 0; k < sequence.frames().size(); ++k) {
      try {
        sequence.readImage(k);
        ++images;
      } catch (const InputError& error) {
        EXPECT_TRUE(isRefusal(error.what(), {path}));
      }
    }
    for (const OdometryRow& row : sequence.odometry()) EXPECT_TRUE(row.twist.isFinite());
  }
  Sequence sequence;
  std::size_t images = 0;
};

TEST_P(BagOfOthersTest, cut_off_anywhere_it_is_refused_or_what_is_whole_is_read_and_told) {
  const std::string name = GetParam();
  test::TemporaryFolder folder;
  const std::string all = [&] {
    std::ostringstream bytes;
    bytes << std::ifstream(kBags + name, std::ios::binary).rdbuf();
    return bytes.str();
  }();
  const std::string path = (folder / name).string();
  std::size_t recovered = 0, before = 0;
  for (std::size_t size = 0; size < all.size(); size += 1000) {
    folder.write(name, all.substr(0, size));
    try {
      const Whole cut(path);
      ++recovered;
      EXPECT_GE(cut.images, before) << size;
      before = cut.images;
      EXPECT_TRUE(hasWarning(cut.sequence, "cut off") || hasWarning(cut.sequence, "damaged"))
          << size;
    } catch (const InputError& error) {
      EXPECT_TRUE(isRefusal(error.what(), {name})) << size;
    }
  }
  const bool isSqlite = name.find(".db3") != std::string::npos;
  EXPECT_TRUE(recovered > 0 || isSqlite);
}

TEST_P(BagOfOthersTest, with_flipped_bytes_it_is_refused_or_read) {
  const std::string name = GetParam();
  test::TemporaryFolder folder;
  std::filesystem::copy_file(kBags + name, folder / name);
  const std::string path = (folder / name).string();
  const auto size = static_cast<int>(std::filesystem::file_size(path));
  test::Random random(7);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  int refused = 0, read = 0;
  for (int round = 0; round < 150; ++round) {
    // Every third time where the structure is: at the ends.
    const int at = round % 3 == 0   ? random.integer(0, std::min(size, 6000) - 1)
                   : round % 3 == 1 ? size - 1 - random.integer(0, std::min(size, 6000) - 1)
                                    : random.integer(0, size - 1);
    file.seekg(at);
    const char was = static_cast<char>(file.get());
    file.seekp(at);
    file.put(static_cast<char>(was ^ (1 << random.integer(0, 7))));
    file.flush();
    try {
      const Whole flipped(path);
      ++read;
    } catch (const InputError& error) {
      ++refused;
      EXPECT_TRUE(isRefusal(error.what(), {name})) << at;
    }
    file.seekp(at);
    file.put(was);
    file.flush();
  }
  EXPECT_EQ(refused + read, 150);
  EXPECT_GT(read, 20);
  expectLittleMemory();
}

INSTANTIATE_TEST_SUITE_P(All, BagOfOthersTest, testing::ValuesIn(kBagFiles));

/// A bag made of parts.
class BagTest : public testing::Test {
 protected:
  BagTest() {
    records_ = McapParts::channel(1, "/camera/image_raw", "sensor_msgs/msg/Image") +
               McapParts::channel(2, "/camera/camera_info", "sensor_msgs/msg/CameraInfo") +
               McapParts::channel(3, "/vel", "geometry_msgs/msg/TwistStamped") +
               McapParts::channel(4, "/tf_static", "tf2_msgs/msg/TFMessage") +
               McapParts::message(2, 100, test::infoMessage(100));
    for (const double t : {100.0, 100.1, 100.2}) {
      records_ += McapParts::message(1, t, test::imageMessage(t, "camera"));
    }
  }
  void addTwists(const std::string& frame, const std::vector<double>& twist) {
    for (const double t : {100.0, 100.1, 100.2}) add(3, t, test::twistStamped(t, frame, twist));
  }
  void add(std::uint16_t channel, double received_s, const std::string& message) {
    records_ += McapParts::message(channel, received_s, message);
  }
  Sequence open(const SequenceOptions& options = {}) const {
    folder_.write("a.mcap", McapParts::file(records_));
    return Sequence((folder_ / "a.mcap").string(), options);
  }
  std::string refusal(const SequenceOptions& options = {}) const {
    return inputErrorOf([&] { open(options); });
  }

  test::TemporaryFolder folder_;
  std::string records_;
};

TEST_F(BagTest, a_twist_in_the_cameras_frame_is_its_own) {
  addTwists("camera", {1, 2, 3, 0.1, 0.2, 0.3});
  const Sequence s = open();
  EXPECT_EQ(s.frames().size(), 3u);
  EXPECT_EQ(s.camera().fy, 11);
  ASSERT_EQ(s.odometry().size(), 3u);
  EXPECT_EQ(s.odometry()[1].twist.vector(), (Vector6d() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  EXPECT_EQ(s.seen().rows, RowMeaning::meanBefore) << "as drivers have it";
}

TEST_F(BagTest, a_chain_of_transforms_up_and_down_leads_to_the_camera) {
  // The base turns at 1 rad/s; the camera looks ahead (z of the camera is x of the base) 0.5 m in
  // front: it moves aside, to its left, at 0.5 m/s: x of the camera is -y of the base.
  addTwists("wheel", {0, 0, 0, 0, 0, 1});
  add(4, 100,
      test::transforms({{"base", "wheel", {0, 0.2, 0}, {0, 0, 0, 1}},
                        {"base", "head", {0.3, 0.2, 1}, {0, 0, 0, 1}},
                        {"/head", "/camera", {0.2, 0, 0}, {-0.5, 0.5, -0.5, 0.5}}}));
  const Twist twist = open().odometry()[0].twist;
  EXPECT_LT(distance(twist, {{-0.5, 0, 0}, {0, -1, 0}}), 1e-12);
}

TEST_F(BagTest, a_frame_that_is_not_connected_or_moves_is_refused_in_one_line) {
  addTwists("base", {0, 0, 0, 0, 0, 1});
  EXPECT_TRUE(isRefusal(refusal(), {"a.mcap", "/vel", "base", "camera", "--camera-in-base"}));
  add(4, 100, test::transforms({{"base", "camera", {0, 0, 0}, {0, 0, 0, 1}}}));
  EXPECT_EQ(refusal(), "");
  add(4, 101, test::transforms({{"base", "camera", {0, 0, 0.1}, {0, 0, 0, 1}}}));
  EXPECT_TRUE(isRefusal(refusal(), {"moves"}));
  SequenceOptions options;
  options.cameraInBase = RpyPose{{0.5, 0, 0}, {-M_PI / 2, 0, -M_PI / 2}};
  EXPECT_LT(distance(open(options).odometry()[0].twist, {{-0.5, 0, 0}, {0, -1, 0}}), 1e-12);
}

TEST_F(BagTest, a_twist_without_a_header_has_the_time_of_reception_and_needs_its_frame) {
  records_ += McapParts::channel(5, "/cmd_vel", "geometry_msgs/msg/Twist");
  for (const double t : {100.01, 100.11}) add(5, t, test::Cdr().doubles({1, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(isRefusal(refusal(), {"/cmd_vel", "@base_link"}));
  SequenceOptions options;
  options.topics = {"odometry=/cmd_vel@camera"};
  const Sequence s = open(options);
  EXPECT_EQ(s.odometry()[0].time_s, 100.01);
  EXPECT_TRUE(hasWarning(s, "times of reception"));
}

TEST_F(BagTest, candidates_are_listed_and_names_are_checked) {
  records_ += McapParts::channel(6, "/other", "sensor_msgs/msg/Image");
  add(6, 100, test::imageMessage(100, "other"));
  addTwists("camera", {0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(isRefusal(refusal(), {"a.mcap", "2 topics", "/other", "/camera/image_raw"}));
  SequenceOptions options;
  options.topics = {"image=/nothing"};
  EXPECT_TRUE(isRefusal(refusal(options), {"/nothing", "/camera/image_raw"}));
  options.topics = {"image=/vel"};
  EXPECT_TRUE(isRefusal(refusal(options), {"/vel", "TwistStamped", "expected"}));
  options.topics = {"picture=/other"};
  EXPECT_TRUE(isRefusal(refusal(options), {"picture", "image"}));
  options.topics = {"image"};
  EXPECT_TRUE(isRefusal(refusal(options), {"ROLE=TOPIC"}));
  options.topics = {"image=/camera/image_raw", "odometry=none"};
  EXPECT_TRUE(open(options).odometry().empty());
}

TEST_F(BagTest, another_schema_is_told_and_its_messages_are_left_out) {
  addTwists("camera", {0, 0, 0, 0, 0, 0});
  add(3, 100.3, test::infoMessage(100));
  EXPECT_TRUE(hasWarning(open(), "1 of 4 messages are no geometry_msgs/TwistStamped"));
  records_ += McapParts::channel(7, "/json", "nav_msgs/msg/Odometry", "json");
  add(7, 100, "{}");
  SequenceOptions options;
  options.topics = {"odometry=/json"};
  EXPECT_TRUE(isRefusal(refusal(options), {"/json", "json", "cdr"}));
}

TEST_F(BagTest, stamps_count_not_reception_and_a_clock_that_jumps_back_is_refused) {
  add(3, 105, test::twistStamped(100.1, "camera", {1, 0, 0, 0, 0, 0}));
  add(3, 105.1, test::twistStamped(100.05, "camera", {2, 0, 0, 0, 0, 0}));
  add(3, 105.2, test::twistStamped(100.1, "camera", {3, 0, 0, 0, 0, 0}));
  const Sequence s = open();
  ASSERT_EQ(s.odometry().size(), 2u);
  EXPECT_EQ(s.odometry()[0].twist.linear.x(), 2);
  EXPECT_TRUE(hasWarning(s, "/vel 5.05 s"));
  EXPECT_TRUE(hasWarning(s, "1 messages with a time that another has"));
  add(3, 105.3, test::twistStamped(90, "camera", {0, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(isRefusal(refusal(), {"/vel", "jump back"}));
}

TEST_F(BagTest, a_lens_that_is_no_pinhole_is_refused_and_rectified_images_have_none) {
  records_ += McapParts::channel(8, "/eye/image_rect", "sensor_msgs/msg/Image") +
              McapParts::channel(9, "/eye/camera_info", "sensor_msgs/msg/CameraInfo");
  add(8, 100, test::imageMessage(100, "eye"));
  add(9, 100, test::infoMessage(100, "plumb_bob", {0.1, 0, 0, 0, 0}));
  SequenceOptions options;
  options.topics = {"image=/eye/image_rect"};
  const Sequence s = open(options);
  EXPECT_EQ(s.camera().fx, 9);
  EXPECT_TRUE(s.camera().distortion.isNone());
  records_ += McapParts::channel(10, "/fish/image_raw", "sensor_msgs/msg/Image") +
              McapParts::channel(11, "/fish/camera_info", "sensor_msgs/msg/CameraInfo");
  add(10, 100, test::imageMessage(100, "fish"));
  add(11, 100, test::infoMessage(100, "equidistant", {0, 0, 0, 0}));
  options.topics = {"image=/fish/image_raw"};
  EXPECT_TRUE(isRefusal(refusal(options), {"/fish/camera_info", "equidistant"}));
}

TEST_F(BagTest, not_packed_it_is_refused_or_read_wherever_it_is_cut_off_or_flipped) {
  addTwists("camera", {1, 2, 3, 0.1, 0.2, 0.3});
  const std::string path = (folder_ / "a.mcap").string();
  for (const bool hasChunk : {false, true}) {
    const std::string all =
        McapParts::file(hasChunk ? McapParts::chunk("", records_.size(), records_) : records_);
    int refused = 0, read = 0;
    const auto open = [&](const std::string& bytes, std::size_t at) {
      folder_.write("a.mcap", bytes);
      try {
        const Whole whole(path);
        ++read;
      } catch (const InputError& error) {
        ++refused;
        EXPECT_TRUE(isRefusal(error.what(), {"a.mcap"})) << at;
      }
    };
    for (std::size_t at = 0; at < all.size(); at += 3) {
      open(all.substr(0, at), at);
      std::string flipped = all;
      flipped[at] = static_cast<char>(flipped[at] ^ (1 << at % 8));
      open(flipped, at);
    }
    EXPECT_GT(refused, 100) << hasChunk;
    EXPECT_GT(read, 100) << hasChunk;
  }
}

TEST_F(BagTest, sizes_are_checked_before_anything_is_unpacked) {
  const std::string good = records_;
  const auto started = std::chrono::steady_clock::now();
  std::string bomb(ZSTD_compressBound(1 << 24), '\0');
  const std::string zeros(1 << 24, '\0');
  bomb.resize(ZSTD_compress(bomb.data(), bomb.size(), zeros.data(), zeros.size(), 3));
  const struct {
    const char* packing;
    std::uint64_t size;
    std::string bytes;
    const char* told;
  } kChunks[] = {{"zstd", std::uint64_t{1} << 60, bomb, "up to"},
                 {"lz4", std::uint64_t{1} << 40, "abc", "up to"},
                 {"zstd", 1000, bomb, "zstd"},
                 {"lz4", 1000, "not lz4 at all", "lz4"},
                 {"rar", 1000, "x", "'rar'"}};
  for (const auto& chunk : kChunks) {
    records_ = good + McapParts::chunk(chunk.packing, chunk.size, chunk.bytes);
    EXPECT_TRUE(hasWarning(open(), "1 of 2 chunks are damaged")) << chunk.packing;
    EXPECT_TRUE(hasWarning(open(), chunk.told)) << chunk.packing;
  }
  records_ = good + McapParts::record(6, std::string(60, '\xff'));
  EXPECT_TRUE(hasWarning(open(), "damaged"));
  EXPECT_LT(std::chrono::steady_clock::now() - started, std::chrono::seconds(10));
  expectLittleMemory();
}

TEST_F(BagTest, a_chunk_whose_index_names_no_topic_that_is_needed_is_passed_over) {
  const std::string head = McapParts::file("");
  const std::string before =
      records_ + McapParts::channel(12, "/lidar", "sensor_msgs/msg/PointCloud2");
  const std::uint64_t place = head.size() - 8 - 29 + before.size();
  const std::string damaged = McapParts::chunk("zstd", 1000, "cannot be unpacked");
  test::Packed index;
  index.number(std::uint64_t{0}).number(std::uint64_t{0}).number(place);
  index.number(std::uint64_t{damaged.size()}).number(10u);
  index.number(std::uint16_t{12}).number(std::uint64_t{0}).number(std::uint64_t{0});
  index.text("zstd").number(std::uint64_t{1}).number(std::uint64_t{1000});
  records_ = before + damaged;
  EXPECT_TRUE(hasWarning(open(), "damaged"));
  records_ += McapParts::record(8, index);
  EXPECT_FALSE(hasWarning(open(), "damaged"));
}

TEST(TwistOfCameraTest, camera_and_body_make_the_same_rigid_motion) {
  test::Random random(3);
  for (int i = 0; i < 50; ++i) {
    const auto vector = [&](double most) {
      return Eigen::Vector3d(random.uniform(-most, most), random.uniform(-most, most),
                             random.uniform(-most, most));
    };
    const Eigen::Isometry3d bMc = RpyPose{vector(0.5), vector(1.5)}.isometry();
    const Twist body{vector(1), vector(1)};
    const Motion motion = Motion::fromTwist(body, 0.7);  // p_now = R p_before + t
    Eigen::Isometry3d nowMbefore = Eigen::Isometry3d::Identity();
    nowMbefore.linear() = motion.R;
    nowMbefore.translation() = motion.t;
    const Eigen::Isometry3d ofCamera = bMc.inverse() * nowMbefore * bMc;
    const Motion camera{ofCamera.linear(), ofCamera.translation(), motion.dt, motion.dt2};
    EXPECT_LT(distance(twistOfCamera(bMc, body), camera.twist()), 1e-9);
  }
}

TEST(RosImageTest, every_encoding_gives_its_gray) {
  const struct {
    const char* encoding;
    std::vector<unsigned char> pixel;
    unsigned gray;
  } kCases[] = {{"mono8", {77}, 77},
                {"rgb8", {200, 100, 50}, 124},  // 0.299 R + 0.587 G + 0.114 B = 124.2
                {"bgr8", {50, 100, 200}, 124},
                {"rgba8", {200, 100, 50, 9}, 124},
                {"bgra8", {50, 100, 200, 9}, 124},
                {"yuv422", {128, 77}, 77},
                {"yuv422_yuy2", {77, 128}, 77},
                {"bayer_rggb8", {77}, 77}};
  for (const auto& one : kCases) {
    constexpr std::uint32_t kWidth = 6, kHeight = 4, kMargin = 3;
    const auto step = kWidth * static_cast<std::uint32_t>(one.pixel.size()) + kMargin;
    std::string pixels;
    for (std::uint32_t v = 0; v < kHeight; ++v) {
      for (std::uint32_t u = 0; u < kWidth; ++u) pixels.append(one.pixel.begin(), one.pixel.end());
      pixels.append(kMargin, '\xff');
    }
    const auto message = [&](const std::string& bytes) {
      return std::string(test::Cdr()
                             .header(1, "c")
                             .number(kHeight)
                             .number(kWidth)
                             .text(one.encoding)
                             .number(std::uint8_t{0})
                             .number(step)
                             .blob(bytes));
    };
    const auto format = detail::rosImageFormat(detail::MessageEncoding::cdr);
    const auto image = detail::ImageFile("x", message(pixels), format).gray();
    ASSERT_EQ(image.getWidth(), kWidth);
    for (unsigned i = 0; i < image.getSize(); ++i)
      EXPECT_EQ(image.bitmap[i], one.gray) << one.encoding;
    EXPECT_TRUE(
        isRefusal(inputErrorOf([&] { detail::ImageFile("x", message(pixels.substr(1)), format); }),
                  {"pixels are missing"}));
  }
}

TEST(RosImageTest, of_16_bits_in_both_orders) {
  for (const bool isBig : {false, true}) {
    const std::string level = isBig ? std::string("\x03\xE8", 2) : std::string("\xE8\x03", 2);
    const std::string message = test::Cdr()
                                    .header(1, "c")
                                    .number(1u)
                                    .number(2u)
                                    .text("mono16")
                                    .number(static_cast<std::uint8_t>(isBig))
                                    .number(4u)
                                    .blob(level + level);
    const detail::ImageFile image("x", message,
                                  detail::rosImageFormat(detail::MessageEncoding::cdr));
    EXPECT_TRUE(image.isWhiteUnknown());
    EXPECT_EQ(image.levels16(), (std::vector<std::uint16_t>{1000, 1000}));
  }
}

TEST(CameraInBaseTest, turns_the_rows_of_a_folder_too) {
  test::TemporaryFolder folder;
  folder.write("camera.yaml",
               "image_width: 8\nimage_height: 6\n"
               "camera_matrix: {rows: 3, cols: 3, data: [10, 0, 3.5, 0, 11, 2.5, 0, 0, 1]}\n");
  folder.write("tracks.csv", "timestamp,id,u,v\n1,0,1,2\n1.1,0,1,2\n");
  SequenceOptions options;
  options.cameraInBase = RpyPose{{0.5, 0, 0}, {-M_PI / 2, 0, -M_PI / 2}};
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { Sequence(folder.path(), options); }),
                        {"--camera-in-base", "twist.csv"}));
  folder.write("twist.csv", "timestamp,vx,vy,vz,wx,wy,wz\n1,0.1,0,0,0,0,1\n");
  const Sequence s(folder.path(), options);
  EXPECT_LT(distance(s.odometry()[0].twist, {{-0.5, 0, 0.1}, {0, -1, 0}}), 1e-12);
}

}  // namespace
}  // namespace depthservo
