#include "text/TextFile.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "depthservo/text/didYouMean.h"

namespace depthservo::detail {
namespace {

template <class Number>
std::optional<Number> parsed(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::size_t utf8Length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  std::size_t length = 0;
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) length = 2;
  if (first >= 0xE0 && first < 0xF0) length = 3;
  if (first >= 0xF0 && first < 0xF5) length = 4;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if (byte(i) >> 6 != 2) return 0;
  }
  // Overlong forms, surrogates and numbers above U+10FFFF.
  if (first == 0xE0 && byte(1) < 0xA0) return 0;
  if (first == 0xED && byte(1) > 0x9F) return 0;
  if (first == 0xF0 && byte(1) < 0x90) return 0;
  if (first == 0xF4 && byte(1) > 0x8F) return 0;
  return length;
}

std::string Range::text(const char* unit) const {
  return fmt::format("{}{}, {}]{}{}", lowIsOpen ? '(' : '[', low, high, *unit ? " " : "", unit);
}

std::string readFile(const std::string& path, std::size_t largest) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw InputError({path, 0, ""}, "there is no such file" + didYouMeanFile(path));
  }
  if (std::filesystem::is_directory(status)) {
    throw InputError({path, 0, ""}, "is a folder, expected a file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError({path, 0, ""}, "is not a regular file or cannot be read");
  }
  const auto size = std::filesystem::file_size(path, error);
  if (error) throw InputError({path, 0, ""}, "cannot be read: " + error.message());
  if (size > largest) {
    throw InputError({path, 0, ""},
                     fmt::format("has {} bytes, at most {} are read", size, largest));
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError({path, 0, ""}, fmt::format("cannot be read: {}", std::strerror(errno)));
  std::string bytes(size, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(size));
  if (in.bad() || static_cast<std::size_t>(in.gcount()) != size) {
    throw InputError({path, 0, ""}, "cannot be read to its end");
  }
  return bytes;
}

std::string readTextFile(const std::string& path, const TextLimits& limits) {
  std::string text = readFile(path, limits.bytes);
  if (text.compare(0, 3, "\xEF\xBB\xBF") == 0) text.erase(0, 3);
  checkText(text, path, limits);
  return text;
}

void checkText(std::string_view text, const std::string& file, const TextLimits& limits) {
  int line = 1;
  std::size_t lineStart = 0;
  for (std::size_t i = 0; i < text.size();) {
    const auto c = static_cast<unsigned char>(text[i]);
    const std::size_t length = utf8Length(text.substr(i));
    if (length == 0 || (c < 0x20 && c != '\n' && c != '\r' && c != '\t') || c == 0x7F) {
      throw InputError({file, line, ""},
                       fmt::format("is not a text file (byte 0x{:02x}), expected UTF-8 text", c));
    }
    i += length;
    if (c == '\n') {
      ++line;
      lineStart = i;
    } else if (i - lineStart > limits.lineBytes) {
      throw InputError({file, line, ""},
                       fmt::format("line is longer than {} characters", limits.lineBytes));
    }
  }
}

std::optional<double> toNumber(std::string_view text) {
  const auto value = parsed<double>(text);
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return value;
}

std::optional<long long> toInteger(std::string_view text) { return parsed<long long>(text); }

std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  if (text.size() <= kLongest) return fmt::format("'{}'", text);
  return fmt::format("'{}...'", text.substr(0, kLongest));
}

std::string unitHint(double time) {
  constexpr double kMostMilliseconds = 1e14, kMostMicroseconds = 1e17;
  if (!(time > kTimes.high)) return "";
  return fmt::format("; is it {}?", time < kMostMilliseconds   ? "milliseconds"
                                    : time < kMostMicroseconds ? "microseconds"
                                                               : "nanoseconds");
}

std::string expectedNumber(const Range& range, const char* unit, std::string_view got) {
  return fmt::format("expected a finite number in {}, got {}", range.text(unit), quoted(got));
}

}  // namespace depthservo::detail
