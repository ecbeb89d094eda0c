#include "sequence/ImagePipe.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>

#include "depthservo/text/InputError.h"
#include "sequence/systemTime.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kLongestHeader = 1000;  // bytes
constexpr long long kLargestImage = 64'000'000;
constexpr std::size_t kMostWaiting = std::size_t{64} << 20;  // bytes
constexpr std::string_view kStamp = "timestamp ";

}  // namespace

void appendTo(std::string& bytes, double time_s,
              const DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  bytes += fmt::format("P5\n# timestamp {:.9f}\n{} {}\n255\n", time_s, image.getWidth(),
                       image.getHeight());
  bytes.append(reinterpret_cast<const char*>(image.bitmap), image.getSize());
}

ImagePipe::ImagePipe(const std::string& path, const VideoOptions& options)
    : options_(options), name_(path) {
  file_ = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) {
    throw InputError({path, 0, ""}, fmt::format("cannot be read: {}", std::strerror(errno)));
  }
}

ImagePipe::~ImagePipe() { close(file_); }

/// What stands at a place of the bytes that have come.
ImagePipe::Parsed ImagePipe::parse(std::size_t at, Frame& frame) const {
  const std::string_view rest = std::string_view(bytes_).substr(at);
  if (rest.substr(0, 3) != std::string_view("P5\n").substr(0, rest.size())) return Parsed::rubbish;
  frame.begin = at;
  frame.time_s = std::numeric_limits<double>::quiet_NaN();
  std::array<long long, 3> numbers;
  std::size_t i = 3, count = 0;
  while (count < numbers.size()) {
    const std::size_t end = rest.substr(0, kLongestHeader).find_first_of("\n ", i);
    if (i < rest.size() && rest[i] == '#') {
      const std::size_t line = rest.substr(0, kLongestHeader).find('\n', i);
      if (line == std::string_view::npos) break;
      const std::string_view comment = rest.substr(i, line - i);
      const std::size_t stamp = comment.find(kStamp);
      if (stamp != std::string_view::npos) {
        const auto time = toNumber(comment.substr(stamp + kStamp.size()));
        if (!time || !kTimes.contains(*time)) return Parsed::rubbish;
        frame.time_s = *time;
      }
      i = line + 1;
      continue;
    }
    if (end == std::string_view::npos) break;
    const auto number = toInteger(rest.substr(i, end - i));
    if (!number || *number < 1) return Parsed::rubbish;
    numbers[count++] = *number;
    i = end + 1;
  }
  if (count < numbers.size())
    return rest.size() < kLongestHeader ? Parsed::unfinished : Parsed::rubbish;
  const long long most = kLargestImage;
  if (numbers[0] > most || numbers[1] > most || numbers[0] * numbers[1] > most ||
      numbers[2] != 255) {
    return Parsed::rubbish;
  }
  frame.width = static_cast<unsigned>(numbers[0]);
  frame.height = static_cast<unsigned>(numbers[1]);
  frame.pixels = at + i;
  frame.end = frame.pixels + std::size_t{frame.width} * frame.height;
  return frame.end <= bytes_.size() ? Parsed::frame : Parsed::unfinished;
}

bool ImagePipe::takeNewest(TimedImage& image) {
  Frame frame, newest;
  std::size_t at = 0, frames = 0;
  while (at < bytes_.size()) {
    const Parsed parsed = parse(at, frame);
    if (parsed == Parsed::unfinished) break;
    if (parsed == Parsed::rubbish) {
      at = std::min(bytes_.find("P5\n", at + 1), bytes_.size());
      continue;
    }
    newest = frame;
    at = frame.end;
    ++frames;
  }
  if (frames > 0) {
    image.time_s = std::isnan(newest.time_s) ? systemTime_s() - options_.latency_s : newest.time_s;
    image.image.resize(newest.height, newest.width);
    std::copy_n(bytes_.data() + newest.pixels, image.image.getSize(), image.image.bitmap);
    leftOut_ += frames - 1;
  }
  bytes_.erase(0, at);
  return frames > 0;
}

/// Takes what is there. False: the writer has gone.
bool ImagePipe::readMore() {
  std::array<char, 65536> piece;
  while (bytes_.size() < kMostWaiting) {
    const ssize_t count = read(file_, piece.data(), piece.size());
    if (count == 0) return false;
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) break;
    bytes_.append(piece.data(), static_cast<std::size_t>(count));
  }
  return true;
}

ImageStatus ImagePipe::next(TimedImage& image) {
  using Clock = std::chrono::steady_clock;
  constexpr int kSlice_ms = 20;  // in which somebody may ask to stop
  const double patience_s = isFirst_ ? options_.first_s : options_.silence_s;
  const auto end = Clock::now() + std::chrono::duration<double>(patience_s);
  while (!hasEnded_) {
    if (options_.stop && *options_.stop) {
      reason_ = "stopped by the user";
      return ImageStatus::ended;
    }
    pollfd state{file_, POLLIN, 0};
    const int ready = poll(&state, 1, kSlice_ms);
    if (ready > 0 && (state.revents & (POLLIN | POLLHUP))) hasEnded_ = !readMore();
    if (takeNewest(image)) {
      isFirst_ = false;
      return ImageStatus::image;
    }
    if (Clock::now() > end) {
      reason_ = fmt::format("no image for {:g} s", patience_s);
      return ImageStatus::ended;
    }
  }
  reason_ = "whoever wrote the images has gone";
  return ImageStatus::ended;
}

}  // namespace depthservo::detail
