#include "sequence/sequenceSettings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "sequence/rowMeanings.h"

namespace depthservo {
namespace {

using detail::Range;
using detail::StrictMapping;

/// "xyz" [m] and "quaternion" [qx, qy, qz, qw]; the identity where they are missing.
Eigen::Isometry3d poseIn(const StrictMapping& read) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (read.has("xyz")) {
    const std::vector<double> p = read.numbers("xyz", 3, {-100, 100}, "m");
    pose.translation() = Eigen::Vector3d(p[0], p[1], p[2]);
  }
  if (read.has("quaternion")) {
    const std::vector<double> q = read.numbers("quaternion", 4, {-1.1, 1.1}, "");
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (!(std::abs(rotation.norm() - 1) < 0.02)) {
      read.fail("quaternion",
                fmt::format("[qx, qy, qz, qw] has the norm {}, expected 1", rotation.norm()));
    }
    pose.linear() = rotation.normalized().toRotationMatrix();
  }
  return pose;
}

/// "tags" of a target: family, and a list of {id, size, xyz, quaternion}.
AprilTagTarget readTags(const StrictMapping& target) {
  AprilTagTarget tags;
  if (target.has("family")) tags.family = target.text("family");
  const std::vector<std::string> families = aprilTagFamilies();
  if (std::find(families.begin(), families.end(), tags.family) == families.end()) {
    target.fail("family",
                fmt::format("there is no AprilTag family {}; the nearest is '{}'",
                            detail::quoted(tags.family), nearestWord(tags.family, families)));
  }
  const int count = aprilTagCount(tags.family);
  std::set<int> ids;
  for (const detail::YamlValue& item : target.list("tags").items) {
    const StrictMapping read(item, target.file(), target.pathOf("tags"),
                             {"id", "size", "xyz", "quaternion"});
    AprilTagTarget::Tag tag;
    tag.id = static_cast<int>(read.integer("id", {0, count - 1.0}, ""));
    if (!ids.insert(tag.id).second) read.fail("id", fmt::format("tag {} is there twice", tag.id));
    if (read.has("size")) tag.size = read.number("size", Range::above(0, 10), "m");
    tag.oMt = poseIn(read);
    tags.tags.push_back(tag);
  }
  if (tags.tags.empty()) target.fail("tags", "expected at least 1 tag");
  return tags;
}

/// `columns`, `rows`, `square` and, of a ChArUco board, `marker` and `dictionary`.
BoardTarget readBoard(const StrictMapping& target, bool hasMarkers) {
  constexpr Range kCorners{BoardTarget::kLeast, BoardTarget::kMost};
  const Range length = Range::above(0, 10);
  BoardTarget board;
  board.columns = static_cast<int>(target.integer("columns", kCorners, ""));
  board.rows = static_cast<int>(target.integer("rows", kCorners, ""));
  if (hasMarkers || target.has("square")) board.square = target.number("square", length, "m");
  if (hasMarkers) {
    BoardTarget::Markers& markers = board.markers.emplace();
    markers.size = target.number("marker", length, "m");
    if (target.has("dictionary")) markers.dictionary = target.text("dictionary");
    const std::vector<std::string> known = arucoDictionaries();
    if (std::find(known.begin(), known.end(), markers.dictionary) == known.end()) {
      target.fail("dictionary", fmt::format("there is no ArUco dictionary {}; the nearest is '{}'",
                                            detail::quoted(markers.dictionary),
                                            nearestWord(markers.dictionary, known)));
    }
  }
  const std::string why = board.objection();
  if (!why.empty()) target.fail("columns", why);
  return board;
}

/// Which keys are for which types of targets.
struct TargetType {
  const char* name;
  std::vector<const char*> keys;
};

const std::vector<TargetType>& targetTypes() {
  static const std::vector<TargetType> all = {
      {"dots", {"points", "radius"}},
      {"apriltag", {"family", "tags"}},
      {"chessboard", {"columns", "rows", "square"}},
      {"charuco", {"columns", "rows", "square", "marker", "dictionary"}}};
  return all;
}

/// Refuses what is not for its type; the types of a key are named.
std::string typeOf(const StrictMapping& target) {
  const std::string type = target.has("type") ? target.text("type") : "dots";
  const auto& all = targetTypes();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const TargetType& t) { return type == t.name; });
  if (found == all.end()) target.fail("type", "expected dots, apriltag, chessboard or charuco");
  for (const TargetType& other : all) {
    for (const std::string key : other.keys) {
      const bool isAllowed =
          std::find(found->keys.begin(), found->keys.end(), key) != found->keys.end();
      if (!isAllowed && target.has(key)) {
        target.fail(key, fmt::format("is for type: {}", other.name));
      }
    }
  }
  return type;
}

