#pragma once

#include <filesystem>

#include "depthservo/observation/RunLog.h"
#include "depthservo/text/NewFolder.h"

namespace depthservo {

/// Writes a log as a run folder, whole or not at all: everything goes to a sibling that is renamed
/// at the end.
///
/// `run.json` effective configuration, versions, seed, outcome, metrics, events; `frames.csv` one
/// row per frame; `features.csv` one row per feature and frame from its first on; `timing.json`
/// wall-clock times (the only file with any); `<stem>.png` the log's images; `report.html`; and,
/// with gnuplot on the PATH, `depth.png`, `error.png` and `image.png`. Times have nine decimals,
/// other figures read back as the same double, unknown ones are empty cells. Equal logs give equal
/// bytes, but for timing.json.
///
/// \return whether the PNG plots were drawn
/// \throw InputError the place is refused (see requireNewRunFolder) or cannot be written to
bool writeRunFolder(const RunLog& log, const std::filesystem::path& folder);

}  // namespace depthservo
