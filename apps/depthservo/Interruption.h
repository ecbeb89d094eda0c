#pragma once

#include <atomic>

namespace depthservo {

/// From now on Ctrl-C and a plain kill set the flag, so that the run ends as the end of the images
/// does; the second one ends the program at once.
const std::atomic<bool>& stopOnInterruption();

/// Whether it was Ctrl-C, not a plain kill.
bool wasCtrlC();

/// From now on SIGUSR1, or Enter where standard input is not read otherwise, sets the flag.
/// \param listensToEnter whether standard input is free for it
const std::atomic<bool>& armOnRequest(bool listensToEnter);

}  // namespace depthservo
