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
  if (isTerminal_) fmt::print(stderr, "\r{:{}}\r", "", label_.size() + kWidth + 10 + words_);
}

void ProgressBar::show(double fraction, const std::string& words) {
  const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
  if (!isTerminal_ || (percent == shown_percent_ && words.empty())) return;
  shown_percent_ = percent;
  const int filled = kWidth * percent / 100;
  words_ = std::max(words_, words.size());
  fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3}% {:<{}}", label_, "", filled, "",
             kWidth - filled, percent, words, words_);
}

}  // namespace depthservo
