#include "sequence/PipeWriter.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>

#include "depthservo/text/InputError.h"
#include "sequence/LineStream.h"

namespace depthservo::detail {
namespace {

constexpr int kLargePipe = 1 << 20;  // bytes: three images of 640 x 480; more takes a privilege

/// As much as there is room for; a signal is no reason to leave it.
ssize_t writeSome(int file, std::string_view bytes) {
  ssize_t count = -1;
  do {
    count = ::write(file, bytes.data(), bytes.size());
  } while (count < 0 && errno == EINTR);
  return count;
}

}  // namespace

MadePipe::MadePipe(const std::string& path) {
  struct stat status {};
  if (path == "-" || path.compare(0, 4, "udp:") == 0 || stat(path.c_str(), &status) == 0) return;
  if (mkfifo(path.c_str(), 0600) != 0) {
    throw InputError({path, 0, ""},
                     fmt::format("no pipe can be made there: {}", std::strerror(errno)));
  }
  path_ = path;
}

MadePipe::~MadePipe() {
  if (!path_.empty()) unlink(path_.c_str());
}

PipeWriter::PipeWriter(const std::string& path) : path_(path) {
  file_ = udpSocket(path, false);
  if (file_ >= 0) return;
  if (path == "-") {
    file_ = dup(STDOUT_FILENO);
    return;
  }
  made_.emplace(path);
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) {
    throw InputError({path, 0, ""}, "is a folder, expected a pipe or a file to write");
  }
  isPipe_ = S_ISFIFO(status.st_mode);
  if (!open() && errno != ENXIO) {
    throw InputError({path, 0, ""}, fmt::format("cannot be written: {}", std::strerror(errno)));
  }
}

PipeWriter::~PipeWriter() { close(); }

void PipeWriter::close() noexcept {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
  rest_.clear();
  begin_ = 0;
}

bool PipeWriter::open() noexcept {
  if (file_ >= 0) return true;
  const int how = isPipe_ ? O_WRONLY | O_NONBLOCK : O_WRONLY | O_TRUNC;
  file_ = ::open(path_.c_str(), how | O_CLOEXEC);
  if (file_ >= 0 && isPipe_) fcntl(file_, F_SETPIPE_SZ, kLargePipe);
  return file_ >= 0;
}

PipeWriter::Written PipeWriter::write(std::string_view piece) noexcept {
  if (!open()) return Written::nowhere;
  if (!flush()) return file_ < 0 ? Written::nowhere : Written::dropped;
  const ssize_t count = writeSome(file_, piece);
  if (count < 0 && errno == EPIPE) {
    close();
    return Written::nowhere;
  }
  if (count <= 0) return Written::dropped;
  const auto written = static_cast<std::size_t>(count);
  if (written < piece.size()) {
    rest_.assign(piece.begin() + written, piece.end());
    begin_ = 0;
  }
  return Written::whole;
}

bool PipeWriter::flush(double wait_s) noexcept {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(wait_s);
  while (file_ >= 0 && begin_ < rest_.size()) {
    const ssize_t count =
        writeSome(file_, std::string_view(rest_.data(), rest_.size()).substr(begin_));
    if (count > 0) {
      begin_ += static_cast<std::size_t>(count);
      continue;
    }
    if (count < 0 && errno == EPIPE) {
      close();
      return false;
    }
    const double left_s = std::chrono::duration<double>(end - Clock::now()).count();
    if (!(left_s > 0)) return false;
    pollfd state{file_, POLLOUT, 0};
    poll(&state, 1, static_cast<int>(std::ceil(1000 * left_s)));
  }
  return file_ >= 0;
}

std::size_t PipeWriter::unread() const noexcept {
  int bytes = 0;
  if (!isPipe_ || file_ < 0 || ioctl(file_, FIONREAD, &bytes) != 0 || bytes < 0) return 0;
  return static_cast<std::size_t>(bytes);
}

}  // namespace depthservo::detail
