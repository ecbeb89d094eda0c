#pragma once

#include <memory>
#include <vector>

#include "depthservo/sequence/Sequence.h"
#include "depthservo/servo/Replay.h"
#include "depthservo/tracking/PointTracker.h"

namespace depthservo {

/// How points are to be found in this sequence. \throw InputError it lacks what that takes
ReplayTracker chooseTracker(const Sequence& sequence, ReplayTracker wanted);

/// The target that a sequence names.
SequenceTarget targetOf(const Sequence& sequence);

/// Tracks AprilTags, dots from their start positions, or the dots of a plate by their pattern:
/// the first of these that is named.
std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen);

/// How many points that tracker may give; their ids are 0, 1, ...
std::size_t pointsOf(const SequenceTarget& seen);

}  // namespace depthservo
