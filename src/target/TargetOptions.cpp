#include "depthservo/target/TargetOptions.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace depthservo {
namespace {

using Refuse = std::function<void(const std::string& key, const std::string& why)>;

void checkTags(const TargetOptions& target, const Refuse& refuse) {
  if (target.points != target.trueTags().corners()) {
    refuse("points", "is for dots; a tag's points are its corners");
  }
  const std::size_t most = kMostTargetPoints / 4;
  if (target.tags.empty() || target.tags.size() > most) {
    refuse("tags", fmt::format("expected 1 to {} tags, got {}", most, target.tags.size()));
  }
  const int count = aprilTagCount(target.family);
  for (std::size_t i = 0; i < target.tags.size(); ++i) {
    const int id = target.tags[i].id;
    if (id >= count) {
      refuse("tags", fmt::format("the family {} has the ids 0 to {}, not {}", target.family,
                                 count - 1, id));
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (target.tags[j].id == id) refuse("tags", fmt::format("tag {} is there twice", id));
    }
  }
}

void checkBoard(const TargetOptions& target, const Refuse& refuse) {
  const BoardTarget board = target.boardTarget();
  const std::string why = board.objection();
  if (!why.empty()) refuse("columns", why);
  if (target.points != board.corners()) {
    refuse("points", "is for dots; a board's points are its corners");
  }
}

}  // namespace

AprilTagTarget TargetOptions::trueTags() const {
  AprilTagTarget target{family, {}};
  for (const TagOptions& tag : tags) target.tags.push_back({tag.id, tag.size, tag.pose.isometry()});
  return target;
}

bool TargetOptions::hasBoard() const {
  return type == TargetKind::chessboard || type == TargetKind::charuco;
}

BoardTarget TargetOptions::boardTarget() const {
  BoardTarget target{board.columns, board.rows, board.square, {}};
  if (type == TargetKind::charuco) target.markers = {board.dictionary, board.marker};
  return target;
}

std::vector<GrayPatch> TargetOptions::patches() const {
  if (type == TargetKind::apriltag) return trueTags().patches();
  if (hasBoard()) return boardTarget().patches();
  std::vector<GrayPatch> all;
  for (const WallOptions& wall : walls) {
    const auto cells = [&](double side) { return static_cast<int>(std::ceil(side / wall.cell)); };
    all.push_back(GrayPatch::random(wall.width, wall.height, cells(wall.width),
                                        cells(wall.height), wall.seed));
    all.back().oMp = wall.pose.isometry();
  }
  return all;
}

std::vector<Eigen::Vector3d> TargetOptions::ownPoints() const {
  if (type == TargetKind::apriltag) return trueTags().corners();
  if (hasBoard()) return boardTarget().corners();
  std::vector<Eigen::Vector3d> own;
  for (const WallOptions& wall : walls) {
    for (const auto& [x, y] :
         {std::pair(-1, 1), std::pair(1, 1), std::pair(1, -1), std::pair(-1, -1)}) {
      own.push_back(wall.pose.isometry() *
                       Eigen::Vector3d(x * wall.width / 4, y * wall.height / 4, 0));
    }
  }
  return own;
}

AprilTagTarget TargetOptions::assumedTags() const {
  AprilTagTarget target{family, {}};
  for (const TagOptions& tag : tags) {
    target.tags.push_back({tag.id, tag.assumed_size, tag.pose.isometry()});
  }
  return target;
}

DotTarget TargetOptions::dots() const {
  if (type == TargetKind::dots) return {points, radius};
  if (hasBoard()) return {boardTarget().corners(), 0};
  if (type == TargetKind::wall) return {};
  const AprilTagTarget known = assumedTags();
  return {known.hasSizes() ? known.corners() : std::vector<Eigen::Vector3d>(), 0};
}

void check(const TargetOptions& target, const Refuse& refuse) {
  constexpr double kMostCells = 1e6;
  if (target.type == TargetKind::wall && (target.walls.empty() || target.walls.size() > 16)) {
    refuse("walls", fmt::format("expected 1 to 16 walls, got {}", target.walls.size()));
  }
  for (const WallOptions& wall : target.walls) {
    if (wall.width * wall.height / (wall.cell * wall.cell) <= kMostCells) continue;
    refuse("walls", "has more than a million cells; make them larger");
  }
  if (target.type == TargetKind::apriltag) checkTags(target, refuse);
  if (target.hasBoard()) checkBoard(target, refuse);
  const auto& points = target.points;
  if (points.empty() || points.size() > kMostTargetPoints) {
    refuse("points",
           fmt::format("expected 1 to {} points, got {}", kMostTargetPoints, points.size()));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (points[i] == points[j]) {
        refuse("points", fmt::format("points {} and {} are the same; remove one", j, i));
      }
    }
  }
  const std::string why = objection(target.twist, 6);
  if (!why.empty()) refuse("twist", why);
}

}  // namespace depthservo
