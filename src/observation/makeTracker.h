#pragma once

#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/observation/ObservedSource.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

/// How the points of a source are to be found: apriltag where the target has tags, chessboard or
/// charuco where it is a board, dots where its dots are known, corners where nothing is, tracks
/// where there are no images.
/// \throw InputError it lacks what the wanted one takes
DEPTHSERVO_INNER TrackerKind chooseTracker(const ObservedSource& source, TrackerKind wanted);

DEPTHSERVO_INNER const char* toString(TrackerKind tracker);

TrackerKind trackerOf(const BoardTarget& board);

bool isOfBoard(TrackerKind tracker);

/// Whether the tracker says of each point how accurate it is.
bool measuresNoise(TrackerKind tracker);

/// Whether points and their ids are known only when they are seen: they are not the target's.
bool findsPoints(const SequenceTarget& seen, TrackerKind tracker);

/// The tags of the target, or all of a family with unknown sizes.
AprilTagTarget tagsOf(const SequenceTarget& seen, const ObservationOptions& options);

/// Of every point of the target, ascending.
std::vector<int> idsOf(const SequenceTarget& seen, TrackerKind tracker);

/// Null for tracks.
DEPTHSERVO_INNER std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen,
                                                           TrackerKind tracker,
                                                           const ObservationOptions& options);

}  // namespace depthservo
