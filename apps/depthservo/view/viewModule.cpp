#include <visp3/core/vpConfig.h>
#include <visp3/core/vpDisplay.h>
#include <visp3/core/vpTime.h>
#include <visp3/gui/vpDisplayX.h>

#include <cstdlib>
#include <utility>

#include "../View.h"
#include "depthservo/text/InputError.h"
#include "depthservo/visp/using.h"
#include "picture.h"

// After the others: its macros are named None, Status, Bool, ...
#include <X11/Xlib.h>

namespace depthservo {
namespace {

std::function<void()> whenClosed;

int endInOrder(Display*) {
  whenClosed();
  std::_Exit(EXIT_SUCCESS);
}

class Window : public View {
 public:
  explicit Window(const ViewOptions& options);
  void show(const vpImage<unsigned char>& shown, const FrameRecord& record, const RunLog& log,
            const std::string& status) override;
  bool isClosed() const override;

 private:
  vpImage<vpRGBa> image_;
  vpDisplayX display_;
  double period_ms_;
  double next_ms_ = 0;
};

Window::Window(const ViewOptions& options) {
  image_.resize(static_cast<unsigned>(options.height), static_cast<unsigned>(options.width));
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
  draw(shown, record, log, status, image_);
  vpDisplay::display(image_);
  vpDisplay::flush(image_);
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
