// Every seed, every input that once was too much for a reader, and some of its neighbours.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "Target.h"
#include "support/TextMutator.h"

namespace depthservo::fuzz {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> inputsOf(const std::string& kind, const std::string& target) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(fs::path(DEPTHSERVO_FUZZ) / kind / target, none)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> inputs;
  for (const fs::path& file : files) {
    std::ostringstream bytes;
    bytes << std::ifstream(file, std::ios::binary).rdbuf();
    inputs.push_back(bytes.str());
  }
  return inputs;
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const auto& target : targets()) all.push_back(target.first);
  return all;
}

class Seeds : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Seeds, testing::ValuesIn(names()),
                         [](const auto& target) { return target.param; });

TEST_P(Seeds, and_what_is_like_them_are_read_or_refused) {
  const Read read = targets().at(GetParam());
  std::vector<std::string> inputs = inputsOf("seeds", GetParam());
  ASSERT_FALSE(inputs.empty()) << "no seeds";
  for (const std::string& seed : inputs) EXPECT_NO_THROW(read(seed)) << "a seed is refused: " << seed;
  for (std::string& crash : inputsOf("crashes", GetParam())) {
    feed(read, crash);
    inputs.push_back(std::move(crash));
  }
  constexpr std::size_t kFewest = 300;
  const char* const given = std::getenv("FUZZ_SECONDS");
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(given ? std::atof(given) : 5);
  test::Random random(1);
  std::size_t fed = 0;
  for (; fed < kFewest || Clock::now() < end; ++fed) {
    feed(read, test::mutated(inputs[fed % inputs.size()], random));
  }
  RecordProperty("inputs", std::to_string(fed));
}

}  // namespace
}  // namespace depthservo::fuzz
