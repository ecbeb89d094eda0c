#include "depthservo/servo/TaughtGoal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/tracking/AprilTagTracker.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/tracking/TargetPose.h"
#include "depthservo/tracking/TaughtTracker.h"
#include "depthservo/visp/using.h"
#include "observation/makeTracker.h"
#include "tracking/DotDetector.h"
#include "tracking/lastingCorners.h"

namespace depthservo {
namespace {

using Image = vpImage<unsigned char>;

constexpr std::size_t kLeastPoints = 3, kLeastCorners = 8;
constexpr std::size_t kMostDots = 64;
constexpr double kLeastDot_px = 2;  // semi-axis: smaller ones are specks

TrackerKind trackerOf(const SequenceTarget& target, TrackerKind wanted) {
  if (wanted != TrackerKind::automatic) return wanted;
  if (target.tags) return TrackerKind::apriltag;
  if (target.board) return trackerOf(*target.board);
  return target.target.points.empty() && target.dots.empty() ? TrackerKind::klt : TrackerKind::dots;
}

/// Every round dot of an image that shows nothing else that is round.
std::vector<Eigen::Vector2d> dotsIn(const Image& image) {
  detail::DotLimits limits;
  limits.least_radius_px = kLeastDot_px;
  const detail::Box all{0, 0, static_cast<int>(image.getWidth()) - 1,
                        static_cast<int>(image.getHeight()) - 1};
  std::vector<Eigen::Vector2d> centres;
  for (const auto& dot : detail::dotsAtAnyLevel(image, all, limits)) {
    centres.push_back(dot.ellipse.centre);
  }
  return centres;
}

/// The tags in the image, of unknown size.
AprilTagTarget tagsIn(const Image& image, const std::string& family) {
  AprilTagTracker all(family);
  AprilTagTarget tags{family, {}};
  for (const TrackedPoint& corner : all.track(image, {})) {
    if (corner.id % 4 == 0) tags.tags.push_back({corner.id / 4, {}, Eigen::Isometry3d::Identity()});
  }
  return tags;
}

/// What was found, one point at least for each of the target's.
void requireAll(const TaughtGoal& goal, std::size_t expected, const std::string& place) {
  const bool hasCorners = goal.tracker == TrackerKind::klt;
  const std::size_t found = goal.points.size();
  const std::size_t needed = hasCorners ? kLeastCorners : std::max(expected, kLeastPoints);
  if (found >= needed) return;
  const char* what = goal.tracker == TrackerKind::dots       ? "dots"
                     : goal.tracker == TrackerKind::apriltag ? "corners of tags"
                     : isOfBoard(goal.tracker)               ? "corners of the board"
                                                             : "natural corners";
  throw InputError({place, 0, ""},
                   fmt::format("{} of {} {} found in the image; show them whole, in good light, or "
                               "choose another --tracker or --target",
                               found, needed, what));
}

/// Depths by the pose of a target whose size is known.
std::vector<double> depthsByPose(const TaughtGoal& goal) {
  const std::vector<Eigen::Vector3d>& points = goal.target.target.points;
  if (points.size() != goal.points.size() || points.size() < 4) return {};
  const auto pose = TargetPose(goal.target.target, goal.camera).compute(goal.points);
  if (!pose) return {};
  std::vector<double> Z;
  for (const Eigen::Vector3d& point : points) Z.push_back((pose->cMo * point).z());
  return Z;
}

void findPoints(TaughtGoal& goal, const TeachOptions& options, const std::string& place) {
  if (goal.tracker == TrackerKind::klt) {
    goal.points = detail::lastingCorners(goal.image, static_cast<std::size_t>(options.corners));
    return requireAll(goal, 0, place);
  }
  if (goal.tracker == TrackerKind::apriltag && !goal.target.tags) {
    goal.target.tags = tagsIn(goal.image, options.tagFamily);
    if (goal.target.tags->tags.empty()) requireAll(goal, 4, place);
  }
  if (goal.tracker == TrackerKind::dots && goal.target.target.points.empty()) {
    goal.target.dots.clear();
    const auto centres = dotsIn(goal.image);
    if (centres.size() < 4 || centres.size() > kMostDots) {
      throw InputError({place, 0, ""},
                       fmt::format("{} round dots found in the image, expected 4 to {}; show the "
                                   "plate alone, or name its dots by --target",
                                   centres.size(), kMostDots));
    }
    for (const Eigen::Vector2d& c : centres) {
      goal.target.dots.push_back({static_cast<int>(goal.target.dots.size()), c.x(), c.y()});
    }
  }
  if (isOfBoard(goal.tracker) &&
      (!goal.target.board || trackerOf(*goal.target.board) != goal.tracker)) {
    throw InputError({place, 0, ""}, fmt::format("--tracker {0} needs a --target of type: {0}",
                                                 toString(goal.tracker)));
  }
  const auto ids = idsOf(goal.target, goal.tracker);
  goal.points = makeTracker(goal.target, goal.tracker, {})->track(goal.image, {});
  requireAll(goal, ids.size(), place);
}

}  // namespace

SequenceTarget TaughtGoal::toFind() const {
  SequenceTarget found = target;
  if (tracker == TrackerKind::klt) {
    auto taught = std::make_shared<TaughtImage>(TaughtImage{image, {}});
    for (const TrackedPoint& point : points) taught->points.emplace_back(point.u, point.v);
    found.taught = std::move(taught);
  }
  if (tracker != TrackerKind::dots) return found;
  found.dots.clear();
  if (!found.target.points.empty()) return found;
  for (const TrackedPoint& point : points) {
    const Eigen::Vector2d s = camera.normalise(point.u, point.v);
    found.target.points.emplace_back(s.x(), s.y(), 0);
  }
  return found;
}

std::optional<TaughtGoal> TaughtGoal::seenIn(const Image& from, std::string& news) const {
  if (tracker != TrackerKind::klt) return *this;
  constexpr double kSure_px = 1;
  TaughtTrackerOptions strict;
  strict.similarity = 0.87;  // with a margin to what it takes to follow them
  TaughtGoal seen = *this;
  for (bool isComplete = false;
       !isComplete;) {  // those that remain must be found without the others
    if (seen.points.size() < kLeastCorners) return std::nullopt;
    TaughtTracker search(*seen.toFind().taught, strict);
    TaughtGoal fewer = seen;
    fewer.points.clear();
    fewer.Z.clear();
    for (const TrackedPoint& found : search.track(from, {})) {
      if (found.sigma_px > kSure_px) continue;
      const auto i = static_cast<std::size_t>(found.id);
      fewer.points.push_back(seen.points[i]);
      fewer.points.back().id = static_cast<int>(fewer.points.size()) - 1;
      if (!seen.Z.empty()) fewer.Z.push_back(seen.Z[i]);
    }
    if (seen.points.size() == points.size()) news = search.news();
    isComplete = fewer.points.size() == seen.points.size();
    seen = std::move(fewer);
  }
  return seen;
}

ServoGoal TaughtGoal::servoGoal(double otherwise) const {
  ServoGoal goal;
  for (const TrackedPoint& point : points) goal.pixels.emplace_back(point.u, point.v);
  goal.Z = Z.empty() ? std::vector<double>(points.size(), otherwise) : Z;
  return goal;
}

TaughtGoal teach(const Image& image, const PinholeCamera& camera, const SequenceTarget& target,
                 const TeachOptions& options, const std::string& place) {
  if (static_cast<int>(image.getWidth()) != camera.width ||
      static_cast<int>(image.getHeight()) != camera.height) {
    throw InputError({place, 0, ""},
                     fmt::format("the camera has {}x{} pixels, the image has {}x{}", camera.width,
                                 camera.height, image.getWidth(), image.getHeight()));
  }
  TaughtGoal goal;
  goal.camera = camera;
  goal.image = image;
  goal.target = target;
  goal.target.replay = {};
  if (goal.target.target.points.size() >= 4) goal.target.dots.clear();
  goal.tracker = trackerOf(target, options.tracker);
  if (goal.tracker == TrackerKind::klt) goal.target = {};
  findPoints(goal, options, place);
  goal.Z =
      options.depth ? std::vector<double>(goal.points.size(), *options.depth) : depthsByPose(goal);
  return goal;
}

void writeGoal(const TaughtGoal& goal, const std::string& folder) {
  SequenceWriter writer(folder);
  constexpr double kTime_s = 0;
  writer.addImage(kTime_s, goal.image);
  for (const TrackedPoint& point : goal.points) {
    writer.addTrack(kTime_s, {point.id, point.u, point.v});
  }
  for (std::size_t i = 0; i < goal.Z.size(); ++i) {
    writer.addTruth(kTime_s, {goal.points[i].id, goal.Z[i]});
  }
  SequenceSettings settings{"goal", goal.camera, goal.target.target, goal.target.dots, ""};
  settings.tags = goal.target.tags;
  settings.board = goal.target.board;
  writer.finish(settings);
}

TaughtGoal readGoal(const std::string& folder) {
  const Sequence sequence(folder);
  const auto refuse = [&](const std::string& why) {
    throw InputError({folder, 0, ""}, why + "; is it a goal that depthservo teach wrote?");
  };
  if (sequence.frames().size() != 1 || !sequence.hasImages())
    refuse("is not a sequence of one image");
  const SequenceFrame& frame = sequence.frames()[0];
  TaughtGoal goal;
  goal.camera = sequence.camera();
  goal.image = sequence.readImage(0);
  goal.target = sequence.seen();
  goal.tracker = trackerOf(goal.target, TrackerKind::automatic);
  for (const PixelPoint& point : frame.tracks) {
    if (point.id != static_cast<int>(goal.points.size())) refuse("its points are not 0, 1, ...");
    goal.points.push_back({point.id, point.u, point.v, 0});
  }
  const std::size_t expected = goal.tracker == TrackerKind::klt  // as many as were found
                                   ? std::max(kLeastCorners, goal.points.size())
                                   : idsOf(goal.target, goal.tracker).size();
  if (goal.points.size() != expected) {
    refuse(fmt::format("has {} points, expected {}", goal.points.size(), expected));
  }
  for (const TrueDepth& depth : frame.truth) goal.Z.push_back(depth.Z);
  if (!goal.Z.empty() && goal.Z.size() != goal.points.size()) refuse("not every point has a depth");
  return goal;
}

}  // namespace depthservo
