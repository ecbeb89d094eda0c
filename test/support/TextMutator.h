#pragma once

#include <string>
#include <vector>

#include "support/Random.h"

namespace depthservo::test {

/// A copy of the text with a few random faults: bytes changed, parts removed, repeated or swapped
/// in from a list of nasty pieces.
inline std::string mutated(std::string text, Random& random) {
  static const std::vector<std::string> pieces = {"nan",
                                                  "inf",
                                                  "-1",
                                                  "1e999",
                                                  "1e-999",
                                                  "0",
                                                  ",",
                                                  ",,",
                                                  "\n",
                                                  "\r\n",
                                                  "\t",
                                                  " ",
                                                  "#",
                                                  ":",
                                                  ": ",
                                                  "- ",
                                                  "[",
                                                  "]",
                                                  "{",
                                                  "}",
                                                  "\"",
                                                  "'",
                                                  "&a ",
                                                  "*a",
                                                  "<<: ",
                                                  "!!str ",
                                                  "---\n",
                                                  "...",
                                                  "?",
                                                  "|",
                                                  ">",
                                                  "%",
                                                  "@",
                                                  "`",
                                                  std::string(1, '\0'),
                                                  "\xff",
                                                  "\xef\xbb\xbf",
                                                  "\xc3\xa9",
                                                  "~",
                                                  "null",
                                                  "true",
                                                  "999999999999999999999",
                                                  "0x10",
                                                  "+5",
                                                  "[[[[[[[[[[[[[[[[",
                                                  "{a: {a: {a: {a: "};
  const auto position = [&] { return random.integer(0, static_cast<int>(text.size())); };
  for (int i = random.integer(1, 3); i > 0; --i) {
    const auto at = static_cast<std::size_t>(position());
    const auto length = static_cast<std::size_t>(random.integer(1, 12));
    switch (random.integer(0, 4)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(random.integer(0, 255));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(at, text.substr(static_cast<std::size_t>(position()), 4 * length));
        break;
      case 3:
        text.resize(at);
        break;
      default:
        text.insert(at, pieces[static_cast<std::size_t>(
                            random.integer(0, static_cast<int>(pieces.size()) - 1))]);
    }
  }
  return text;
}

}  // namespace depthservo::test
