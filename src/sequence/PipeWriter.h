#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "depthservo/api.h"

namespace depthservo::detail {

/// Makes a named pipe where there is nothing of this name, and removes it at the end.
class DEPTHSERVO_INNER MadePipe {
 public:
  /// \throw InputError it cannot be made
  explicit MadePipe(const std::string& path);
  ~MadePipe();
  MadePipe(const MadePipe&) = delete;
  MadePipe& operator=(const MadePipe&) = delete;

 private:
  std::string path_;  // empty: it was there
};

/// Writes to a pipe whose reader may come later, be slow, or go away. SIGPIPE must be ignored.
class DEPTHSERVO_INNER PipeWriter {
 public:
  /// \param path a named pipe, made when there is nothing of this name and removed at the end; a
  /// file, which is emptied; "-" for standard output; or udp:ADDRESS:PORT \throw InputError
  explicit PipeWriter(const std::string& path);
  ~PipeWriter();
  PipeWriter(const PipeWriter&) = delete;
  PipeWriter& operator=(const PipeWriter&) = delete;

  /// Opens the pipe if it has a reader by now. True: it is open. Never throws.
  bool open() noexcept;

  enum class Written {
    whole,    ///< or on its way: what did not fit is written by the next calls
    dropped,  ///< the reader is late: none of it is written
    nowhere,  ///< there is no reader
  };
  /// All of it or nothing, without waiting; the reader gets no part of another piece in between.
  Written write(std::string_view piece) noexcept;

  /// Writes the rest of what did not fit; waits for the reader up to `wait_s`. True: none is left.
  bool flush(double wait_s = 0) noexcept;

  /// Bytes that the reader has not taken, as far as the system tells.
  std::size_t unread() const noexcept;

 private:
  void close() noexcept;

  std::string path_;
  std::optional<MadePipe> made_;
  int file_ = -1;
  bool isPipe_ = false;
  std::vector<char> rest_;
  std::size_t begin_ = 0;  // of what is left in rest_
};

}  // namespace depthservo::detail
