#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/OdometryRow.h"

namespace depthservo {

/// Twists of the camera (camera frame, m/s and rad/s) while they come.
class DEPTHSERVO_API TwistSource {
 public:
  virtual ~TwistSource() = default;

  /// The rows that have arrived since the last call, each later than the one before; waits up to
  /// `wait_s` for the first, less when a signal comes. Never throws.
  virtual std::vector<OdometryRow> read(double wait_s) = 0;

  /// Whether no more can be expected now. (There may be more later.)
  virtual bool isEnded() const = 0;

  /// Whether they are of a file, not of now.
  virtual bool isFile() const { return false; }

  /// Whether a signal cut the last wait short.
  virtual bool wasInterrupted() const { return false; }

  struct Counts {
    std::size_t rows = 0;       ///< taken
    std::size_t malformed = 0;  ///< that are not seven finite numbers in range
    std::size_t torn = 0;       ///< lines whose writer went away before their end
    std::size_t notLater = 0;   ///< rows not after the one before
    std::size_t refused() const { return malformed + torn + notLater; }
  };
  virtual const Counts& counts() const = 0;

  /// Why rows were refused since the last call, a sentence each; at most the first ten.
  virtual std::vector<std::string> takeFaults() = 0;
};

}  // namespace depthservo
