#pragma once

#include <optional>
#include <string>

#include "depthservo/api.h"
#include "depthservo/motion/OdometryNoise.h"
#include "depthservo/motion/OdometryRow.h"
#include "depthservo/observation/EstimatorOptions.h"

namespace depthservo {

/// How points are found in recorded data.
enum class TrackerKind {
  automatic,   ///< that of the target where there are images, else tracks
  dots,        ///< DotTracker from the start positions, or from the target's pattern without them
  apriltag,    ///< AprilTagTracker, of the target's tags or of all tags of a family
  chessboard,  ///< BoardTracker, of the target's board
  charuco,     ///< BoardTracker, of the target's board with markers
  klt,         ///< KltTracker: natural corners
  tracks,      ///< tracks.csv
};

/// Where the camera's motion is taken from.
enum class MotionSource {
  automatic,    ///< the first of these that the sequence has
  twist,        ///< twist.csv
  groundtruth,  ///< groundtruth.txt
  target,  ///< the pose of the known target, computed in each image; it also gives the true depths
};

struct DEPTHSERVO_API ObservationOptions {
  TrackerKind tracker = TrackerKind::automatic;
  MotionSource motion = MotionSource::automatic;
  EstimatorOptions depth;              ///< estimator, first guess, range
  std::optional<double> priorSigma_Z;  ///< 1 sigma of the first guess [m]; none: the wide default
  double pixelNoise_px = 0.5;          ///< 1 sigma per axis told to the estimator [px]
  bool isPixelNoiseGiven = false;      ///< if not, the trackers but dots say it of each point

  std::string tagFamily = "36h11";  ///< of AprilTags when the sequence does not name its target
  int corners = 300;                ///< as many as klt follows at once, 1..2000

  /// Declared noise of the odometry; none: the estimator's own default.
  std::optional<OdometryNoise> odometryNoise;
  std::optional<RowMeaning> rows;  ///< what the rows of odometry mean; none: as the source has it
  double odometryScaleSigma = 0;   ///< relative, 1 sigma
  double focalSigma = 0;           ///< of the focal length, relative, 1 sigma

  ObservationOptions() { depth.errors = ErrorKind::automatic; }

  DepthPrior prior() const;  ///< of every point
};

}  // namespace depthservo
