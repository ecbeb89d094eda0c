#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "depthservo/motion/OdometryRow.h"

namespace depthservo {

namespace detail {
class LineStream;
}

/// Twists of the camera from a pipe, while they come: lines `timestamp,vx,vy,vz,wx,wy,wz` (camera
/// frame, m/s and rad/s), a header of these names and comments after '#' allowed.
///
/// Nobody can make it wait longer than it is told to: a pipe without a writer, one that is silent,
/// or one that never ends. A line that is not seven finite numbers, one that its writer left
/// without an end, and one that is not later than the row before are counted and left out.
class TwistStream {
 public:
  /// \param path a named pipe, a file, "-" for standard input, or udp:ADDRESS:PORT to listen at
  /// \throw InputError
  explicit TwistStream(const std::string& path);
  ~TwistStream();
  TwistStream(const TwistStream&) = delete;
  TwistStream& operator=(const TwistStream&) = delete;

  /// The rows that have arrived since the last call; waits up to `wait_s` for the first bytes of
  /// them, less when a signal comes. At most a megabyte at a time. Never throws.
  std::vector<OdometryRow> read(double wait_s);

  /// Whether no more can be expected now: the end of a file, or a pipe that nobody writes to any
  /// more. (A pipe may get a new writer.)
  bool isEnded() const;

  /// Whether it is a file on disk, no pipe and no socket.
  bool isFile() const;

  /// Whether a signal cut the last wait short.
  bool wasInterrupted() const;

  struct Counts {
    std::size_t rows = 0;       ///< taken
    std::size_t malformed = 0;  ///< lines that are not seven finite numbers in range
    std::size_t torn = 0;       ///< lines whose writer went away before their end
    std::size_t notLater = 0;   ///< rows not after the one before
    std::size_t refused() const { return malformed + torn + notLater; }
  };
  const Counts& counts() const { return counts_; }

  /// Why lines were refused since the last call, a sentence each; at most the first ten.
  std::vector<std::string> takeFaults() { return std::exchange(faults_, {}); }

 private:
  void takeLine(std::string_view line, std::vector<OdometryRow>& rows);
  void note(std::string fault);

  std::unique_ptr<detail::LineStream> lines_;
  double last_s_;
  Counts counts_;
  std::vector<std::string> faults_;
};

}  // namespace depthservo