void readTarget(const StrictMapping& settings, SequenceTarget& seen) {
  const StrictMapping target =
      settings.mapping("target", {"type", "points", "radius", "family", "tags", "columns", "rows",
                                  "square", "marker", "dictionary"});
  const std::string type = typeOf(target);
  if (type == "apriltag") {
    seen.tags = readTags(target);
    if (seen.tags->hasSizes()) seen.target.points = seen.tags->corners();
  } else if (type == "dots") {
    for (const auto& point : target.rows("points", 3, {-100, 100}, "m")) {
      seen.target.points.emplace_back(point[0], point[1], point[2]);
    }
    if (seen.target.points.empty()) target.fail("points", "expected at least 1 point");
    if (target.has("radius")) seen.target.radius = target.number("radius", {0, 10}, "m");
  } else {
    seen.board = readBoard(target, type == "charuco");
    if (seen.board->square) seen.target.points = seen.board->corners();
  }
}

constexpr Range kDotPixels{-1e6, 1e6};  // px

}  // namespace

namespace detail {

const std::vector<std::string>& settingsKeys() {
  static const std::vector<std::string> keys = {"name",   "depth_scale", "rows",       "target",
                                                "dots",   "images",      "image_bits", "taught",
                                                "replay", "hand_eye"};
  return keys;
}

Eigen::Isometry3d handEyeIn(const std::string& file) {
  const YamlValue root = loadYaml(file);
  const StrictMapping settings(root, file, "", settingsKeys());
  if (!settings.has("hand_eye")) return Eigen::Isometry3d::Identity();
  return poseIn(settings.mapping("hand_eye", {"xyz", "quaternion"}));
}

SequenceTarget targetOf(const StrictMapping& settings) {
  SequenceTarget seen;
  if (settings.has("target")) readTarget(settings, seen);
  if (settings.has("dots")) {
    for (const auto& dot : settings.rows("dots", 2, kDotPixels, "px")) {
      seen.dots.push_back({static_cast<int>(seen.dots.size()), dot[0], dot[1]});
    }
    if (!seen.target.points.empty() && seen.dots.size() != seen.target.points.size()) {
      settings.fail("dots", fmt::format("expected one for each of the {} points of the target, got "
                                        "{}",
                                        seen.target.points.size(), seen.dots.size()));
    }
  }
  if (settings.has("replay")) {
    seen.replay = {settings.file(), std::make_shared<const YamlValue>(settings.value("replay"))};
  }
  if (settings.has("rows")) {
    const std::string word = settings.text("rows");
    const auto& words = rowMeanings();
    seen.rows = valueOf(words, word);
    if (!seen.rows) settings.fail("rows", unknownWord(word, wordsOf(words)));
  }
  return seen;
}

}  // namespace detail

SequenceTarget readTarget(const std::string& path) {
  const detail::YamlValue root = detail::loadYaml(path);
  const StrictMapping settings(root, path, "", detail::settingsKeys());
  SequenceTarget seen = detail::targetOf(settings);
  if (seen.target.points.empty() && seen.dots.empty() && !seen.hasCorners()) {
    settings.fail("target",
                  "missing: expected target: {type: dots, points: [...]}, or dots: [...]");
  }
  return seen;
}

}  // namespace depthservo
