// Files for others' tools, read back by a parser that has nothing from the writer.

#include <gtest/gtest.h>
#include <zstd.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "depthservo/report/RunRecorder.h"
#include "depthservo/sequence/VideoSource.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"
#include "support/exampleLog.h"

namespace depthservo {
namespace {

using nlohmann::json;
using test::inputErrorOf;
using test::isRefusal;
using test::TemporaryFolder;

/// Bit by bit, as the standard defines it.
std::uint32_t crc32Of(const std::string& bytes) {
  std::uint32_t crc = ~0u;
  for (const unsigned char byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  return ~crc;
}

class Cursor {
 public:
  explicit Cursor(std::string bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t number(std::size_t size) {
    const std::string text = take(size);
    std::uint64_t value = 0;
    std::memcpy(&value, text.data(), size);
    return value;
  }
  std::string take(std::size_t size) {
    if (size > bytes_.size() - at_) throw std::runtime_error("the record is too short");
    return bytes_.substr((at_ += size) - size, size);
  }
  std::string string() { return take(number(4)); }
  std::string rest() { return take(bytes_.size() - at_); }
  bool isAtEnd() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

struct Record {
  int opcode;
  std::size_t at, size;  // with its head
  std::string content;
};

std::vector<Record> recordsIn(const std::string& bytes, std::size_t from, std::size_t to) {
  std::vector<Record> records;
  for (std::size_t at = from; at < to;) {
    std::uint64_t length = 0;
    std::memcpy(&length, &bytes[at + 1], 8);
    if (length > to - at - 9) throw std::runtime_error("a record ends behind the end");
    records.push_back({bytes[at], at, 9 + length, bytes.substr(at + 9, length)});
    at += 9 + length;
  }
  return records;
}

struct Message {
  std::uint64_t time_ns;
  json value;
};

/// Reads all of it, and compares whatever the file says twice.
struct McapFile {
  explicit McapFile(const std::string& b) : bytes(b) {
    const std::string magic("\x89MCAP0\r\n", 8);
    EXPECT_EQ(bytes.substr(0, 8), magic);
    EXPECT_EQ(bytes.substr(bytes.size() - 8), magic);
    records = recordsIn(bytes, 8, bytes.size() - 8);
    EXPECT_EQ(records.front().opcode, 1);
    EXPECT_EQ(records.back().opcode, 2);
    readData();
    checkSummary();
  }

  void readData() {
    for (const Record& record : records) {
      Cursor r(record.content);
      if (record.opcode == 15) {
        EXPECT_EQ(r.number(4), crc32Of(bytes.substr(0, record.at)));
        return;
      }
      if (record.opcode == 6) readChunk(record);
      if (record.opcode == 7) checkIndex(r);
      if (record.opcode == 12) metadata = r.string();
    }
    ADD_FAILURE() << "no end of data";
  }

  void readChunk(const Record& record) {
    Cursor r(record.content);
    const auto first = r.number(8), last = r.number(8), size = r.number(8), crc = r.number(4);
    EXPECT_EQ(r.string(), "zstd");
    const std::string packed = r.take(r.number(8));
    chunk.assign(size, '\0');
    ASSERT_EQ(ZSTD_decompress(chunk.data(), size, packed.data(), packed.size()), size);
    EXPECT_EQ(crc32Of(chunk), crc);
    ++chunks;
    for (const Record& inner : recordsIn(chunk, 0, chunk.size())) {
      Cursor c(inner.content);
      if (inner.opcode == 3) {
        const auto id = c.number(2);
        schemas[id] = c.string();
        EXPECT_EQ(c.string(), "jsonschema");
        EXPECT_EQ(json::parse(c.string())["title"], schemas[id]);
      } else if (inner.opcode == 4) {
        const auto id = c.number(2), schema = c.number(2);
        topics[id] = c.string();
        schemaOf[topics[id]] = schemas.at(schema);
        EXPECT_EQ(c.string(), "json");
      } else {
        ASSERT_EQ(inner.opcode, 5);
        const auto id = c.number(2), sequence = c.number(4), time_ns = c.number(8);
        auto& messages = byTopic[topics.at(id)];
        EXPECT_EQ(sequence, messages.size());
        EXPECT_EQ(c.number(8), time_ns);
        EXPECT_TRUE(first <= time_ns && time_ns <= last);
        places[{id, inner.at}] = time_ns;
        messages.push_back({time_ns, json::parse(c.rest())});
      }
    }
  }

  void checkIndex(Cursor& r) {
    const auto channel = r.number(2);
    Cursor entries(r.string());
    while (!entries.isAtEnd()) {
      const auto time_ns = entries.number(8), place = entries.number(8);
      EXPECT_EQ(places.at({channel, place}), time_ns);
      ++indexed;
    }
  }

  void checkSummary() {
    Cursor footer(records.back().content);
    const auto start = footer.number(8), offsets = footer.number(8), crc = footer.number(4);
    EXPECT_EQ(crc, crc32Of(bytes.substr(start, bytes.size() - 8 - 4 - start)));
    std::size_t total = 0, indices = 0;
    for (const auto& [topic, messages] : byTopic) total += messages.size();
    EXPECT_EQ(indexed, total);
    for (const Record& record : recordsIn(bytes, start, offsets)) {
      Cursor r(record.content);
      if (record.opcode == 11) {
        EXPECT_EQ(r.number(8), total);
        EXPECT_EQ(r.number(2), schemas.size());
        EXPECT_EQ(r.number(4), topics.size());
        EXPECT_EQ(r.number(4), 0u);
        EXPECT_EQ(r.number(4), 1u);
        EXPECT_EQ(r.number(4), chunks);
      }
      if (record.opcode != 8) continue;
      ++indices;
      r.number(8), r.number(8);
      const auto place = r.number(8), size = r.number(8);
      EXPECT_EQ(bytes.at(place), 6);
      EXPECT_EQ(bytes.at(place + size), 7) << "the message indices follow their chunk";
    }
    EXPECT_EQ(indices, chunks);
    for (const Record& record : recordsIn(bytes, offsets, records.back().at)) {
      ASSERT_EQ(record.opcode, 14);
      Cursor r(record.content);
      const auto opcode = r.number(1), place = r.number(8), size = r.number(8);
      for (const Record& member : recordsIn(bytes, place, place + size)) {
        EXPECT_EQ(member.opcode, static_cast<int>(opcode));
      }
    }
  }

  std::string bytes, chunk, metadata;
  std::vector<Record> records;
  std::map<std::uint64_t, std::string> schemas, topics;
  std::map<std::string, std::string> schemaOf;
  std::map<std::string, std::vector<Message>> byTopic;
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t> places;
  std::size_t chunks = 0, indexed = 0;
};

std::string fromBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255);
  }
  return bytes;
}

const std::vector<OdometryRow> kNoRows;

DEPTHSERVO_VISP vpImage<unsigned char> imageOf(int k) {
  DEPTHSERVO_VISP vpImage<unsigned char> image(48, 64);
  for (unsigned i = 0; i < image.getSize(); ++i) {
    image.bitmap[i] = static_cast<unsigned char>(37 * i + static_cast<unsigned>(k));
  }
  return image;
}

/// Tells the log image by image, as a run does.
void tell(const RunLog& whole, const RecordingFiles& files) {
  RunRecorder recorder(files);
  RunLog log = whole;
  log.frames.clear();
  log.events.clear();
  for (std::size_t k = 0; k < whole.frames.size(); ++k) {
    const FrameRecord& frame = whole.frames[k];
    Exposure exposure;
    exposure.time_s = frame.time_s;
    exposure.image = imageOf(static_cast<int>(k));
    log.frames.push_back(frame);
    for (const Event& event : whole.events) {
      if (event.time_s == frame.time_s) log.events.push_back(event);
    }
    recorder.add({log.frames.back(), exposure, log, kNoRows, RowMeaning::hold});
  }
  recorder.finish(whole);
}

RunLog movingLog() {
  RunLog log = test::exampleLog();
  for (FrameRecord& frame : log.frames) {
    for (FeatureRecord& f : frame.features) {
      f.estimate.x = (f.u - 319.5) / 600;
      f.estimate.y = (f.v - 239.5) / 600;
      f.estimate.sigma_xy = 1e-3;
    }
  }
  return log;
}

TEST(RunRecorder, writes_an_mcap_file_that_agrees_with_itself_and_with_the_log) {
  const TemporaryFolder folder;
  const RunLog log = movingLog();
  tell(log, {folder / "a.mcap", ""});
  const McapFile file(folder.read("a.mcap"));
  EXPECT_GT(file.chunks, 1u);
  EXPECT_EQ(file.metadata, "depthservo");
  for (const char* topic : {"/camera/image", "/camera/calibration", "/tf", "/depths",
                            "/depths/cloud", "/depths/scene", "/camera/annotations", "/robot"}) {
    ASSERT_EQ(file.byTopic.at(topic).size(), log.frames.size()) << topic;
  }
  EXPECT_EQ(file.schemaOf.at("/depths/cloud"), "foxglove.PointCloud");
  ASSERT_EQ(file.byTopic.at("/events").size(), log.events.size());
  EXPECT_EQ(file.byTopic.at("/events")[0].value["message"], log.events[0].what);
  EXPECT_EQ(file.byTopic.at("/diagnosis").back().value["message"], log.reason);

  for (std::size_t k = 0; k < log.frames.size(); ++k) {
    const FrameRecord& frame = log.frames[k];
    const Message& message = file.byTopic.at("/depths")[k];
    EXPECT_EQ(message.time_ns, static_cast<std::uint64_t>(std::llround(frame.time_s * 1e9)));
    EXPECT_EQ(message.value["timestamp"]["nsec"], message.time_ns % 1'000'000'000);
    ASSERT_EQ(message.value["points"].size(), frame.features.size());
    for (std::size_t i = 0; i < frame.features.size(); ++i) {
      const json& point = message.value["points"][i];
      const FeatureRecord& feature = frame.features[i];
      EXPECT_EQ(point["Z"], feature.estimate.Z());
      EXPECT_EQ(point["sigma_Z"], feature.estimate.sigma_Z());
      EXPECT_EQ(point["u"], feature.u);
      EXPECT_EQ(point["Z_true"], feature.Z_true);
      EXPECT_EQ(point["measured"], feature.measured);
      EXPECT_EQ(point.contains("Z_high"), std::isfinite(feature.estimate.interval().high));
    }
    const json& robot = file.byTopic.at("/robot")[k].value;
    EXPECT_EQ(robot["command"]["v"], frame.command[0]);
    EXPECT_EQ(robot["error_px"], frame.error_px);
    EXPECT_EQ(robot.contains("twist"), k > 0);
  }
}

TEST(RunRecorder, mcap_images_come_back_to_the_last_bit) {
  const TemporaryFolder folder;
  RunLog log = movingLog();
  log.frames.resize(3);
  tell(log, {folder / "a.mcap", ""});
  const McapFile file(folder.read("a.mcap"));
  for (int k = 0; k < 3; ++k) {
    const json& message = file.byTopic.at("/camera/image")[static_cast<std::size_t>(k)].value;
    folder.write("image.png", fromBase64(message["data"]));
    auto image = imageIn(folder / "image.png");
    ASSERT_TRUE(image);
    EXPECT_TRUE(*image == imageOf(k));
  }
}

/// The covariance against finite differences of where the point is.
TEST(RunRecorder, mcap_clouds_have_positions_and_their_covariances) {
  const TemporaryFolder folder;
  const RunLog log = movingLog();
  tell(log, {folder / "a.mcap", ""});
  const McapFile file(folder.read("a.mcap"));
  const json& cloud = file.byTopic.at("/depths/cloud")[100].value;
  const std::string data = fromBase64(cloud["data"]);
  const std::size_t stride = cloud["point_stride"];
  ASSERT_EQ(data.size(), 4 * stride);
  const auto value = [&](std::size_t point, const std::string& name) {
    for (const json& field : cloud["fields"]) {
      if (field["name"] != name) continue;
      EXPECT_EQ(field["type"], 8);
      double number = 0;
      std::memcpy(&number, &data[point * stride + field["offset"].get<std::size_t>()], 8);
      return number;
    }
    ADD_FAILURE() << name;
    return kUnknown;
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const DepthEstimate& e = log.frames[100].features[i].estimate;
    const auto place = [&](double dx, double dy, double dZ) {
      const double Z = e.Z() + dZ;
      return Eigen::Vector3d((e.x + dx) * Z, (e.y + dy) * Z, Z);
    };
    EXPECT_NEAR(value(i, "x"), place(0, 0, 0).x(), 1e-15);
    EXPECT_EQ(value(i, "z"), e.Z());
    constexpr double h = 1e-6;
    Eigen::Matrix3d spread;  // columns: one sigma of each
    spread << (place(h, 0, 0) - place(-h, 0, 0)) / (2 * h) * e.sigma_xy,
        (place(0, h, 0) - place(0, -h, 0)) / (2 * h) * e.sigma_xy,
        (place(0, 0, h) - place(0, 0, -h)) / (2 * h) * e.sigma_Z();
    const Eigen::Matrix3d C = spread * spread.transpose();
    const std::map<std::string, double> expectations = {{"cov_xx", C(0, 0)}, {"cov_xy", C(0, 1)},
                                                        {"cov_xz", C(0, 2)}, {"cov_yy", C(1, 1)},
                                                        {"cov_yz", C(1, 2)}, {"cov_zz", C(2, 2)}};
    for (const auto& [name, expected] : expectations) {
      EXPECT_NEAR(value(i, name), expected, 1e-8 * C.trace()) << name;
    }
  }
}

/// A camera that turns about its y axis (down) while it goes forward moves on a circle.
TEST(RunRecorder, tum_trajectory_of_a_constant_twist_is_a_circle) {
  const TemporaryFolder folder;
  constexpr double v = 0.3, w = 0.2, kStart = 1.7e9;
  RunLog log = movingLog();
  for (FrameRecord& frame : log.frames) {
    frame.time_s += kStart;
    frame.twist = {{0, 0, v}, {0, w, 0}};
  }
  tell(log, {"", folder / "a.tum"});
  std::istringstream lines(folder.read("a.tum"));
  std::size_t rows = 0;
  for (std::string line; std::getline(lines, line); ++rows) {
    std::istringstream fields(line);
    double t, x, y, z, qx, qy, qz, qw;
    ASSERT_TRUE(fields >> t >> x >> y >> z >> qx >> qy >> qz >> qw) << line;
    const double angle = w * (log.frames[rows].time_s - log.frames[0].time_s);
    EXPECT_NEAR(t, log.frames[rows].time_s, 1e-6);
    EXPECT_NEAR(x, v / w * (1 - std::cos(angle)), 1e-9);
    EXPECT_NEAR(z, v / w * std::sin(angle), 1e-9);
    EXPECT_NEAR(qy, std::sin(angle / 2), 1e-9);
    EXPECT_NEAR(qw, std::cos(angle / 2), 1e-9);
    EXPECT_NEAR(std::abs(y) + std::abs(qx) + std::abs(qz), 0, 1e-12);
  }
  EXPECT_EQ(rows, log.frames.size());
}

TEST(RunRecorder, motion_that_is_not_known_is_said_not_taken_for_rest) {
  const TemporaryFolder folder;
  RunLog log = movingLog();
  log.frames[5].twist = {};  // of a rig whose target tells the motion: none
  tell(log, {folder / "a.mcap", folder / "a.tum"});
  const std::string text = folder.read("a.tum");
  std::istringstream lines(text.substr(0, text.find('#')));
  std::size_t before = 0;
  for (std::string line; std::getline(lines, line);) ++before;
  EXPECT_EQ(before, 5u);
  EXPECT_EQ(text.find('#'), text.rfind('#'));
  EXPECT_FALSE(McapFile(folder.read("a.mcap")).byTopic.at("/robot")[5].value.contains("twist"));
}

TEST(RunRecorder, same_log_gives_the_same_bytes) {
  const TemporaryFolder folder;
  tell(movingLog(), {folder / "a.mcap", folder / "a.tum"});
  tell(movingLog(), {folder / "b.mcap", folder / "b.tum"});
  EXPECT_EQ(folder.read("a.mcap"), folder.read("b.mcap"));
  EXPECT_EQ(folder.read("a.tum"), folder.read("b.tum"));
}

TEST(RunRecorder, file_appears_whole_or_not_at_all) {
  const TemporaryFolder folder;
  {
    RunRecorder recorder({folder / "a.mcap", folder / "a.tum"});
    RunLog log = movingLog();
    recorder.add({log.frames[0], Exposure{}, log, kNoRows, RowMeaning::hold});
    EXPECT_FALSE(std::filesystem::exists(folder / "a.mcap"));
  }
  EXPECT_TRUE(folder.isEmpty());
  folder.write("there", "mine");
  for (const RecordingFiles& files :
       {RecordingFiles{folder / "there", ""}, RecordingFiles{"", folder / "there"}}) {
    EXPECT_TRUE(isRefusal(inputErrorOf([&] { RunRecorder{files}; }), {"there", "exists"}));
  }
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { RunRecorder({folder / "x", folder / "x"}); }), {"x"}));
  EXPECT_EQ(folder.read("there"), "mine");
}

TEST(RunRecorder, mcap_file_has_no_time_before_zero) {
  const TemporaryFolder folder;
  RunRecorder recorder({folder / "a.mcap", ""});
  RunLog log = movingLog();
  log.frames[0].time_s = -0.5;
  EXPECT_TRUE(isRefusal(inputErrorOf([&] {
                          recorder.add({log.frames[0], Exposure{}, log, kNoRows, RowMeaning::hold});
                        }),
                        {"a.mcap", "-0.5"}));
}

}  // namespace
}  // namespace depthservo
