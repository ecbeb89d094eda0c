#include "View.h"

#include <fmt/format.h>
#include <visp3/core/vpConfig.h>
#include <visp3/core/vpDisplay.h>
#include <visp3/core/vpTime.h>
#include <visp3/gui/vpDisplayX.h>

#include <cstdlib>
#include <map>

#include "depthservo/sequence/InputError.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {
namespace {

vpImagePoint at(double u, double v) { return {v, u}; }

/// Colour-blind safe: blue measured, orange predicted, black goal.
vpColor colourOf(const FeatureRecord& feature) {
  return feature.measured ? vpColor(0, 114, 178) : vpColor(230, 159, 0);
}

constexpr double kLine_px = 16;  // between lines of text

/// The way of every dot so far, in steps of a few pixels.
void drawPaths(const vpImage<unsigned char>& image, const std::vector<FrameRecord>& frames) {
  constexpr double kStep_px = 4;
  std::map<int, vpImagePoint> drawnTo;
  for (const FrameRecord& frame : frames) {
    for (const FeatureRecord& feature : frame.features) {
      const vpImagePoint here = at(feature.u, feature.v);
      const auto [last, isFirst] = drawnTo.try_emplace(feature.id, here);
      if (isFirst || vpImagePoint::distance(last->second, here) < kStep_px) continue;
      vpDisplay::displayLine(image, last->second, here, colourOf(feature), 1);
      last->second = here;
    }
  }
}

}  // namespace

struct View::Window {
  vpImage<unsigned char> image;
  vpDisplayX display;
  double period_ms;
  double next_ms = 0;
};

View::View(const Scenario& scenario) : window_(std::make_unique<Window>()) {
  if (scenario.sensing.source != Scenario::Source::image) {
    throw InputError({"--view", 0, ""}, "this scenario has no images (sensing.source: geometry)");
  }
  window_->image.resize(static_cast<unsigned>(scenario.camera.height),
                        static_cast<unsigned>(scenario.camera.width), 255);
  window_->period_ms = 1000 / scenario.camera.rate.front();
  const char* display = std::getenv("DISPLAY");
  try {
    if (!display || !*display) throw vpException(vpException::notInitialized, "no DISPLAY");
    window_->display.init(window_->image, 50, 50, "depthservo: " + scenario.name);
  } catch (const vpException&) {
    throw InputError({"--view", 0, ""},
                     "no display to show the image on (is DISPLAY set?); run without --view");
  }
}

View::~View() = default;

void View::show(const RunFrame& frame) {
  vpImage<unsigned char>& image = window_->image;
  image = *frame.image;
  vpDisplay::display(image);
  for (std::size_t i = 0; i < frame.log.goals.size(); ++i) {
    vpDisplay::displayCross(image, at(frame.log.goals[i].x(), frame.log.goals[i].y()), 15,
                            vpColor::black, 1);
  }
  drawPaths(image, frame.log.frames);
  double row =
      image.getHeight() - 12.0 - kLine_px * static_cast<double>(frame.record.features.size());
  for (const FeatureRecord& feature : frame.record.features) {
    const vpColor colour = colourOf(feature);
    const DepthEstimate& e = feature.estimate;
    vpDisplay::displayCircle(image, at(feature.u, feature.v), 8, colour, false, 2);
    vpDisplay::displayText(image, at(feature.u + 12, feature.v - 6), fmt::format("{}", feature.id),
                           colour);
    vpDisplay::displayText(image, at(10, row += kLine_px),
                           fmt::format("{}: Z {:.2f} +- {:.2f} m  {}", feature.id, e.Z(),
                                       2 * e.sigma_Z(), toString(e.status)),
                           colour);
  }
  vpDisplay::displayText(
      image, at(10, 20),
      fmt::format("t {:.2f} s   image error {:.1f} px", frame.record.time_s, frame.record.error_px),
      vpColor::black);
  vpDisplay::flush(image);
  if (window_->next_ms == 0) window_->next_ms = vpTime::measureTimeMs();
  vpTime::wait(window_->next_ms, window_->period_ms);
  window_->next_ms += window_->period_ms;
}

}  // namespace depthservo
