#include "servo/makeTracker.h"

#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/tracking/DotTracker.h"

namespace depthservo {
namespace {

[[noreturn]] void refuse(const Sequence& sequence, const std::string& message) {
  throw InputError({sequence.folder(), 0, ""}, message);
}

}  // namespace

ReplayTracker chooseTracker(const Sequence& sequence, ReplayTracker wanted) {
  const bool canSeeDots =
      sequence.hasImages() && (!sequence.dots().empty() || !sequence.target().points.empty());
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

SequenceTarget targetOf(const Sequence& sequence) {
  return {sequence.target(), sequence.tags(), sequence.dots(), sequence.replayHints()};
}

std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen) {
  if (seen.tags) return std::make_unique<AprilTagTracker>(*seen.tags);
  if (seen.dots.empty()) return std::make_unique<DotTracker>(seen.target);
  std::vector<Eigen::Vector2d> starts;
  for (const PixelPoint& dot : seen.dots) starts.emplace_back(dot.u, dot.v);
  return std::make_unique<DotTracker>(starts);
}

std::size_t pointsOf(const SequenceTarget& seen) {
  if (seen.tags) return 4 * seen.tags->tags.size();
  return seen.dots.empty() ? seen.target.points.size() : seen.dots.size();
}

}  // namespace depthservo
