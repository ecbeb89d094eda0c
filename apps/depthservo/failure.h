#pragma once

#include <exception>

namespace depthservo {

/// Tells on stderr, in one line, what went wrong. \return the exit code for it: kBadInput for what
/// the user can mend, kInternalError for the rest
int tellFailure(std::exception_ptr failure);

}  // namespace depthservo
