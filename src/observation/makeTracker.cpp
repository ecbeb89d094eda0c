#include "observation/makeTracker.h"

#include <fmt/format.h>

#include <algorithm>

#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/tracking/KltTracker.h"

namespace depthservo {
namespace {

[[noreturn]] void refuse(const Sequence& sequence, const std::string& message) {
  throw InputError({sequence.folder(), 0, ""}, message);
}

/// The tags of the target, or all of a family with unknown sizes.
AprilTagTarget tagsOf(const SequenceTarget& seen, const ObservationOptions& options) {
  if (seen.tags) return *seen.tags;
  AprilTagTarget all{options.tagFamily, {}};
  for (int id = 0; id < aprilTagCount(options.tagFamily); ++id) {
    all.tags.push_back({id, {}, Eigen::Isometry3d::Identity()});
  }
  return all;
}

}  // namespace

TrackerKind chooseTracker(const Sequence& sequence, TrackerKind wanted) {
  const bool canSeeDots = sequence.hasImages() && !sequence.tags() &&
                          (!sequence.dots().empty() || !sequence.target().points.empty());
  if (wanted == TrackerKind::automatic && sequence.tags() && sequence.hasImages()) {
    return TrackerKind::apriltag;
  }
  if ((wanted == TrackerKind::apriltag || wanted == TrackerKind::klt) &&
      !sequence.hasImages()) {
    refuse(sequence, fmt::format("--tracker {} needs images (rgb.txt)",
                                 wanted == TrackerKind::klt ? "klt" : "apriltag"));
  }
  if (wanted == TrackerKind::automatic) {
    wanted = sequence.hasImages() ? TrackerKind::dots : TrackerKind::tracks;
  }
  if (wanted == TrackerKind::dots && !canSeeDots) {
    refuse(sequence,
           sequence.hasImages()
               ? "no dots to track: give their start positions as 'dots: [[u, v], ...]' or the "
                 "'target' in sequence.yaml"
               : "--tracker dots needs images (rgb.txt)");
  }
  if (wanted == TrackerKind::tracks && !sequence.hasTracks()) {
    refuse(sequence, "no tracks.csv and no images: there are no points to observe");
  }
  return wanted;
}

TrackerKind chooseTracker(const SequenceTarget& seen, TrackerKind wanted,
                            const std::string& source) {
  const bool hasDots = !seen.dots.empty() || (!seen.tags && seen.target.points.size() >= 4);
  if (wanted == TrackerKind::automatic) {
    return seen.tags ? TrackerKind::apriltag : hasDots ? TrackerKind::dots : TrackerKind::klt;
  }
  if (wanted == TrackerKind::dots && !hasDots) {
    throw InputError({source, 0, ""},
                     "no dots to track: the target needs at least four points, or the start "
                     "positions of dots");
  }
  if (wanted == TrackerKind::tracks) {
    throw InputError({source, 0, ""}, "--tracker tracks is for recorded tracks.csv");
  }
  return wanted;
}

const char* nameOf(TrackerKind tracker) {
  switch (tracker) {
    case TrackerKind::apriltag:
      return "apriltag";
    case TrackerKind::klt:
      return "klt";
    case TrackerKind::tracks:
      return "tracks";
    default:
      return "dots";
  }
}

bool measuresNoise(TrackerKind tracker) {
  return tracker == TrackerKind::apriltag || tracker == TrackerKind::klt;
}

bool findsPoints(const SequenceTarget& seen, TrackerKind tracker) {
  return tracker == TrackerKind::klt || (tracker == TrackerKind::apriltag && !seen.tags);
}

SequenceTarget targetOf(const Sequence& sequence) {
  return {sequence.target(), sequence.tags(), sequence.dots(), sequence.replayHints()};
}

std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen, TrackerKind tracker,
                                          const ObservationOptions& options) {
  if (tracker == TrackerKind::tracks) return nullptr;
  if (tracker == TrackerKind::klt) {
    KltTrackerOptions klt;
    klt.points = options.corners;
    return std::make_unique<KltTracker>(klt);
  }
  if (tracker == TrackerKind::apriltag) {
    return std::make_unique<AprilTagTracker>(tagsOf(seen, options));
  }
  if (seen.dots.empty()) return std::make_unique<DotTracker>(seen.target);
  std::vector<Eigen::Vector2d> starts;
  for (const PixelPoint& dot : seen.dots) starts.emplace_back(dot.u, dot.v);
  return std::make_unique<DotTracker>(starts);
}

void putTracker(ImageObserver::Parts& parts, const SequenceTarget& seen, TrackerKind tracker,
                const ObservationOptions& options) {
  parts.tracker = makeTracker(seen, tracker, options);
  parts.takesTrackersNoise = measuresNoise(tracker) && !options.isPixelNoiseGiven;
  if (tracker == TrackerKind::apriltag) parts.tags = tagsOf(seen, options);
  if (findsPoints(seen, tracker)) {
    constexpr std::size_t kMostTagCorners = 4 * 64;
    parts.capacity = std::max(kMostTagCorners, static_cast<std::size_t>(options.corners));
  } else if (tracker != TrackerKind::tracks) {
    const std::size_t count = tracker == TrackerKind::apriltag ? 4 * seen.tags->tags.size()
                              : seen.dots.empty()                ? seen.target.points.size()
                                                                 : seen.dots.size();
    for (std::size_t i = 0; i < count; ++i) parts.ids.push_back(static_cast<int>(i));
  }
}

}  // namespace depthservo
