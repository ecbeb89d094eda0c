#include "depthservo/sequence/PushedSources.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

namespace depthservo {

void PushedImages::push(TimedImage image) {
  const std::lock_guard lock(mutex_);
  if (isEnded_) return;
  if (images_.size() == options_.most) {
    images_.pop_front();
    ++leftOut_;
  }
  images_.push_back(std::move(image));
  wake_.notify_one();
}

void PushedImages::end(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (!isEnded_) reason_ = reason;
  isEnded_ = true;
  wake_.notify_one();
}

ImageStatus PushedImages::next(TimedImage& image) {
  std::unique_lock lock(mutex_);
  const auto isReady = [&] { return isEnded_ || !images_.empty(); };
  if (options_.silence_s <= 0) {
    wake_.wait(lock, isReady);
  } else if (!wake_.wait_for(lock, std::chrono::duration<double>(options_.silence_s), isReady)) {
    reason_ = fmt::format("no image for {:g} s", options_.silence_s);
    return ImageStatus::ended;
  }
  if (images_.empty()) return ImageStatus::ended;
  image = std::move(images_.front());
  images_.pop_front();
  return ImageStatus::image;
}

std::string PushedImages::reason() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

std::size_t PushedImages::leftOut() const {
  const std::lock_guard lock(mutex_);
  return leftOut_;
}

void PushedTwists::push(const OdometryRow& row) {
  constexpr std::size_t kMostFaults = 10;
  const std::lock_guard lock(mutex_);
  std::string fault;
  if (!std::isfinite(row.time_s) || !row.twist.isUsable()) {
    ++counts_.malformed;
    fault = "expected seven finite numbers, and no faster than 1e4 m/s and rad/s";
  } else if (!(row.time_s > last_s_)) {
    ++counts_.notLater;
    fault = fmt::format("one of {} s comes after one of {} s", row.time_s, last_s_);
  } else {
    ++counts_.rows;
    last_s_ = row.time_s;
    rows_.push_back(row);
    wake_.notify_one();
    return;
  }
  if (faults_.size() < kMostFaults) faults_.push_back(std::move(fault));
}

void PushedTwists::end() {
  const std::lock_guard lock(mutex_);
  isEnded_ = true;
  wake_.notify_one();
}

std::vector<OdometryRow> PushedTwists::read(double wait_s) {
  std::unique_lock lock(mutex_);
  if (wait_s > 0) {
    wake_.wait_for(lock, std::chrono::duration<double>(wait_s),
                   [&] { return isEnded_ || !rows_.empty(); });
  }
  told_ = counts_;
  return std::exchange(rows_, {});
}

bool PushedTwists::isEnded() const {
  const std::lock_guard lock(mutex_);
  return isEnded_ && rows_.empty();
}

std::vector<std::string> PushedTwists::takeFaults() {
  const std::lock_guard lock(mutex_);
  return std::exchange(faults_, {});
}

}  // namespace depthservo
