// bench_diagnosis [ROBOTS]: what the diagnosis names on robots of which one thing errs. Exit code 1
// when a row misses its limit.
#include <cstdio>
#include <cstdlib>
#include <map>

#include "support/OneSource.h"

namespace {

using namespace depthservo;
using namespace depthservo::test;
using Cause = ConsistencyMonitor::Cause;

/// \return whether it is within the limits
bool row(const ErrorSource& source, double size, int robots) {
  int named = 0, right = 0;
  std::map<std::string, int> causes;
  for (int seed = 0; seed < robots; ++seed) {
    const auto d = diagnosed(source, size, static_cast<unsigned>(seed));
    if (d.cause == Cause::none || (d.cause == Cause::noise && d.size < 1)) continue;
    ++named;
    right += d.cause == source.cause || (d.rival == source.cause && d.rival != Cause::none);
    ++causes[ConsistencyMonitor::toString(d.cause)];
  }
  const bool mustBeNamed =
      size == 4 && (source.cause == Cause::latency || source.cause == Cause::gyroBias ||
                    source.cause == Cause::mount);
  const bool isMet = right >= .9 * named && (size > 1 || named <= .05 * robots) &&
                     (!mustBeNamed || named >= .8 * robots);
  std::printf("%-13s %gx  %3d of %d named, %3d right  %s ", source.name, size, named, robots, right,
              isMet ? "met   " : "MISSED");
  for (const auto& [cause, count] : causes) std::printf(" %s %d", cause.c_str(), count);
  std::printf("\n");
  return isMet;
}

}  // namespace

int main(int argc, char** argv) {
  const int robots = argc > 1 ? std::atoi(argv[1]) : 40;
  bool isMet = true;
  for (const ErrorSource& source : errorSources()) {
    for (const double size : {1., 2., 4.}) isMet &= row(source, size, robots);
  }
  return isMet ? 0 : 1;
}
