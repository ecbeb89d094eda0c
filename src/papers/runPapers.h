#pragma once

#include "papers/Claims.h"

/// Every experiment of each paper.
namespace depthservo {

Experiments runDeLuca2008(const ReproduceOptions& options);
Experiments runDurand2010(const ReproduceOptions& options);
Experiments runIbuki2023(const ReproduceOptions& options);

}  // namespace depthservo
