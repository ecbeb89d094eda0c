#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "cli/Tool.h"

namespace depthservo::test {

/// Everything below a folder: bytes and permissions by name. Left out: what tells the time, and
/// what whoever was killed could not remove any more. Of a database only that it is there.
using Tree = std::map<std::string, std::string>;
Tree treeOf(const std::string& folder);

/// What the undisturbed tool does below a folder.
struct OutputCalls {
  int naming = 0, writing = 0, finishing = 0, removing = 0;
  std::string failed;  ///< name of the call that failed; empty: none

  /// Those that can fail like this.
  int of(const std::string& kind) const;
};

/// What stands before the command so that the `at`-th output call below the folder fails.
/// \param kind see interposed.cpp
std::string faultAt(int at, const std::string& kind, const std::string& folder,
                    const std::string& told);
OutputCalls toldCalls(const std::string& file);

/// Which calls are tried: with DEPTHSERVO_FAULTS=all (scripts/test-long) all of them, or so many
/// where they are more, else some.
std::vector<int> callsToTry(int calls, int some, unsigned seed,
                            int most = std::numeric_limits<int>::max());
bool areAllTried();

/// A path in single quotes, for the shell.
std::string quoted(const std::string& path);

}  // namespace depthservo::test
