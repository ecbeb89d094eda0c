#pragma once

#include <string_view>

namespace depthservo {

/// The files of data/sweeps/deluca2008, and the scenarios that they vary, compiled in.
struct EmbeddedSweeps {
  std::string_view points640, points1024, search640, search1024late, moments640, moments1024;
  std::string_view points, moments;
};
const EmbeddedSweeps& embeddedSweeps();

}  // namespace depthservo
