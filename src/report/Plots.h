#pragma once

#include <filesystem>
#include <vector>

#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// Draws depth.png, error.png and image.png into a folder with gnuplot; a plot without anything
/// known to show is left out. \return false, with no file left, when gnuplot is not on the PATH or
/// fails
bool drawPlots(const RunLog& log, const std::filesystem::path& folder);

/// Upper end of a depth axis [m] that shows the truth and the estimate, but not a transient far
/// beyond. Unknown entries are NaN; the two may have different sizes.
double depthAxisLimit(const std::vector<double>& Z, const std::vector<double>& Z_true);

}  // namespace depthservo
