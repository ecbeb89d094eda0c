#pragma once

/// For sources, never for headers: the names of ViSP without a prefix, whether it lives in a
/// namespace (ViSP 3.7 built so, later ones by default) or not.
#include <visp3/core/vpConfig.h>

#ifdef ENABLE_VISP_NAMESPACE
using namespace VISP_NAMESPACE_NAME;
#endif
