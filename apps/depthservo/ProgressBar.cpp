#include "ProgressBar.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>

namespace depthservo {
namespace {

constexpr int kWidth = 40;

}  // namespace

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), isTerminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (isTerminal_) fmt::print(stderr, "\r{:{}}\r", "", label_.size() + kWidth + 10);
}

void ProgressBar::show(double fraction) {
  const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
  if (!isTerminal_ || percent == shown_percent_) return;
  shown_percent_ = percent;
  const int filled = kWidth * percent / 100;
  fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3}%", label_, "", filled, "", kWidth - filled,
             percent);
}

}  // namespace depthservo
