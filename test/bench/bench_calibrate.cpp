// bench_calibrate [ROBOTS [FIRST]]: whether what is learnt of robots with everyday errors is true,
// and whether depths with the written profile are honest on another drive. Exit code 1 when a limit
// is missed.
#include <cstdio>
#include <cstdlib>

#include "support/CalibrationExperiment.h"

int main(int argc, char** argv) {
  using depthservo::test::CalibrationHonesty;
  const unsigned robots = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 60;
  const unsigned first = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 0;
  int shown = 0, within = 0;
  double coverage = 0, worst = 1, valid = 0;
  for (unsigned seed = first; seed < first + robots; ++seed) {
    const CalibrationHonesty robot(seed, 101 + seed);  // the other course, other points
    shown += robot.shown;
    within += robot.within;
    coverage += robot.otherDrive.coverage / robots;
    valid += robot.otherDrive.valid / robots;
    worst = std::min(worst, robot.otherDrive.coverage);
  }
  const bool isMet = shown >= 6 * static_cast<int>(robots) && within >= .97 * shown &&
                     coverage >= .9 && coverage <= .99;
  std::printf(
      "%u robots: %d of %d constants within three sigma; coverage on another drive %.3f, worst "
      "robot %.3f, %.0f %% valid  %s\n",
      robots, within, shown, coverage, worst, 100 * valid, isMet ? "met" : "MISSED");
  return isMet ? 0 : 1;
}
