#pragma once

#include <vector>

#include "depthservo/servo/Reproduce.h"
#include "servo/reproduce/Rows.h"

/// The experiments of De Luca, Oriolo, Robuffo Giordano 2008 by section, one file each. Rows have
/// the prefix "deluca2008/", figures the order of the paper.
namespace depthservo::deluca2008 {

/// Section 5.1: depth of a point in the numerical example and under an arm.
void addDepthExperiments(Rows& rows, std::vector<Figure>& figures, const ReproduceOptions& options);

}  // namespace depthservo::deluca2008
