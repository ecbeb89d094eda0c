#include "scenario/keys.h"

namespace depthservo {

using detail::Fields;
using detail::kOptional;
using detail::kRequired;
using detail::Need;

const std::vector<detail::Choice<TargetKind>>& targetWords() {
  static const std::vector<detail::Choice<TargetKind>> all = {
      {TargetKind::dots, "dots"},
      {TargetKind::apriltag, "apriltag"},
      {TargetKind::wall, "wall"},
      {TargetKind::chessboard, "chessboard"},
      {TargetKind::charuco, "charuco"}};
  return all;
}

void describe(Fields& f, const detail::Key& key, VelocityProfile& profile,
              const detail::Range& velocity) {
  f.list(key, profile, [&](Fields& item, VelocitySegment& segment) {
    item.number({"until", "end of this motion, later than that of the one before", kRequired},
                segment.until, ranges::kDuration, "s");
    item.numbersOfAny({"v", "velocities; none: zero"}, segment.v, velocity, "m/s, rad/s");
    item.numbersOfAny({"amplitude", "of a swing on top: v + amplitude sin(omega t + phase)"},
                      segment.amplitude, velocity, "m/s, rad/s");
    item.numbersOfAny({"omega", "angular frequency of the swing"}, segment.omega, {0, 1000},
                      "rad/s");
    item.numbersOfAny({"phase", "of the swing at the start of the run"}, segment.phase,
                      ranges::kAngle, "rad");
  });
}

void describe(Fields& f, RpyPose& pose, const Need& need) {
  f.numbers({"xyz", "position", need}, pose.xyz, ranges::kPosition, "m");
  f.numbers({"rpy", "roll, pitch, yaw", need}, pose.rpy, ranges::kAngle, "rad");
}

namespace {

void describe(Fields& f, TagOptions& tag) {
  f.integer({"id", "of the family, each once", kRequired}, tag.id, {0, 1e6}, "");
  f.number({"size",
            "side of the square between the corners (of the black square; for Standard and Custom "
            "families of the edge between black and white), as it really is",
            kRequired},
           tag.size, ranges::kLength, "m");
  f.number({"assumed_size",
            "what the user believes it is: compared with what the observed depths say, see `tags` "
            "in run.json",
            kOptional, "unknown"},
           tag.assumed_size, ranges::kLength, "m");
  f.section({"pose", "of the tag in the object frame"},
            [&](Fields& pose) { depthservo::describe(pose, tag.pose); });
}

void describe(Fields& f, WallOptions& wall) {
  f.number({"width", "of the wall"}, wall.width, {0.01, 100}, "m");
  f.number({"height", "of the wall"}, wall.height, {0.01, 100}, "m");
  f.number({"cell", "side of its cells, each of a gray level of its own, about"}, wall.cell,
           {0.001, 10}, "m");
  f.integer({"seed", "of the gray levels"}, wall.seed, {0, 4294967295.0}, "");
  f.section({"pose", "of its middle in the object frame"},
            [&](Fields& pose) { depthservo::describe(pose, wall.pose); });
}

void describeBoard(Fields& f, TargetOptions& target) {
  const Need ofBoards = Need::onlyFor(target.hasBoard(), "target.type: chessboard or charuco");
  const Need ofMarkers = Need::onlyFor(target.type == TargetKind::charuco, "target.type: charuco");
  constexpr detail::Range kCorners{BoardTarget::kLeast, BoardTarget::kMost};
  BoardOptions& board = target.board;
  f.integer({"columns",
             "inner corners in a row, one less than squares; columns times rows is at most 64. The "
             "points are these corners, row by row from the upper left, where the square outside "
             "is black; the object frame is in their middle",
             ofBoards},
            board.columns, kCorners, "");
  f.integer({"rows", "inner corners in a column", ofBoards}, board.rows, kCorners, "");
  f.number({"square", "side of a square", ofBoards}, board.square, ranges::kLength, "m");
  f.number({"marker", "side of a marker with its black border, 0.3 to 0.95 of a square", ofMarkers},
           board.marker, ranges::kLength, "m");
  const std::vector<std::string> names = arucoDictionaries();
  std::vector<detail::Choice<std::string>> dictionaries;
  for (const std::string& name : names) dictionaries.push_back({name, name.c_str()});
  f.choice({"dictionary", "of the markers 0, 1, ...; OpenCV's", ofMarkers}, board.dictionary,
           dictionaries);
}

}  // namespace

void describe(Fields& f, TargetOptions& target) {
  f.choice({"type",
            "round dots, AprilTags, textured walls with nothing but natural corners, a chessboard, "
            "or a ChArUco board: a chessboard with ArUco markers in its white squares"},
           target.type, targetWords());
  const bool hasDots = target.type == TargetKind::dots;
  f.rows({"points",
          "1 to 64 centres [x, y, z] in the object frame; the index of a point is its id. The dots "
          "are discs parallel to the xy plane",
          Need::requiredFor(hasDots, "target.type: dots")},
         target.points, {-100, 100}, "m");
  f.number({"radius", "of every dot", Need::onlyFor(hasDots, "target.type: dots")}, target.radius,
           ranges::kLength, "m");
  const std::vector<std::string> names = aprilTagFamilies();
  std::vector<detail::Choice<std::string>> families;
  for (const std::string& name : names) families.push_back({name, name.c_str()});
  const Need ofTags = Need::onlyFor(target.type == TargetKind::apriltag, "target.type: apriltag");
  f.choice({"family", "of the AprilTags", ofTags}, target.family, families);
  f.list({"tags",
          "1 to 16 AprilTags, instead of points and radius. The points are the tags' corners, "
          "bottom left, bottom right, top right, top left; corner j of tag i of this list has the "
          "id 4 i + j",
          ofTags},
         target.tags, [](Fields& item, TagOptions& tag) { describe(item, tag); });
  f.list({"walls", "1 to 16 textured walls",
          Need::onlyFor(target.type == TargetKind::wall, "target.type: wall")},
         target.walls, [](Fields& item, WallOptions& wall) { describe(item, wall); });
  describeBoard(f, target);
  f.section({"pose", "of the object frame in the world"},
            [&](Fields& pose) { describe(pose, target.pose); });
  describe(f,
           {"twist",
            "motions of the target in the object frame (vx, vy, vz, wx, wy, wz), each until a time "
            "of the run; still after the last"},
           target.twist, {-10, 10});
}

}  // namespace depthservo
