#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "depthservo/text/InterruptWatch.h"
#include "depthservo/text/NewFolder.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

/// What a child process came to that writes a folder and gets a signal while it does.
int exitOfChild(const fs::path& folder, int signal) {
  const pid_t child = fork();
  if (child == 0) {
    int code = 0;
    try {
      makeFolder(folder, [&](const fs::path& place) {
        std::ofstream(place / "half") << "written";
        kill(getpid(), signal);
      });
    } catch (const Interrupted& interrupted) {
      code = 100 + interrupted.signal;
    }
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(NewFolder, leaves_nothing_when_it_is_interrupted) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder place;
    EXPECT_EQ(exitOfChild(place / "run", signal), 100 + signal);
    EXPECT_TRUE(place.isEmpty());
  }
}

TEST(NewFolder, goes_on_where_the_signal_is_ignored) {
  const TemporaryFolder place;
  struct sigaction before;
  struct sigaction ignore = {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGINT, &ignore, &before);
  EXPECT_EQ(exitOfChild(place / "run", SIGINT), 0);
  sigaction(SIGINT, &before, nullptr);
  EXPECT_TRUE(fs::exists(place / "run/half"));
}

TEST(InterruptWatch, gives_the_signals_back) {
  struct sigaction before, after;
  sigaction(SIGTERM, nullptr, &before);
  {
    const InterruptWatch outer;
    const InterruptWatch inner;
    EXPECT_NO_THROW(outer.stopIfInterrupted());
    raise(SIGTERM);
    EXPECT_THROW(inner.stopIfInterrupted(), Interrupted);
    EXPECT_THROW(outer.stopIfInterrupted(), Interrupted);
  }
  sigaction(SIGTERM, nullptr, &after);
  EXPECT_EQ(before.sa_handler, after.sa_handler);
  EXPECT_NO_THROW(InterruptWatch().stopIfInterrupted()) << "an old signal is no news";
}

}  // namespace
}  // namespace depthservo
