#include "depthservo/text/InputError.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "depthservo/text/didYouMean.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

constexpr std::size_t kLongestMessage = 1000;  // bytes
constexpr std::size_t kLongestFile = 400;
constexpr std::size_t kLongestKey = 100;

/// One line of at most `longest` bytes of valid UTF-8.
std::string printable(const std::string& text, std::size_t longest) {
  std::string line;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = detail::utf8Length(std::string_view(text).substr(i));
    if (line.size() + std::max<std::size_t>(length, 1) + 3 > longest && i + 3 < text.size()) {
      return line + "...";
    }
    const auto first = static_cast<unsigned char>(text[i]);
    if (length == 0) {
      line += '?';
    } else if (first < 0x20 || first == 0x7F) {
      line += ' ';
    } else {
      line.append(text, i, length);
    }
    i += std::max<std::size_t>(length, 1);
  }
  return line;
}

/// The end of a path says more than its beginning.
std::string printableFile(const std::string& file) {
  if (file.size() <= kLongestFile) return printable(file, kLongestFile);
  return "..." + printable(file.substr(file.size() - kLongestFile + 3), kLongestFile);
}

std::string oneLine(const InputError::Place& place, const std::string& message) {
  std::string text = printableFile(place.file);
  if (place.line > 0) text += ":" + std::to_string(place.line);
  text += ": ";
  if (!place.key.empty()) text += printable(place.key, kLongestKey) + ": ";
  return printable(text + message, kLongestMessage);
}

/// Levenshtein distance, letters compared without case.
std::size_t edits(const std::string& a, const std::string& b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

InputError::InputError(Place place, const std::string& message)
    : std::runtime_error(oneLine(place, message)), place_(std::move(place)), message_(message) {}

std::string nearestWord(const std::string& word, const std::vector<std::string>& valid) {
  const std::string shortened = word.substr(0, 200);
  return *std::min_element(valid.begin(), valid.end(),
                           [&](const std::string& a, const std::string& b) {
                             return edits(shortened, a) < edits(shortened, b);
                           });
}

std::string didYouMean(const std::string& word, const std::vector<std::string>& valid) {
  if (valid.empty()) return "";
  const std::string nearest = nearestWord(word, valid);
  const std::size_t most = std::max<std::size_t>(2, nearest.size() / 3);
  return edits(word.substr(0, 200), nearest) <= most ? "; did you mean '" + nearest + "'?" : "";
}

std::string didYouMeanFile(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  std::vector<std::string> neighbours;
  for (fs::directory_iterator it(folder.empty() ? "." : folder, error), end; !error && it != end;
       it.increment(error)) {
    neighbours.push_back((folder / it->path().filename()).string());
  }
  std::sort(neighbours.begin(), neighbours.end());
  return didYouMean(path, neighbours);
}

}  // namespace depthservo
