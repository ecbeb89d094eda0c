#pragma once

#include <string_view>

namespace depthservo {

/// The files of src/report/page and dygraphs, compiled in.
struct EmbeddedReport {
  std::string_view page;      ///< of a run: HTML with {{placeholders}}
  std::string_view style;     ///< CSS
  std::string_view script;    ///< JavaScript: dygraphs, its synchronizer, ours
  std::string_view pair;      ///< of two runs: HTML with {{placeholders}}
  std::string_view playback;  ///< JavaScript of the latter
  std::string_view sheet;     ///< of tables and figures: HTML with {{placeholders}}
};
const EmbeddedReport& embeddedReport();

}  // namespace depthservo
