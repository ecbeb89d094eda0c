#pragma once

#include "depthservo/api.h"

namespace depthservo {

/// Somebody asked the program to end (Ctrl-C, a plain kill) while files were written.
struct DEPTHSERVO_API Interrupted {
  int signal;
};

/// While there is one, SIGINT and SIGTERM are noted instead of ending the program, so that whoever
/// writes can remove what is not whole; the second signal ends it at once. Signals that are ignored
/// stay so. Watches may be nested, and in several threads; all of them are told.
class DEPTHSERVO_API InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  /// Call it between files, or parts of them. \throw Interrupted a signal was noted
  void stopIfInterrupted() const;
};

}  // namespace depthservo
