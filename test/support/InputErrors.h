#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "depthservo/text/InputError.h"

namespace depthservo::test {

/// The message of the InputError that `action` throws; "" when it throws nothing. Other exceptions
/// pass.
template <class Action>
std::string inputErrorOf(const Action& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

/// A refusal as users may see it: one line of at most 1000 bytes that has all these words.
inline testing::AssertionResult isRefusal(const std::string& message,
                                          const std::vector<std::string>& words) {
  if (message.empty()) return testing::AssertionFailure() << "was accepted";
  if (message.size() > 1000) return testing::AssertionFailure() << "too long: " << message.size();
  const auto isControl = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
  if (std::any_of(message.begin(), message.end(), isControl)) {
    return testing::AssertionFailure() << "control character in: " << message;
  }
  for (const std::string& word : words) {
    if (message.find(word) == std::string::npos) {
      return testing::AssertionFailure() << "'" << word << "' is not in: " << message;
    }
  }
  return testing::AssertionSuccess();
}

}  // namespace depthservo::test
