#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "depthservo/papers/Reproduce.h"

namespace depthservo {

/// File of a figure in the folder of a reproduction.
std::string figureFile(const Paper& paper, const Figure& figure);

/// The page of a reproduction: what does not reproduce, figures, all rows. Figures that are not in
/// the folder are left out.
std::string reproductionPage(const std::string& name,
                             const std::vector<ReproducedPaper>& reproduced,
                             const std::filesystem::path& folder);

}  // namespace depthservo
