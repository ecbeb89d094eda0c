#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

const std::string kPage = data("../doc/troubleshooting.md");

/// A command of the page and the lines that it shows of what the command prints.
struct Example {
  std::size_t line;  ///< of the page
  std::string command;
  std::vector<std::string> shown;
};

/// In the order of the page: later ones use the files of earlier ones.
std::vector<Example> examples() {
  std::ifstream page(kPage);
  std::vector<Example> all;
  std::string line;
  bool isInBlock = false;
  for (std::size_t number = 1; std::getline(page, line); ++number) {
    if (line.rfind("```", 0) == 0) {
      isInBlock = !isInBlock;
    } else if (isInBlock && line.rfind("$ ", 0) == 0) {
      all.push_back({number, line.substr(2), {}});
    } else if (isInBlock && !all.empty()) {
      all.back().shown.push_back(line);
    }
  }
  return all;
}

const std::string kNumber = R"(([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?))";

/// The words of a shown line as they stand, any number where it has one, anything for "...".
std::regex patternOf(const std::string& shown) {
  static const std::regex tokens(R"(\.\.\.|[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?|[^\w\s])");
  std::string pattern;
  std::size_t from = 0;
  for (std::sregex_iterator it(shown.begin(), shown.end(), tokens), end; it != end; ++it) {
    const std::string token = it->str();
    pattern += shown.substr(from, static_cast<std::size_t>(it->position()) - from);
    pattern += token == "..." ? ".*" : std::isdigit(token.back()) ? kNumber : "\\" + token;
    from = static_cast<std::size_t>(it->position() + it->length());
  }
  return std::regex(pattern + shown.substr(from));
}

std::vector<double> numbersOf(const std::smatch& match) {
  std::vector<double> numbers;
  for (std::size_t i = 1; i < match.size(); ++i) numbers.push_back(std::stod(match.str(i)));
  return numbers;
}

/// Whether a printed line has the words of the shown one, and its numbers but for what another
/// compiler rounds otherwise.
bool isShownAs(const std::string& printed, const std::string& shown) {
  constexpr double kShare = 0.05;
  const std::regex pattern = patternOf(shown);
  std::smatch is, shouldBe;
  if (!std::regex_search(printed, is, pattern)) return false;
  if (!std::regex_search(shown, shouldBe, pattern)) return false;
  const std::vector<double> a = numbersOf(is), b = numbersOf(shouldBe);
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::abs(a[i] - b[i]) > kShare * std::abs(b[i])) return false;
  }
  return true;
}

bool isPrinted(const std::string& output, const std::string& shown) {
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    if (isShownAs(line, shown)) return true;
  }
  return false;
}

TEST(ShownLine, is_told_from_others_by_words_and_by_numbers) {
  const std::string printed = "x: latency of 31 ms (evidence 9 sigma); correct it";
  EXPECT_TRUE(isShownAs(printed, printed));
  EXPECT_TRUE(isShownAs(printed, "latency of 32 ms ...; correct it"));
  EXPECT_FALSE(isShownAs(printed, "latency of 41 ms ...; correct it"));
  EXPECT_FALSE(isShownAs(printed, "latency of 31 ms ...; mend it"));
  EXPECT_FALSE(isShownAs(printed, "latency of 31 ms (evidence 9 sigma)."));
}

TEST(TroubleshootingPage, commands_print_the_lines_that_it_shows) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "bin");
  fs::create_symlink(DEPTHSERVO_TOOL, folder / "bin/depthservo");
  const std::string inFolder = "cd '" + folder.path().string() + "' && PATH=\"$PWD/bin:$PATH\" && ";
  std::size_t shown = 0;
  for (const Example& example : examples()) {
    SCOPED_TRACE(kPage + ":" + std::to_string(example.line) + ": " + example.command);
    const std::string redirected = example.command.find(" > ") == std::string::npos
                                       ? "(" + example.command + ") > printed 2>&1"
                                       : example.command + " 2> printed";
    const int status = std::system((inFolder + redirected + " < /dev/null").c_str());
    ASSERT_TRUE(WIFEXITED(status));
    const std::string output = folder.read("printed");
    EXPECT_LE(WEXITSTATUS(status), 3) << output;
    for (const std::string& line : example.shown) {
      EXPECT_TRUE(isPrinted(output, line)) << "not printed: " << line << "\nbut:\n" << output;
    }
    shown += example.shown.size();
  }
  EXPECT_GE(shown, 30u);
}

/// What GitHub makes of a heading.
std::string anchorOf(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    if (std::isalnum(static_cast<unsigned char>(c))) anchor += static_cast<char>(std::tolower(c));
    if (c == ' ' || c == '-') anchor += '-';
  }
  return anchor;
}

TEST(TroubleshootingPage, has_a_section_of_every_symptom_with_a_command) {
  std::ifstream page(kPage);
  std::set<std::string> symptoms, sections;
  const std::regex link(R"(^\| \[.*\]\(#([a-z-]+)\) \|)");
  std::string section;
  for (std::string line; std::getline(page, line);) {
    std::smatch match;
    if (std::regex_search(line, match, link)) symptoms.insert(match[1]);
    if (line.rfind("## ", 0) == 0) section = anchorOf(line.substr(3));
    if (line.rfind("$ depthservo", 0) == 0 && !section.empty()) sections.insert(section);
  }
  EXPECT_EQ(symptoms, sections);
  EXPECT_GE(symptoms.size(), 13u);
}

}  // namespace
}  // namespace depthservo::test
