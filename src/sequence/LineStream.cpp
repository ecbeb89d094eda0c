#include "sequence/LineStream.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "depthservo/text/InputError.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kLongestLine = 4096;                  // bytes
constexpr std::size_t kMostAtATime = std::size_t{1} << 20;  // bytes

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

int udpSocket(const std::string& path, bool isListener) {
  if (path.compare(0, 4, "udp:") != 0) return -1;
  const std::size_t colon = path.rfind(':');
  const std::string host = colon > 4 ? path.substr(4, colon - 4) : "";
  const auto port = toInteger(path.substr(colon + 1));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  if (!port || *port < 1 || *port > 65535 ||
      inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) {
    throw InputError({path, 0, ""}, "expected udp:ADDRESS:PORT, e.g. udp:127.0.0.1:5005");
  }
  address.sin_port = htons(static_cast<std::uint16_t>(*port));
  const int file = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  const int done = isListener ? bind(file, to, sizeof address) : connect(file, to, sizeof address);
  if (file < 0 || done != 0) {
    const int error = errno;
    if (file >= 0) close(file);
    throw InputError({path, 0, ""}, fmt::format("cannot be opened: {}", std::strerror(error)));
  }
  return file;
}

LineStream::LineStream(const std::string& path, const char* what) {
  file_ = udpSocket(path, true);
  isSocket_ = file_ >= 0;
  if (!isSocket_) {
    file_ = path == "-" ? dup(STDIN_FILENO) : open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  }
  struct stat status {};
  if (file_ < 0 || fstat(file_, &status) != 0) {
    const int error = errno;
    if (file_ >= 0) close(file_);
    throw InputError({path, 0, ""}, fmt::format("cannot be read: {}", std::strerror(error)));
  }
  isRegular_ = S_ISREG(status.st_mode);
  if (S_ISDIR(status.st_mode)) {
    close(file_);
    throw InputError({path, 0, ""},
                     fmt::format("is a folder, expected a pipe or a file of {}", what));
  }
}

LineStream::~LineStream() { close(file_); }

void LineStream::read(double wait_s, const Listener& listener) {
  std::array<char, 65536> bytes;
  // After its writer has gone, poll says at once that a pipe is readable, for ever.
  int wait_ms = isEnded_ ? 0 : static_cast<int>(std::ceil(1000 * std::max(0.0, wait_s)));
  for (std::size_t total = 0; total < kMostAtATime;) {
    pollfd state{file_, POLLIN, 0};
    const int ready = poll(&state, 1, wait_ms);
    wasInterrupted_ = ready < 0 && errno == EINTR;
    if (ready <= 0 || !(state.revents & (POLLIN | POLLHUP))) break;
    wait_ms = 0;
    const ssize_t count = ::read(file_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) break;
    if (count == 0 && isSocket_) continue;
    if (count == 0) {
      endOfWriter(listener);
      break;
    }
    isEnded_ = false;
    take(bytes.data(), static_cast<std::size_t>(count), listener);
    total += static_cast<std::size_t>(count);
  }
}

void LineStream::take(const char* bytes, std::size_t count, const Listener& listener) {
  for (std::string_view rest(bytes, count); !rest.empty();) {
    const std::size_t end = rest.find('\n');
    const std::string_view part = rest.substr(0, end);
    if (!isOverlong_) line_ += part;
    if (line_.size() > kLongestLine && !isOverlong_) {
      isOverlong_ = true;
      listener.onOverlong(kLongestLine);
      line_.clear();
    }
    if (end == std::string_view::npos) return;
    if (!isOverlong_) listener.onLine(trimmed(line_));
    line_.clear();
    isOverlong_ = false;
    rest.remove_prefix(end + 1);
  }
}

/// The last line of a file is whole without an end of line; that of a pipe may have lost digits.
void LineStream::endOfWriter(const Listener& listener) {
  isEnded_ = true;
  if (isRegular_) {
    listener.onLine(trimmed(line_));
  } else if (!line_.empty()) {
    listener.onTorn(line_);
  }
  line_.clear();
  isOverlong_ = false;
}

}  // namespace depthservo::detail
