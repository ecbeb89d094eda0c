#include "scenario/taughtWalls.h"

#include <filesystem>

#include "depthservo/rig/SimulatedRig.h"
#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

TaughtGoal shown(const Scenario& scenario, SimulatedRig& rig) {
  const std::string& folder = scenario.control.taught;
  if (folder == kTaughtAtStart) {
    DEPTHSERVO_VISP vpImage<unsigned char> image;
    rig.lookFrom(*scenario.robot.goal, image);
    TeachOptions options;
    options.tracker = TrackerKind::klt;
    options.corners = scenario.sensing.corners;
    return teach(image, scenario.camera.pinhole(), {}, options, scenario.file);
  }
  namespace fs = std::filesystem;
  const fs::path beside = fs::path(scenario.file).parent_path() / folder;
  TaughtGoal goal = readGoal(fs::exists(folder) || !fs::exists(beside) ? folder : beside.string());
  if (goal.tracker != TrackerKind::klt) {
    throw InputError({folder, 0, ""}, "is not a goal of natural corners (teach --tracker klt)");
  }
  return goal;
}

/// Those of the points that are on a wall, and where.
std::vector<Eigen::Vector3d> keepThoseOnWalls(TaughtGoal& goal, const RobotPose& pose,
                                              const SimulatedRig& rig) {
  std::vector<Eigen::Vector2d> pixels;
  for (const TrackedPoint& point : goal.points) pixels.emplace_back(point.u, point.v);
  const auto seen = rig.seenFrom(pose, pixels);
  std::vector<Eigen::Vector3d> places;
  TaughtGoal kept = goal;
  kept.points.clear();
  kept.Z.clear();
  for (std::size_t i = 0; i < seen.size() && places.size() < kMostTargetPoints; ++i) {
    if (!seen[i]) continue;
    kept.points.push_back(goal.points[i]);
    kept.points.back().id = static_cast<int>(places.size());
    if (!goal.Z.empty()) kept.Z.push_back(goal.Z[i]);
    places.push_back(*seen[i]);
  }
  goal = std::move(kept);
  return places;
}

}  // namespace

TaughtWalls teachWalls(const Scenario& scenario) {
  if (!scenario.robot.goal) {
    throw InputError({scenario.file, 0, "robot.goal"}, "a wall is seen as desired from a pose");
  }
  SimulatedRig rig(scenario, scenario.file);
  TaughtWalls walls{scenario, shown(scenario, rig)};
  keepThoseOnWalls(walls.goal, *scenario.robot.goal, rig);
  DEPTHSERVO_VISP vpImage<unsigned char> start;
  rig.lookFrom(scenario.robot.initial, start);
  std::string news;
  const auto seen = walls.goal.seenIn(start, news);
  if (!seen) {
    throw InputError({scenario.file, 0, "robot.initial"},
                     "the image taught at the goal is not found from there: " + news);
  }
  walls.goal = *seen;
  walls.rig.target.points = keepThoseOnWalls(walls.goal, *scenario.robot.goal, rig);
  return walls;
}

}  // namespace depthservo
