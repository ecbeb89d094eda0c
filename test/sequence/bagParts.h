#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace depthservo::test {

/// Bytes of numbers and texts as MCAP and ROS 1 have them: packed, little-endian.
class Packed {
 public:
  template <class Number>
  Packed& number(Number value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes_.append(raw, sizeof value);
    return *this;
  }
  Packed& text(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  Packed& raw(const std::string& bytes) {
    bytes_ += bytes;
    return *this;
  }
  operator const std::string&() const { return bytes_; }

 private:
  std::string bytes_;
};

/// A message in CDR, little-endian.
class Cdr {
 public:
  template <class Number>
  Cdr& number(Number value) {
    while (bytes_.size() % sizeof value) bytes_ += '\0';
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes_.append(raw, sizeof value);
    return *this;
  }
  Cdr& doubles(const std::vector<double>& values) {
    for (const double value : values) number(value);
    return *this;
  }
  Cdr& text(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text + '\0';
    return *this;
  }
  Cdr& blob(const std::string& bytes) {
    number(static_cast<std::uint32_t>(bytes.size()));
    bytes_ += bytes;
    return *this;
  }
  Cdr& header(double time_s, const std::string& frame) {
    const auto ns = static_cast<std::int64_t>(time_s * 1e9 + 0.5);
    return number(static_cast<std::int32_t>(ns / 1000000000))
        .number(static_cast<std::uint32_t>(ns % 1000000000))
        .text(frame);
  }
  operator std::string() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  std::string bytes_;
};

/// An MCAP file, record by record.
class McapParts {
 public:
  static std::string record(unsigned char op, const std::string& content) {
    return Packed().number(op).number(std::uint64_t{content.size()}).raw(content);
  }
  static std::string channel(std::uint16_t id, const std::string& topic, const std::string& type,
                             const std::string& encoding = "cdr") {
    return record(3, Packed().number(id).text(type).text("ros2msg").text("# " + type)) +
           record(4, Packed().number(id).number(id).text(topic).text(encoding).number(0u));
  }
  static std::string message(std::uint16_t id, double received_s, const std::string& data) {
    const auto ns = static_cast<std::uint64_t>(received_s * 1e9 + 0.5);
    return record(5, Packed().number(id).number(0u).number(ns).number(ns).raw(data));
  }
  static std::string chunk(const std::string& packing, std::uint64_t unpacked,
                           const std::string& records) {
    return record(6, Packed()
                         .number(std::uint64_t{0})
                         .number(std::uint64_t{0})
                         .number(unpacked)
                         .number(0u)
                         .text(packing)
                         .number(std::uint64_t{records.size()})
                         .raw(records));
  }
  static std::string file(const std::string& records) {
    const std::string magic = "\x89MCAP0\r\n";
    return magic + record(1, Packed().text("ros2").text("test")) + records +
           record(2, std::string(20, '\0')) + magic;
  }
};

inline std::string imageMessage(double time_s, const std::string& frame, std::uint32_t width = 8,
                                std::uint32_t height = 6, const std::string& encoding = "mono8",
                                std::uint32_t pixelBytes = 1) {
  return Cdr()
      .header(time_s, frame)
      .number(height)
      .number(width)
      .text(encoding)
      .number(std::uint8_t{0})
      .number(width * pixelBytes)
      .blob(std::string(width * height * pixelBytes, '\x50'));
}

inline std::string infoMessage(double time_s, const std::string& model = "plumb_bob",
                               std::vector<double> D = {0, 0, 0, 0, 0}) {
  Cdr cdr;
  cdr.header(time_s, "camera")
      .number(6u)
      .number(8u)
      .text(model)
      .number(static_cast<std::uint32_t>(D.size()));
  cdr.doubles(D).doubles({10, 0, 3.5, 0, 11, 2.5, 0, 0, 1});
  cdr.doubles({1, 0, 0, 0, 1, 0, 0, 0, 1}).doubles({9, 0, 3, 0, 0, 8, 2, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) cdr.number(0u);
  return cdr.number(std::uint8_t{0});
}

inline std::string twistStamped(double time_s, const std::string& frame,
                                const std::vector<double>& twist) {
  return Cdr().header(time_s, frame).doubles(twist);
}

struct Transform {
  std::string parent, child;
  std::vector<double> xyz, quaternion;
};

inline std::string transforms(const std::vector<Transform>& all) {
  Cdr cdr;
  cdr.number(static_cast<std::uint32_t>(all.size()));
  for (const Transform& t : all) {
    cdr.header(0, t.parent).text(t.child).doubles(t.xyz).doubles(t.quaternion);
  }
  return cdr;
}

}  // namespace depthservo::test
