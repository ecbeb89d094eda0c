#include "tracking/makeTracker.h"

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
AprilTagTarget tagsOf(const SequenceTarget& seen, const ReplayOptions& options) {
  if (seen.tags) return *seen.tags;
  AprilTagTarget all{options.tagFamily, {}};
  for (int id = 0; id < aprilTagCount(options.tagFamily); ++id) {
    all.tags.push_back({id, {}, Eigen::Isometry3d::Identity()});
  }
  return all;
}

}  // namespace

ReplayTracker chooseTracker(const Sequence& sequence, ReplayTracker wanted) {
  const bool canSeeDots = sequence.hasImages() && !sequence.tags() &&
                          (!sequence.dots().empty() || !sequence.target().points.empty());
  if (wanted == ReplayTracker::automatic && sequence.tags() && sequence.hasImages()) {
    return ReplayTracker::apriltag;
  }
  if ((wanted == ReplayTracker::apriltag || wanted == ReplayTracker::klt) &&
      !sequence.hasImages()) {
    refuse(sequence, fmt::format("--tracker {} needs images (rgb.txt)",
                                 wanted == ReplayTracker::klt ? "klt" : "apriltag"));
  }
  if (wanted == ReplayTracker::automatic) {
    wanted = sequence.hasImages() ? ReplayTracker::dots : ReplayTracker::tracks;
  }
  if (wanted == ReplayTracker::dots && !canSeeDots) {
    refuse(sequence,
           sequence.hasImages()
               ? "no dots to track: give their start positions as 'dots: [[u, v], ...]' or the "
                 "'target' in sequence.yaml"
               : "--tracker dots needs images (rgb.txt)");
  }
  if (wanted == ReplayTracker::tracks && !sequence.hasTracks()) {
    refuse(sequence, "no tracks.csv and no images: there are no points to observe");
  }
  return wanted;
}

ReplayTracker chooseTracker(const SequenceTarget& seen, ReplayTracker wanted,
                            const std::string& source) {
  const bool hasDots = !seen.dots.empty() || (!seen.tags && seen.target.points.size() >= 4);
  if (wanted == ReplayTracker::automatic) {
    return seen.tags ? ReplayTracker::apriltag : hasDots ? ReplayTracker::dots : ReplayTracker::klt;
  }
  if (wanted == ReplayTracker::dots && !hasDots) {
    throw InputError({source, 0, ""},
                     "no dots to track: the target needs at least four points, or the start "
                     "positions of dots");
  }
  if (wanted == ReplayTracker::tracks) {
    throw InputError({source, 0, ""}, "--tracker tracks is for recorded tracks.csv");
  }
  return wanted;
}

const char* nameOf(ReplayTracker tracker) {
  switch (tracker) {
    case ReplayTracker::apriltag:
      return "apriltag";
    case ReplayTracker::klt:
      return "klt";
    case ReplayTracker::tracks:
      return "tracks";
    default:
      return "dots";
  }
}

bool measuresNoise(ReplayTracker tracker) {
  return tracker == ReplayTracker::apriltag || tracker == ReplayTracker::klt;
}

bool findsPoints(const SequenceTarget& seen, ReplayTracker tracker) {
  return tracker == ReplayTracker::klt || (tracker == ReplayTracker::apriltag && !seen.tags);
}

SequenceTarget targetOf(const Sequence& sequence) {
  return {sequence.target(), sequence.tags(), sequence.dots(), sequence.replayHints()};
}

std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen, ReplayTracker tracker,
                                          const ReplayOptions& options) {
  if (tracker == ReplayTracker::tracks) return nullptr;
  if (tracker == ReplayTracker::klt) {
    KltTrackerOptions klt;
    klt.points = options.corners;
    return std::make_unique<KltTracker>(klt);
  }
  if (tracker == ReplayTracker::apriltag) {
    return std::make_unique<AprilTagTracker>(tagsOf(seen, options));
  }
  if (seen.dots.empty()) return std::make_unique<DotTracker>(seen.target);
  std::vector<Eigen::Vector2d> starts;
  for (const PixelPoint& dot : seen.dots) starts.emplace_back(dot.u, dot.v);
  return std::make_unique<DotTracker>(starts);
}

void putTracker(ImageObserver::Parts& parts, const SequenceTarget& seen, ReplayTracker tracker,
                const ReplayOptions& options) {
  parts.tracker = makeTracker(seen, tracker, options);
  parts.takesTrackersNoise = measuresNoise(tracker) && !options.isPixelNoiseGiven;
  if (tracker == ReplayTracker::apriltag) parts.tags = tagsOf(seen, options);
  if (findsPoints(seen, tracker)) {
    constexpr std::size_t kMostTagCorners = 4 * 64;
    parts.capacity = std::max(kMostTagCorners, static_cast<std::size_t>(options.corners));
  } else if (tracker != ReplayTracker::tracks) {
    const std::size_t count = tracker == ReplayTracker::apriltag ? 4 * seen.tags->tags.size()
                              : seen.dots.empty()                ? seen.target.points.size()
                                                                 : seen.dots.size();
    for (std::size_t i = 0; i < count; ++i) parts.ids.push_back(static_cast<int>(i));
  }
}

}  // namespace depthservo
