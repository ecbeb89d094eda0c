#include "View.h"

#include "text/module.h"

namespace depthservo {

std::unique_ptr<View> View::open(const ViewOptions& options) {
  // All of ViSP's windows, and with them Qt, only for who wants to see one.
  static void* const function =
      detail::loadModule(detail::modulePlaces("libdepthservo_view.so"), kOpenView, "windows");
  return std::unique_ptr<View>(reinterpret_cast<OpenView*>(function)(options));
}

}  // namespace depthservo
