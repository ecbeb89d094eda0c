#include "faults/Faults.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>

namespace depthservo::test {

namespace fs = std::filesystem;

Tree treeOf(const std::string& folder) {
  Tree tree;
  for (fs::recursive_directory_iterator it(folder), end; it != end; ++it) {
    const std::string name = it->path().filename();
    const bool isRest = name[0] == '.' || it->path().extension() == ".part" ||
                        name.find("-journal") != std::string::npos;
    if (isRest) it.disable_recursion_pending();
    if (isRest || name == "timing.json") continue;
    std::ostringstream contents;
    contents << std::oct << static_cast<int>(it->status().permissions()) << ' ';
    const bool isCompared = it->is_regular_file() && it->path().extension() != ".sqlite";
    if (isCompared) contents << std::ifstream(it->path(), std::ios::binary).rdbuf();
    tree[it->path().lexically_relative(folder)] = contents.str();
  }
  return tree;
}

int OutputCalls::of(const std::string& kind) const {
  if (kind == "interrupted" || kind == "short" || kind == "file-limit") return writing;
  if (kind == "read-only") return naming;
  return naming + writing + finishing + (kind == "kill" ? removing : 0);
}

std::string faultAt(int at, const std::string& kind, const std::string& folder,
                    const std::string& told) {
  return "FAULTS_UNDER=" + quoted(folder) + " FAULTS_KIND=" + kind +
         " FAULTS_AT=" + std::to_string(at) + " FAULTS_TOLD=" + quoted(told) +
         " LD_PRELOAD=" DEPTHSERVO_INTERPOSED;
}

OutputCalls toldCalls(const std::string& file) {
  OutputCalls calls;
  std::ifstream(file) >> calls.naming >> calls.writing >> calls.finishing >> calls.removing >>
      calls.failed;
  return calls;
}

bool areAllTried() {
  const char* which = std::getenv("DEPTHSERVO_FAULTS");
  return which && std::string(which) == "all";
}

std::vector<int> callsToTry(int calls, int some, unsigned seed, int most) {
  std::vector<int> all(static_cast<std::size_t>(std::max(calls, 0)));
  std::iota(all.begin(), all.end(), 1);
  if (areAllTried()) some = most;
  if (some >= calls) return all;
  std::mt19937 random(seed);
  std::shuffle(all.begin(), all.end(), random);
  all.resize(static_cast<std::size_t>(some));
  return all;
}

std::string quoted(const std::string& path) {
  std::string text = "'";
  for (const char c : path) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace depthservo::test
