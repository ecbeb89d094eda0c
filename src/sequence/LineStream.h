#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace depthservo::detail {

/// Lines of text from a pipe, while they come. Nobody can make it wait longer than it is told to: a
/// pipe without a writer, one that is silent, or one that never ends.
class LineStream {
 public:
  /// \param path a named pipe, a file, "-" for standard input, or udp:HOST:PORT to listen at
  /// \param what stands in it, for messages: "twists" \throw InputError
  LineStream(const std::string& path, const char* what);
  ~LineStream();
  LineStream(const LineStream&) = delete;
  LineStream& operator=(const LineStream&) = delete;

  /// A whole line without blanks around it, or why one cannot be used.
  struct Listener {
    std::function<void(std::string_view line)> onLine;
    std::function<void(std::size_t longest)> onOverlong;
    std::function<void(std::string_view line)> onTorn;  ///< its writer went away before its end
  };
  /// Hands over what has arrived since the last call; waits up to `wait_s` for the first bytes of
  /// it, less when a signal comes. At most a megabyte at a time. Never throws by itself.
  void read(double wait_s, const Listener& listener);

  /// Whether no more can be expected now: the end of a file, or a pipe that nobody writes to any
  /// more. (A pipe may get a new writer.)
  bool isEnded() const { return isEnded_; }

  /// Whether it is a file on disk.
  bool isFile() const { return isRegular_; }

  /// Whether a signal cut the last wait short.
  bool wasInterrupted() const { return wasInterrupted_; }

 private:
  void take(const char* bytes, std::size_t count, const Listener& listener);
  void endOfWriter(const Listener& listener);

  int file_ = -1;
  bool isRegular_ = false, isSocket_ = false, isEnded_ = false, wasInterrupted_ = false;
  bool isOverlong_ = false;  // the rest of the line is to be thrown away
  std::string line_;         // begun, not ended
};

/// Without blanks at its ends.
std::string_view trimmed(std::string_view text);

/// A socket for "udp:HOST:PORT"; < 0: the path is another. \throw InputError
int udpSocket(const std::string& path, bool isListener);

}  // namespace depthservo::detail
