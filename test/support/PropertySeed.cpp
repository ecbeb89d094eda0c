#include <cstdlib>

namespace {

/// Property tests draw the same cases in every run, unless RC_PARAMS asks for others.
const int seeded = setenv("RC_PARAMS", "seed=1", 0);

}  // namespace
