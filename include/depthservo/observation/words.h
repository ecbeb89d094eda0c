#pragma once

#include <string>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/text/InputError.h"

namespace depthservo {

/// dots | apriltag | chessboard | charuco | klt | tracks | auto. \param place of the word \throw
/// InputError another word
DEPTHSERVO_API TrackerKind trackerNamed(const std::string& name, const InputError::Place& place);

/// twist | groundtruth | target | auto. \param place of the word \throw InputError another word
DEPTHSERVO_API MotionSource motionNamed(const std::string& name, const InputError::Place& place);

/// hold | instant | mean-before. \param place of the word \throw InputError another word
DEPTHSERVO_API RowMeaning rowMeaningNamed(const std::string& name, const InputError::Place& place);

/// These options as run.json tells them, one JSON object. \param options as above
DEPTHSERVO_API std::string configurationOf(const ObservationOptions& options);

}  // namespace depthservo
