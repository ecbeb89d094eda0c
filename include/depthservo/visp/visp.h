#pragma once

/// How depthservo's headers name ViSP's classes: from ViSP 3.7 they may live in a namespace. Write
/// `DEPTHSERVO_VISP vpImage<...>`; inside subclasses of vpBasicFeature write `class DEPTHSERVO_VISP
/// vpServo`, since `vpServo` alone is an enumerator there.
#include <visp3/core/vpConfig.h>

#ifdef ENABLE_VISP_NAMESPACE
#define DEPTHSERVO_VISP VISP_NAMESPACE_ADDRESSING
#else
#define DEPTHSERVO_VISP
#endif
