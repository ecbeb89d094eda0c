#pragma once

#include <visp3/core/vpImage.h>

#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/servo/ServoGoal.h"
#include "depthservo/tracking/PointTracker.h"
#include "depthservo/visp/GrayImage.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

struct TeachOptions {
  TrackerKind tracker = TrackerKind::automatic;  ///< automatic: as the target says, else klt
  std::string tagFamily = "36h11";               ///< without a target
  int corners = 40;                              ///< natural corners that are kept, 4..256
  std::optional<double> depth;                   ///< of all points at the goal, if known [m]
};

/// A goal by showing it: what a camera sees from there.
///
/// As a folder it is a sequence of one image: the target in sequence.yaml (dots of a plate whose
/// size is not known as `dots`; no target for natural corners), the points in tracks.csv, their
/// depths in truth.csv where they are known.
struct DEPTHSERVO_API TaughtGoal {
  PinholeCamera camera;
  GrayImage image;
  TrackerKind tracker = TrackerKind::klt;  ///< dots, apriltag or klt
  SequenceTarget target;                   ///< as the folder names it
  std::vector<TrackedPoint> points;        ///< ids 0, 1, ...
  std::vector<double> Z;                   ///< by point [m]; empty: not known

  /// What finds the same points in other images: the pattern of the dots stands for a plate whose
  /// size is not known (its points are those of the goal's image plane, 1 m away).
  SequenceTarget toFind() const;

  /// The same goal by those of its natural corners that an image shows, numbered anew: a robot need
  /// not wait for one that is not in its view. Any other goal as it is. \param news what was found
  /// \return none: the image does not show the goal
  std::optional<TaughtGoal> seenIn(const DEPTHSERVO_VISP vpImage<unsigned char>& from,
                                   std::string& news) const;

  /// \param otherwise depth where none is known [m]
  ServoGoal servoGoal(double otherwise) const;
};

/// \param target what is in the image, where it is known \throw InputError it is not there
DEPTHSERVO_API TaughtGoal teach(const DEPTHSERVO_VISP vpImage<unsigned char>& image,
                                const PinholeCamera& camera, const SequenceTarget& target,
                                const TeachOptions& options, const std::string& place);

/// \param folder must not exist \throw InputError
DEPTHSERVO_API void writeGoal(const TaughtGoal& goal, const std::string& folder);

/// \throw InputError the folder is no goal
DEPTHSERVO_API TaughtGoal readGoal(const std::string& folder);

}  // namespace depthservo
