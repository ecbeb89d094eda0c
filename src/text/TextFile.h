#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "depthservo/api.h"
#include "depthservo/text/InputError.h"

namespace depthservo::detail {

/// Numbers that are allowed. NaN and infinity never are.
struct DEPTHSERVO_INNER Range {
  double low, high;
  bool lowIsOpen = false;  ///< low itself is not allowed

  static constexpr Range above(double low, double high) { return {low, high, true}; }
  bool contains(double value) const {
    return (lowIsOpen ? value > low : value >= low) && value <= high;
  }
  std::string text(const char* unit) const;  ///< "[0, 1] m"
};

struct TextLimits {
  std::size_t bytes;      ///< of the whole file
  std::size_t lineBytes;  ///< of its longest line
};

/// The bytes of any file. Throws InputError: missing, a folder, unreadable, larger than `largest`
/// bytes.
DEPTHSERVO_INNER std::string readFile(const std::string& path, std::size_t largest);

/// A text file without byte order mark. Throws InputError as readFile and checkText do.
std::string readTextFile(const std::string& path, const TextLimits& limits);

/// Throws InputError unless `text` is UTF-8 without control characters and without endless lines.
DEPTHSERVO_INNER void checkText(std::string_view text, const std::string& file,
                                const TextLimits& limits);

/// The finite decimal number that is the whole of `text`, whatever the locale; nothing for anything
/// else, "nan" and "inf" among it.
DEPTHSERVO_INNER std::optional<double> toNumber(std::string_view text);
DEPTHSERVO_INNER std::optional<long long> toInteger(std::string_view text);

/// Bytes of the UTF-8 character at the start of `text` (not empty); 0 when there is none.
DEPTHSERVO_INNER std::size_t utf8Length(std::string_view text);

/// 'text', shortened when it is long.
DEPTHSERVO_INNER std::string quoted(std::string_view text);

/// Times [s]; seconds since 1970 are 1.8e9.
constexpr Range kTimes{-1e11, 1e11};

/// "; is it milliseconds?" for a time above kTimes, by its size as one since 1970; else empty.
std::string unitHint(double time);

/// "expected a number in [0, 1] m, got 'x'"
DEPTHSERVO_INNER std::string expectedNumber(const Range& range, const char* unit,
                                            std::string_view got);

}  // namespace depthservo::detail
