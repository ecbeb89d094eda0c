#include "observation/makeTracker.h"

#include <fmt/format.h>

#include <stdexcept>

#include "depthservo/observation/words.h"
#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/tracking/BoardTracker.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/tracking/KltTracker.h"
#include "depthservo/tracking/TaughtTracker.h"
#include "text/Names.h"

namespace depthservo {
namespace {

[[noreturn]] void refuse(const ObservedSource& source, const std::string& message) {
  throw InputError({source.place, 0, ""}, message);
}

bool hasDots(const SequenceTarget& seen) {
  constexpr std::size_t kPattern = 4;  // dots that can be told apart
  return !seen.hasCorners() && (!seen.dots.empty() || seen.target.points.size() >= kPattern);
}

const std::vector<detail::Choice<TrackerKind>>& trackerWords() {
  static const std::vector<detail::Choice<TrackerKind>> all = {
      {TrackerKind::dots, "dots"},
      {TrackerKind::apriltag, "apriltag"},
      {TrackerKind::chessboard, "chessboard"},
      {TrackerKind::charuco, "charuco"},
      {TrackerKind::klt, "klt"},
      {TrackerKind::tracks, "tracks"},
      {TrackerKind::automatic, "auto"}};
  return all;
}

}  // namespace

TrackerKind trackerOf(const BoardTarget& board) {
  return board.markers ? TrackerKind::charuco : TrackerKind::chessboard;
}

bool isOfBoard(TrackerKind tracker) {
  return tracker == TrackerKind::chessboard || tracker == TrackerKind::charuco;
}

const char* toString(TrackerKind tracker) { return detail::wordOf(trackerWords(), tracker); }

TrackerKind trackerNamed(const std::string& name, const InputError::Place& place) {
  if (const auto kind = detail::valueOf(trackerWords(), name)) return *kind;
  throw InputError(place, detail::unknownWord(name, detail::wordsOf(trackerWords())));
}

TrackerKind chooseTracker(const ObservedSource& source, TrackerKind wanted) {
  const SequenceTarget& seen = source.target;
  if (wanted == TrackerKind::automatic) {
    wanted = !source.hasImages ? TrackerKind::tracks
             : seen.tags       ? TrackerKind::apriltag
             : seen.board      ? trackerOf(*seen.board)
             : hasDots(seen)   ? TrackerKind::dots
                               : TrackerKind::klt;
  }
  if (wanted == TrackerKind::tracks) {
    if (source.ids.empty()) {
      refuse(source, source.hasImages
                         ? "no tracks.csv: --tracker tracks is for points measured elsewhere"
                         : "no tracks.csv and no images: there are no points to observe");
    }
    return wanted;
  }
  if (!source.hasImages) {
    refuse(source, fmt::format("--tracker {} needs images (rgb.txt)", toString(wanted)));
  }
  if (wanted == TrackerKind::dots && !hasDots(seen)) {
    refuse(source,
           "no dots to track: give their start positions as 'dots: [[u, v], ...]' or a 'target' of "
           "at least four points in sequence.yaml (live: --target FILE); natural corners need "
           "neither: --tracker klt");
  }
  if (isOfBoard(wanted) && (!seen.board || trackerOf(*seen.board) != wanted)) {
    refuse(source, fmt::format("no board to track: give it as 'target: {{type: {}, columns: ..., "
                               "rows: ..., ...}}' in sequence.yaml, or --target FILE",
                               toString(wanted)));
  }
  return wanted;
}

bool measuresNoise(TrackerKind tracker) {
  return tracker == TrackerKind::apriltag || tracker == TrackerKind::klt || isOfBoard(tracker);
}

bool findsPoints(const SequenceTarget& seen, TrackerKind tracker) {
  return (tracker == TrackerKind::klt && !seen.taught) ||
         (tracker == TrackerKind::apriltag && !seen.tags);
}

AprilTagTarget tagsOf(const SequenceTarget& seen, const ObservationOptions& options) {
  if (seen.tags) return *seen.tags;
  AprilTagTarget all{options.tagFamily, {}};
  for (int id = 0; id < aprilTagCount(options.tagFamily); ++id) {
    all.tags.push_back({id, {}, Eigen::Isometry3d::Identity()});
  }
  return all;
}

std::unique_ptr<PointTracker> makeTracker(const SequenceTarget& seen, TrackerKind tracker,
                                          const ObservationOptions& options) try {
  if (tracker == TrackerKind::tracks) return nullptr;
  if (tracker == TrackerKind::klt && seen.taught) {
    return std::make_unique<TaughtTracker>(*seen.taught);
  }
  if (tracker == TrackerKind::klt) {
    KltTrackerOptions klt;
    klt.points = options.corners;
    return std::make_unique<KltTracker>(klt);
  }
  if (tracker == TrackerKind::apriltag) {
    return std::make_unique<AprilTagTracker>(tagsOf(seen, options));
  }
  if (isOfBoard(tracker)) return std::make_unique<BoardTracker>(seen.board.value());
  if (seen.dots.empty()) return std::make_unique<DotTracker>(seen.target);
  std::vector<Eigen::Vector2d> starts;
  for (const PixelPoint& dot : seen.dots) starts.emplace_back(dot.u, dot.v);
  return std::make_unique<DotTracker>(starts);
} catch (const std::invalid_argument& why) {
  throw InputError({"target", 0, ""}, why.what());
}

std::vector<int> idsOf(const SequenceTarget& seen, TrackerKind tracker) {
  const std::size_t count = tracker == TrackerKind::klt        ? seen.taught->points.size()
                            : tracker == TrackerKind::apriltag ? 4 * seen.tags->tags.size()
                            : isOfBoard(tracker) ? static_cast<std::size_t>(seen.board->count())
                            : seen.dots.empty()  ? seen.target.points.size()
                                                 : seen.dots.size();
  std::vector<int> ids;
  for (std::size_t i = 0; i < count; ++i) ids.push_back(static_cast<int>(i));
  return ids;
}

}  // namespace depthservo
