#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/observation/ObservedSource.h"
#include "depthservo/tracking/PointTracker.h"
#include "observation/makeEstimator.h"

namespace depthservo {

/// What an observer is made from, worked out of a source and what was asked for.
struct ObserverSetup {
  PinholeCamera camera;
  double pixelNoise_px = 0.5;       ///< 1 sigma per axis told to the estimator
  bool isPixelNoiseGiven = false;   ///< by the user
  bool learnsNoise = false;         ///< of pixels and poses, from how the points agree
  bool takesTrackersNoise = false;  ///< the tracker's sigma of each point instead
  const char* noun = "point";       ///< what a point is called: point | dot | corner
  std::vector<int> ids;             ///< every id that may be found, ascending
  /// Greatest number of points at once where the tracker chooses them and their ids come and go;
  /// 0: as many as ids.
  std::size_t capacity = 0;
  std::optional<AprilTagTarget> tags;  ///< whose sizes are compared with the observed depths
  DepthPrior prior;                    ///< of every point
  EstimatorSetup estimator;
  std::string profile;                    ///< of the robot's errors, by its word
  OdometryNoise declaredNoise;            ///< of the odometry, for the diagnosis
  std::unique_ptr<PointTracker> tracker;  ///< none: points come with the exposure
  std::optional<DotTarget> followed;      ///< its pose tells how the camera moves; none: rows do
  std::size_t odometryRows = 1024;
  RowMeaning rows = RowMeaning::hold;
  double rowPeriod_s = 0;

  bool findsPoints() const { return capacity > 0; }

  /// \throw InputError the source lacks what the options ask for, or its gains are implausible
  static ObserverSetup of(const ObservedSource& source, const ObservationOptions& options);
};

/// The options with tracker chosen for the source. \throw InputError it lacks what that takes
DEPTHSERVO_INNER ObservationOptions withTracker(const ObservedSource& source,
                                                ObservationOptions options);

/// The estimator asked for. \param options with tracker and motion chosen \throw InputError the
/// source lacks what it needs, or its gains are implausible
DEPTHSERVO_INNER EstimatorSetup setupOf(const ObservedSource& source,
                                        const ObservationOptions& options);

}  // namespace depthservo
