// Success of the four-point task from random starts, by the depths that the task is given: true,
// constant at the goal's depth, constant at a wrong guess of the start's, observed from the same
// guess. A Markdown table on stdout.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "support/RandomStarts.h"

namespace {

using namespace depthservo::test;

struct Case {
  const char* name;
  UsedDepth depth;
};

constexpr Case kExact[] = {{"true depths", UsedDepth::truth},
                           {"constant, depth at the goal (0.5 m)", UsedDepth::goal}};
constexpr Case kGuessed[] = {{"constant", UsedDepth::constant},
                             {"observed (`FeaturePoint`)", UsedDepth::blended}};
constexpr double kGuesses[] = {.25, .5, 1, 2, 4};
constexpr std::size_t kLate[] = {0, 9};  // images

void row(const char* name, const char* guess, unsigned starts, UsedDepth depth, double factor) {
  std::printf("| %s | %s |", name, guess);
  for (const std::size_t late : kLate) {
    const StartsOutcome outcome = manyStarts(starts, depth, factor, late);
    std::printf(" %.0f %%, %.0f %%, ", 100 * outcome.success, 100 * outcome.inView);
    std::isfinite(outcome.median_s) ? std::printf("%.1f s |", outcome.median_s)
                                    : std::printf("- |");
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const bool isGiven = argc == 3 && std::strcmp(argv[1], "--starts") == 0;
  const int starts = isGiven ? std::atoi(argv[2]) : 200;
  if ((argc > 1 && !isGiven) || starts < 1) {
    std::fprintf(stderr, "usage: bench_starts [--starts N]    (N > 0, default 200)\n");
    return 2;
  }
  const auto n = static_cast<unsigned>(starts);
  std::printf("| depth | first guess |");
  for (const std::size_t late : kLate) {
    std::printf(" robot %.1f s late: success, in view, median |",
                static_cast<double>(late) * kPeriod_s);
  }
  std::printf("\n|---|---|---|---|\n");
  for (const Case& c : kExact) row(c.name, "", n, c.depth, 1);
  for (const Case& c : kGuessed) {
    for (const double guess : kGuesses) {
      char text[16];
      std::snprintf(text, sizeof text, "%gx", guess);
      row(c.name, text, n, c.depth, guess);
    }
  }
  return 0;
}
