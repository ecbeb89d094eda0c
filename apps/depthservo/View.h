#pragma once

#include <visp3/core/vpImage.h>

#include <functional>
#include <memory>
#include <string>

#include "depthservo/observation/RunLog.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

struct ViewOptions {
  int width = 0, height = 0;  ///< of the images [px]
  double rate = 0;            ///< images shown per second; 0: as they come [Hz]
  std::string title;
  std::string option;  ///< that asked for the window, for messages

  /// Called when the window or its display is closed from outside, which Xlib does not survive: the
  /// program ends after it, with exit code 0. Empty: it ends with Xlib's message.
  std::function<void()> whenClosed{};
};

/// A window with the live image: dots where they are measured or predicted, their goals and paths,
/// depth with its 2-sigma interval. Keeps real time.
/// It is made by the module libdepthservo_view.so.
class View {
 public:
  /// \throw InputError there is no display, or no module
  static std::unique_ptr<View> open(const ViewOptions& options);
  virtual ~View() = default;

  /// \param log up to and including the record \param status a line of text below; may be empty
  virtual void show(const DEPTHSERVO_VISP vpImage<unsigned char>& image, const FrameRecord& record,
                    const RunLog& log, const std::string& status = "") = 0;

  /// Whether q or Escape was pressed.
  virtual bool isClosed() const = 0;
};

/// The one function of the module.
using OpenView = View*(const ViewOptions&);
constexpr const char* kOpenView = "depthservoOpenView";

}  // namespace depthservo
