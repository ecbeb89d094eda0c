#include "sequence/bag/ByteSource.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "depthservo/text/InputError.h"
#include "depthservo/text/didYouMean.h"

namespace depthservo::detail {

void ByteSource::require(std::uint64_t offset, std::uint64_t count) const {
  if (offset <= size() && count <= size() - offset) return;
  throw BagFault(fmt::format("{} bytes are expected at byte {} of {}", count, offset, size()));
}

FileBytes::FileBytes(const std::string& path) : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (file_ < 0) {
    throw InputError({path, 0, ""}, errno == ENOENT
                                        ? "there is no such file" + didYouMeanFile(path)
                                        : fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  struct stat status {};
  if (fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(file_);
    throw InputError({path, 0, ""}, "is not a file that can be read at any place");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileBytes::~FileBytes() { close(file_); }

std::string_view FileBytes::at(std::uint64_t offset, std::uint64_t count) {
  require(offset, count);
  if (count > kMostBytesHeld) {
    throw BagFault(fmt::format("has a record of {} bytes at byte {}; up to {} are read", count,
                               offset, kMostBytesHeld));
  }
  if (offset < start_ || offset + count > start_ + window_.size()) {
    constexpr std::uint64_t kWindow = 4096;
    window_.resize(static_cast<std::size_t>(std::min(std::max(count, kWindow), size_ - offset)));
    start_ = offset;
    std::size_t done = 0;
    while (done < window_.size()) {
      const ssize_t n = pread(file_, window_.data() + done, window_.size() - done,
                              static_cast<off_t>(offset + done));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) {
        window_.clear();
        throw BagFault(fmt::format("cannot be read at byte {}: {}", offset + done,
                                   n == 0 ? "it has become shorter" : std::strerror(errno)));
      }
      done += static_cast<std::size_t>(n);
    }
  }
  return std::string_view(window_).substr(static_cast<std::size_t>(offset - start_),
                                          static_cast<std::size_t>(count));
}

}  // namespace depthservo::detail
