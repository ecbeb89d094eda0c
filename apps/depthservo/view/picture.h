#pragma once

#include <visp3/core/vpImage.h>
#include <visp3/core/vpRGBa.h>

#include <string>

#include "depthservo/observation/RunLog.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// What the live window shows: the image and, over it, points, goals, ways and depths, in colours
/// that the colour-blind tell apart. \param record, log, status as of View::show \param picture
/// becomes of the image's size
void draw(const DEPTHSERVO_VISP vpImage<unsigned char>& image, const FrameRecord& record,
          const RunLog& log, const std::string& status,
          DEPTHSERVO_VISP vpImage<DEPTHSERVO_VISP vpRGBa>& picture);

}  // namespace depthservo
