#pragma once

#include <string>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/sequence/Sequence.h"
#include "observation/ImageObserver.h"
#include "observation/makeEstimator.h"

namespace depthservo {

/// What replay, live and compare observe.
struct ObservedSource {
  std::string place;     ///< folder, file or camera, for messages
  std::string settings;  ///< file that names the target and how to observe it; empty: none
  PinholeCamera camera;
  SequenceTarget target;
  double frameRate = 0;    ///< images per second, 0: not known [Hz]
  double fastestRate = 0;  ///< by the shortest time between two images, 0: not known [Hz]

  static ObservedSource of(const Sequence& sequence);
};

/// The estimator asked for. \throw InputError the source lacks what it needs, or its gains cannot
/// be meant
EstimatorSetup setupOf(const ObservedSource& source, const ObservationOptions& options);

/// All that the observer needs but the ids of recorded tracks and room for the odometry.
/// \param options with tracker and motion chosen \throw InputError as setupOf
ImageObserver::Parts partsOf(const ObservedSource& source, const ObservationOptions& options);

/// These options as run.json tells them, one JSON object. \param options as above
std::string configurationOf(const ObservationOptions& options);

}  // namespace depthservo
