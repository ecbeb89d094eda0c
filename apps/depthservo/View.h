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
class View {
 public:
  /// \throw InputError there is no display
  explicit View(const ViewOptions& options);
  ~View();

  /// \param log up to and including the record \param status a line of text below; may be empty
  void show(const DEPTHSERVO_VISP vpImage<unsigned char>& image, const FrameRecord& record,
            const RunLog& log, const std::string& status = "");

  /// Whether q or Escape was pressed.
  bool isClosed() const;

 private:
  struct Window;
  std::unique_ptr<Window> window_;
};

}  // namespace depthservo
