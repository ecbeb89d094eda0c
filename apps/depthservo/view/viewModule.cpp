#include <fmt/format.h>
#include <visp3/core/vpConfig.h>
#include <visp3/core/vpDisplay.h>
#include <visp3/core/vpTime.h>
#include <visp3/gui/vpDisplayX.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

#include "../View.h"
#include "depthservo/text/InputError.h"
#include "depthservo/visp/using.h"

// After the others: its macros are named None, Status, Bool, ...
#include <X11/Xlib.h>

namespace depthservo {
namespace {

vpImagePoint at(double u, double v) { return {v, u}; }

/// Colour-blind safe: blue measured, orange predicted, black goal.
vpColor colourOf(const FeatureRecord& feature) {
  return feature.measured ? vpColor(0, 114, 178) : vpColor(230, 159, 0);
}

constexpr double kLine_px = 16;            // between lines of text
constexpr std::size_t kLongestPath = 900;  // images
constexpr std::size_t kMostLines = 12;     // of text, a point each

/// The way of every dot so far, in steps of a few pixels.
void drawPaths(const vpImage<unsigned char>& image, const std::vector<FrameRecord>& frames) {
  constexpr double kStep_px = 4;
  std::map<int, vpImagePoint> drawnTo;
  const std::size_t first = frames.size() > kLongestPath ? frames.size() - kLongestPath : 0;
  for (std::size_t k = first; k < frames.size(); ++k) {
    for (const FeatureRecord& feature : frames[k].features) {
      const vpImagePoint here = at(feature.u, feature.v);
      const auto [last, isFirst] = drawnTo.try_emplace(feature.id, here);
      if (isFirst || vpImagePoint::distance(last->second, here) < kStep_px) continue;
      vpDisplay::displayLine(image, last->second, here, colourOf(feature), 1);
      last->second = here;
    }
  }
}

std::function<void()> whenClosed;

int endInOrder(Display*) {
  whenClosed();
  std::_Exit(EXIT_SUCCESS);
}

/// Text on a light strip, legible on any image.
void write(const vpImage<unsigned char>& image, double row, const std::string& text,
           const vpColor& colour) {
  constexpr double kLetter_px = 6.2;
  vpDisplay::displayRectangle(image, at(6, row - 12),
                              at(14 + kLetter_px * static_cast<double>(text.size()), row + 3),
                              vpColor(245, 245, 245), true);
  vpDisplay::displayText(image, at(10, row), text, colour);
}

/// What the colours mean.
void drawLegend(const vpImage<unsigned char>& image, double row, bool hasGoals) {
  constexpr double kWord_px = 92;
  double from = image.getWidth() - (hasGoals ? 3 : 2) * kWord_px;
  vpDisplay::displayRectangle(image, at(from - 6, row - 12), at(image.getWidth() - 4., row + 3),
                              vpColor(245, 245, 245), true);
  const auto entry = [&](const char* word, const vpColor& colour) {
    vpDisplay::displayText(image, at(from, row), word, colour);
    from += kWord_px;
  };
  entry("o measured", vpColor(0, 114, 178));
  entry("o predicted", vpColor(230, 159, 0));
  if (hasGoals) entry("+ goal", vpColor::black);
}

/// A line for each point or, of many, one for all.
std::vector<std::pair<std::string, vpColor>> linesOf(const std::vector<FeatureRecord>& features) {
  const auto isKnown = [](const DepthEstimate& e) { return 2 * e.sigma_Z() < e.Z(); };
  if (features.size() > kMostLines) {
    const auto known = std::count_if(features.begin(), features.end(),
                                     [&](const FeatureRecord& f) { return isKnown(f.estimate); });
    return {{fmt::format("{} points, {} depths known", features.size(), known), vpColor::black}};
  }
  std::vector<std::pair<std::string, vpColor>> lines;
  for (const FeatureRecord& feature : features) {
    const DepthEstimate& e = feature.estimate;
    const std::string Z =
        isKnown(e) ? fmt::format("Z {:.3g} +- {:.2g} m", e.Z(), 2 * e.sigma_Z()) : "Z not known";
    lines.emplace_back(fmt::format("{}: {}  {}", feature.id, Z, toString(e.status)),
                       colourOf(feature));
  }
  return lines;
}

class Window : public View {
 public:
  explicit Window(const ViewOptions& options);
  void show(const vpImage<unsigned char>& shown, const FrameRecord& record, const RunLog& log,
            const std::string& status) override;
  bool isClosed() const override;

 private:
  vpImage<unsigned char> image_;
  vpDisplayX display_;
  double period_ms_;
  double next_ms_ = 0;
};

Window::Window(const ViewOptions& options) {
  image_.resize(static_cast<unsigned>(options.height), static_cast<unsigned>(options.width), 255);
  period_ms_ = options.rate > 0 ? 1000 / options.rate : 0;
  if (options.whenClosed) {
    whenClosed = options.whenClosed;
    XSetIOErrorHandler(endInOrder);
  }
  const char* display = std::getenv("DISPLAY");
  try {
    if (!display || !*display) throw vpException(vpException::notInitialized, "no DISPLAY");
    display_.init(image_, 50, 50, "depthservo: " + options.title);
  } catch (const vpException&) {
    throw InputError({options.option, 0, ""},
                     "no display to show the image on (is DISPLAY set?); run without --view");
  }
}

void Window::show(const vpImage<unsigned char>& shown, const FrameRecord& record, const RunLog& log,
                  const std::string& status) {
  vpImage<unsigned char>& image = image_;
  image = shown;
  vpDisplay::display(image);
  for (const Eigen::Vector2d& goal : log.goals) {
    vpDisplay::displayCross(image, at(goal.x(), goal.y()), 15, vpColor::black, 1);
  }
  drawPaths(image, log.frames);
  for (const FeatureRecord& feature : record.features) {
    const vpColor colour = colourOf(feature);
    vpDisplay::displayCircle(image, at(feature.u, feature.v), 8, colour, false, 2);
    vpDisplay::displayText(image, at(feature.u + 12, feature.v - 6), fmt::format("{}", feature.id),
                           colour);
  }
  const auto lines = linesOf(record.features);
  double row = image.getHeight() - 12.0 - kLine_px * static_cast<double>(lines.size());
  for (const auto& [text, colour] : lines) write(image, row += kLine_px, text, colour);
  drawLegend(image, 20, !log.goals.empty());
  std::string head = fmt::format("t {:.2f} s", record.time_s - log.frames.front().time_s);
  if (std::isfinite(record.error_px)) {
    head += fmt::format("   image error {:.1f} px", record.error_px);
  }
  write(image, 20, head, vpColor::black);
  if (!status.empty()) write(image, 20 + kLine_px, status, vpColor::black);
  vpDisplay::flush(image);
  if (period_ms_ == 0) return;
  if (next_ms_ == 0) next_ms_ = vpTime::measureTimeMs();
  vpTime::wait(next_ms_, period_ms_);
  next_ms_ += period_ms_;
}

bool Window::isClosed() const {
  std::string key;
  return vpDisplay::getKeyboardEvent(image_, key, false) &&
         (key == "q" || key == "Q" || key == "Escape");
}

}  // namespace
}  // namespace depthservo

extern "C" __attribute__((visibility("default"))) depthservo::View* depthservoOpenView(
    const depthservo::ViewOptions& options) {
  return new depthservo::Window(options);
}
