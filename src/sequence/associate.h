#pragma once

#include <optional>
#include <vector>

#include "depthservo/api.h"

namespace depthservo::detail {

/// For every time of `first` the place of its partner in `second`, as associate.py of the TUM RGB-D
/// benchmark chooses them: of all pairs closer than `most_s`, the closest first, each time used
/// once. Both lists increase.
DEPTHSERVO_INNER std::vector<std::optional<std::size_t>> associate(
    const std::vector<double>& first, const std::vector<double>& second, double most_s = 0.02);

}  // namespace depthservo::detail
