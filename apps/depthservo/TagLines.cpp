#include "TagLines.h"

#include <fmt/core.h>

#include <cmath>
#include <cstdio>

namespace depthservo {

void printTags(const RunLog& log) {
  for (const TagRecord& tag : log.tags) {
    if (std::isnan(tag.observed_size)) continue;
    fmt::print(stderr, "  tag {}: observed size {:.4g} +- {:.2g} m (2 sigma)", tag.id,
               tag.observed_size, 2 * tag.sigma);
    if (!std::isnan(tag.size)) fmt::print(stderr, ", given as {:g} m", tag.size);
    fmt::print(stderr, "\n");
  }
  for (const Event& event : log.events) {
    if (event.what.rfind("tag ", 0) == 0) {
      fmt::print(stderr, "warning: at {:.2f} s: {}\n", event.time_s - log.frames.front().time_s,
                 event.what);
    }
  }
}

}  // namespace depthservo
