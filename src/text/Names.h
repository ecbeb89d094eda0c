#pragma once

#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"

namespace depthservo::detail {

/// A value of an enumeration and the word that users write for it.
template <class Enum>
struct Choice {
  Enum value;
  const char* word;
};

/// "expected a, b or c, got 'x'; the nearest is 'b'". \param valid not empty
DEPTHSERVO_INNER std::string unknownWord(const std::string& word,
                                         const std::vector<std::string>& valid);

template <class Enum>
const char* wordOf(const std::vector<Choice<Enum>>& choices, Enum value) {
  for (const auto& choice : choices) {
    if (choice.value == value) return choice.word;
  }
  return "";
}

template <class Enum>
std::optional<Enum> valueOf(const std::vector<Choice<Enum>>& choices, const std::string& word) {
  for (const auto& choice : choices) {
    if (choice.word == word) return choice.value;
  }
  return std::nullopt;
}

template <class Enum>
std::vector<std::string> wordsOf(const std::vector<Choice<Enum>>& choices) {
  std::vector<std::string> words;
  for (const auto& choice : choices) words.emplace_back(choice.word);
  return words;
}

}  // namespace depthservo::detail
