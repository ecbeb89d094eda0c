#pragma once

#include <string_view>

namespace depthservo {

/// The files of data/papers, compiled in.
struct EmbeddedPapers {
  std::string_view deluca2008, durand2010, ibuki2023;
};
const EmbeddedPapers& embeddedPapers();

}  // namespace depthservo
