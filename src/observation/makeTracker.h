#pragma once

#include <memory>
#include <string>

#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/tracking/PointTracker.h"
#include "observation/ImageObserver.h"

namespace depthservo {

/// How points are to be found in this sequence. \throw InputError it lacks what that takes
TrackerKind chooseTracker(const Sequence& sequence, TrackerKind wanted);

/// How this target is to be found in images; natural corners where there is none.
/// \param source of the images, for messages \throw InputError it lacks what that takes
TrackerKind chooseTracker(const SequenceTarget& seen, TrackerKind wanted,
                            const std::string& source);

const char* nameOf(TrackerKind tracker);

/// Whether the tracker says of each point how accurate it is.
bool measuresNoise(TrackerKind tracker);

/// Whether points and their ids are known only when they are seen: they are not the target's.
bool findsPoints(const SequenceTarget& seen, TrackerKind tracker);

/// The target that a sequence names.
SequenceTarget targetOf(const Sequence& sequence);

/// Null for tracks.
std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen, TrackerKind tracker,
                                          const ObservationOptions& options);

/// The tracker and what the observer must know of its points.
void putTracker(ImageObserver::Parts& parts, const SequenceTarget& seen, TrackerKind tracker,
                const ObservationOptions& options);

}  // namespace depthservo
