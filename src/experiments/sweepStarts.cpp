#include "experiments/sweepStarts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "depthservo/text/InputError.h"
#include "experiments/Draws.h"
#include "robots/makeRobot.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

const std::vector<std::pair<const char*, double SweepStart::*>> kStartKeys = {
    {"start.distance", &SweepStart::distance},
    {"start.bearing", &SweepStart::bearing},
    {"start.elevation", &SweepStart::elevation},
    {"start.aim", &SweepStart::aim},
    {"start.roll", &SweepStart::roll}};

Eigen::Isometry3d turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis));
}

Eigen::Vector3d middleOf(const TargetOptions& target) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : target.points) middle += point;
  return middle / static_cast<double>(target.points.size());
}

RobotPose freePoseAt(const Scenario& scenario, const SweepStart& s) {
  using Eigen::Vector3d;
  Eigen::Isometry3d oMc(Eigen::Translation3d(middleOf(scenario.target)));
  // Object frame: x right, y down, z away from whoever looks at the front.
  oMc = oMc * turned(-s.bearing, Vector3d::UnitY()) * turned(-s.elevation, Vector3d::UnitX()) *
        Eigen::Translation3d(0, 0, -s.distance) * turned(-s.aim, Vector3d::UnitY()) *
        turned(s.roll, Vector3d::UnitZ());
  const Eigen::Isometry3d wMc = scenario.target.pose.isometry() * oMc;
  RobotPose pose = scenario.robot.initial;
  pose.camera = RpyPose::of(wMc);
  return pose;
}

RobotPose floorPoseAt(const Scenario& scenario, const SweepStart& s) {
  const Eigen::Isometry3d wMo = scenario.target.pose.isometry();
  RobotPose pose = scenario.robot.initial;
  pose.x = pose.y = pose.theta = 0;
  const Eigen::Isometry3d rMc = makeRobot(scenario.robot, pose)->wMc();
  const Eigen::Vector2d front = -wMo.linear().col(2).head<2>(),
                        axis = rMc.linear().col(2).head<2>();
  constexpr double kLeast = 0.1;  // of the front and the optical axis on the floor
  if (front.norm() < kLeast || axis.norm() < kLeast) {
    throw InputError({scenario.file, 0, "start"},
                     "the target or the camera does not look along the floor");
  }
  const double direction = std::atan2(front.y(), front.x()) + s.bearing;
  const double optical = direction + M_PI + s.aim;
  const double heading = optical - std::atan2(axis.y(), axis.x());
  const Eigen::Vector2d camera =
      (wMo * middleOf(scenario.target)).head<2>() +
      s.distance * Eigen::Vector2d(std::cos(direction), std::sin(direction));
  const Eigen::Vector2d robot =
      camera - Eigen::Rotation2Dd(heading) * Eigen::Vector2d(rMc.translation().head<2>());
  pose.x = robot.x();
  pose.y = robot.y();
  pose.theta = std::remainder(heading, 2 * M_PI);
  return pose;
}

/// To nine digits, as it stands in a setting.
double rounded(double value) { return *detail::toNumber(fmt::format("{:.9g}", value)); }

}  // namespace

const std::vector<std::string>& sweepStartKeys() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> keys;
    for (const auto& [key, member] : kStartKeys) keys.emplace_back(key);
    return keys;
  }();
  return all;
}

std::optional<SweepStart> takeStart(std::vector<std::string>& settings, const std::string& file) {
  std::optional<SweepStart> start;
  const auto take = [&](const std::string& setting) {
    if (setting.rfind("start.", 0) != 0) return false;
    const std::size_t equals = std::min(setting.find('='), setting.size());
    const std::string key = setting.substr(0, equals);
    const auto found = std::find_if(kStartKeys.begin(), kStartKeys.end(),
                                    [&](const auto& known) { return key == known.first; });
    if (found == kStartKeys.end()) {
      throw InputError({file, 0, key}, "unknown key; the nearest valid key is '" +
                                           nearestWord(key, sweepStartKeys()) + "'");
    }
    const auto value =
        detail::toNumber(equals < setting.size() ? setting.substr(equals + 1) : std::string());
    const bool isDistance = found->second == &SweepStart::distance;
    const detail::Range range =
        isDistance ? detail::Range::above(0, 1000) : detail::Range{-M_PI, M_PI};
    if (!value || !range.contains(*value)) {
      throw InputError({file, 0, key}, detail::expectedNumber(range, isDistance ? "m" : "rad",
                                                              setting.substr(equals)));
    }
    if (!start) start.emplace();
    (*start).*(found->second) = *value;
    return true;
  };
  settings.erase(std::remove_if(settings.begin(), settings.end(), take), settings.end());
  return start;
}

std::vector<std::string> settingsOf(const SweepStart& start) {
  std::vector<std::string> settings;
  for (const auto& [key, member] : kStartKeys) {
    settings.push_back(fmt::format("{}={}", key, start.*member));
  }
  return settings;
}

RobotPose poseAt(const Scenario& scenario, const SweepStart& start) {
  const auto refuse = [&](const char* key, const char* why) {
    throw InputError({scenario.file, 0, key}, why);
  };
  if (!(start.distance > 0)) refuse("start.distance", "must be given with the other start keys");
  if (scenario.target.points.empty()) refuse("start.distance", "the target has no points");
  if (scenario.robot.type == RobotKind::free) return freePoseAt(scenario, start);
  if (start.elevation != 0) refuse("start.elevation", "this robot stands on the floor");
  if (start.roll != 0) refuse("start.roll", "this robot stands on the floor");
  return floorPoseAt(scenario, start);
}

bool seesTarget(const Scenario& scenario, const RobotPose& pose, double margin_px) {
  const PinholeCamera camera = scenario.camera.pinhole();
  const Eigen::Isometry3d cMo =
      makeRobot(scenario.robot, pose)->wMc().inverse() * scenario.target.pose.isometry();
  return std::all_of(scenario.target.points.begin(), scenario.target.points.end(),
                     [&](const auto& point) {
                       const Eigen::Vector3d p = cMo * point;
                       if (!(p.z() > scenario.depth.Z_min)) return false;
                       const Eigen::Vector2d pixel = camera.toPixel(p.x() / p.z(), p.y() / p.z());
                       return pixel.x() > margin_px && pixel.x() < camera.width - 1 - margin_px &&
                              pixel.y() > margin_px && pixel.y() < camera.height - 1 - margin_px;
                     });
}

std::optional<SweepStart> drawStart(const Scenario& scenario, const SweepCone& cone,
                                    const std::string& text) {
  constexpr int kMostTries = 2000;
  const bool isFree = scenario.robot.type == RobotKind::free;
  Draws draws(text);
  for (int i = 0; i < kMostTries; ++i) {
    SweepStart start;
    start.distance = rounded(draws.uniform(cone.distance[0], cone.distance[1]));
    if (isFree) {
      // Evenly over the sphere: the height on its axis is even.
      const double off = std::acos(draws.uniform(std::cos(cone.angle), 1));
      const double around = draws.uniform(-M_PI, M_PI);
      start.bearing = rounded(off * std::cos(around));
      start.elevation = rounded(off * std::sin(around));
      start.roll = rounded(draws.uniform(-cone.roll, cone.roll));
    } else {
      start.bearing = rounded(draws.uniform(-cone.angle, cone.angle));
    }
    start.aim = rounded(draws.uniform(-cone.aim, cone.aim));
    if (seesTarget(scenario, poseAt(scenario, start), cone.margin)) return start;
  }
  return std::nullopt;
}

}  // namespace depthservo
