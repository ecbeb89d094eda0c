#pragma once

#include <visp3/core/vpImage.h>

#include <memory>

#include "depthservo/servo/ServoLoop.h"

namespace depthservo {

/// A window with the live image: dots where they are measured or predicted, their goals and paths,
/// depth with its 2-sigma interval. Keeps real time.
class View {
 public:
  /// \throw InputError there is no display, or the scenario has no images
  explicit View(const Scenario& scenario);
  ~View();

  void show(const RunFrame& frame);

 private:
  struct Window;
  std::unique_ptr<Window> window_;
};

}  // namespace depthservo
