#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "depthservo/observation/RunLog.h"
#include "depthservo/scenario/Scenario.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// How points are found in recorded data.
enum class ReplayTracker {
  automatic,  ///< apriltag where the target has tags, else dots where there are images, else tracks
  dots,       ///< DotTracker from the start positions, or from the target's pattern without them
  apriltag,   ///< AprilTagTracker, of the target's tags or of all tags of a family
  klt,        ///< KltTracker: natural corners
  tracks,     ///< tracks.csv
};

/// Where the camera's motion is taken from.
enum class ReplayMotion {
  automatic,    ///< the first of these that the sequence has
  twist,        ///< twist.csv
  groundtruth,  ///< groundtruth.txt
  target,  ///< the pose of the known target, computed in each image; it also gives the true depths
};

struct ReplayOptions {
  ReplayTracker tracker = ReplayTracker::automatic;
  ReplayMotion motion = ReplayMotion::automatic;
  Scenario::Depth depth;               ///< estimator, first guess, range
  std::optional<double> priorSigma_Z;  ///< 1 sigma of the first guess [m]; none: the wide default
  double pixelNoise_px = 0.5;          ///< 1 sigma per axis told to the estimator [px]
  bool isPixelNoiseGiven = false;      ///< if not, apriltag and klt say it of each point themselves

  std::string tagFamily = "36h11";  ///< of AprilTags when the sequence does not name its target
  int corners = 300;                ///< as many as klt follows at once, 1..2000

  /// Declared noise of the odometry; none: the estimator's own default.
  std::optional<OdometryNoise> odometryNoise;
  double odometryScaleSigma = 0;  ///< relative, 1 sigma
  double focalSigma = 0;          ///< of the focal length, relative, 1 sigma

  DepthPrior prior() const;  ///< of every point

  /// As the sequence itself asks for, with the defaults above for the rest. \throw InputError
  static ReplayOptions of(const Sequence& sequence);
  /// \param file where the hints stand, for messages
  static ReplayOptions of(const ReplayHints& hints, const std::string& file);
};

/// Observes depth on recorded data: the same tracker and estimator as in the servo loop, with no
/// robot. \param progress called with the fraction done, may be empty \throw InputError the
/// sequence lacks what the options ask for, or an image cannot be read
RunLog replay(const Sequence& sequence, const ReplayOptions& options,
              const std::function<void(double)>& progress = {});

}  // namespace depthservo
