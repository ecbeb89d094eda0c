#include "depthservo/text/InterruptWatch.h"

#include <atomic>
#include <csignal>
#include <cstddef>
#include <iterator>
#include <mutex>

namespace depthservo {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};

std::atomic<int> noted{0};
static_assert(std::atomic<int>::is_always_lock_free);

std::mutex watchMutex;  // of what follows
int watches = 0;
struct sigaction before[std::size(kSignals)];

void note(int signal) {
  noted = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

InterruptWatch::InterruptWatch() {
  const std::lock_guard lock(watchMutex);
  if (watches++ > 0) return;
  noted = 0;
  struct sigaction action = {};
  action.sa_handler = note;
  action.sa_flags = SA_RESTART;
  for (std::size_t i = 0; i < std::size(kSignals); ++i) {
    sigaction(kSignals[i], nullptr, &before[i]);
    if (before[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
  }
}

InterruptWatch::~InterruptWatch() {
  const std::lock_guard lock(watchMutex);
  if (--watches > 0) return;
  for (std::size_t i = 0; i < std::size(kSignals); ++i) {
    sigaction(kSignals[i], &before[i], nullptr);
  }
}

void InterruptWatch::stopIfInterrupted() const {
  if (const int signal = noted) throw Interrupted{signal};
}

}  // namespace depthservo
