#include "Interruption.h"

#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <thread>

namespace depthservo {
namespace {

std::atomic<bool> isStopped{false}, isArmed{false};
std::atomic<int> lastSignal{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

void stop(int signal) {
  lastSignal = signal;
  isStopped = true;
  std::signal(signal, SIG_DFL);
}

/// Without blocking: the program may end at any time.
void listenToEnter() {
  constexpr int kSlice_ms = 50;
  while (!isStopped && !isArmed) {
    pollfd state{STDIN_FILENO, POLLIN, 0};
    if (poll(&state, 1, kSlice_ms) <= 0) continue;
    char byte = 0;
    if (read(STDIN_FILENO, &byte, 1) <= 0) return;
    if (byte == '\n') isArmed = true;
  }
}

}  // namespace

const std::atomic<bool>& stopOnInterruption() {
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  return isStopped;
}

bool wasCtrlC() { return lastSignal == SIGINT; }

const std::atomic<bool>& armOnRequest(bool listensToEnter) {
  std::signal(SIGUSR1, [](int) { isArmed = true; });
  if (listensToEnter) std::thread(listenToEnter).detach();
  return isArmed;
}

}  // namespace depthservo
