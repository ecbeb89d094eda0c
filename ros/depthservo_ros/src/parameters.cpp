#include "parameters.h"

#include <depthservo/motion/RpyPose.h>
#include <depthservo/observation/words.h>
#include <depthservo/text/InputError.h>
#include <tf2_ros/transform_listener.h>

#include <initializer_list>
#include <utility>
#include <vector>

namespace depthservo_ros {
namespace {

using namespace depthservo;
using Handle = ros::NodeHandle;

[[noreturn]] void refuse(const Handle& from, const std::string& key, const std::string& message) {
  throw InputError({from.getNamespace(), 0, key}, message);
}

/// A value of another type than expected is an error, not a default.
template <class Value>
bool read(const Handle& from, const std::string& key, Value& value) {
  if (!from.hasParam(key)) return false;
  if (!from.getParam(key, value)) refuse(from, key, "is of the wrong type");
  return true;
}

void read(const Handle& from, const std::string& key, std::optional<double>& value) {
  double number = 0;
  if (read(from, key, number)) value = number;
}

/// More than zero.
void readSize(const Handle& from, const std::string& key, double& value) {
  if (read(from, key, value) && !(value > 0)) refuse(from, key, "expected a number above 0");
}

std::vector<double> numbers(const Handle& from, const std::string& key, std::size_t count) {
  std::vector<double> values;
  if (read(from, key, values) && values.size() != count) {
    refuse(from, key, "expected " + std::to_string(count) + " numbers");
  }
  return values;
}

InputError::Place placeOf(const Handle& from, const std::string& key) {
  return {from.getNamespace(), 0, key};
}

ObservationOptions observationOptions(const Handle& from) {
  ObservationOptions options;
  std::string word;
  if (read(from, "tracker", word)) options.tracker = trackerNamed(word, placeOf(from, "tracker"));
  if (read(from, "estimator", word)) {
    options.depth.estimator = estimatorNamed(word, placeOf(from, "estimator"));
  }
  if (read(from, "errors", word)) {
    const auto errors = errorKindNamed(word);
    if (!errors) refuse(from, "errors", "there is no profile " + word);
    options.depth.errors = *errors;
  }
  if (read(from, "rows", word)) options.rows = rowMeaningNamed(word, placeOf(from, "rows"));
  readSize(from, "initial", options.depth.initial);
  readSize(from, "Z_min", options.depth.Z_min);
  readSize(from, "Z_max", options.depth.Z_max);
  read(from, "priorSigma_Z", options.priorSigma_Z);
  if (from.hasParam("pixelNoise_px")) {
    readSize(from, "pixelNoise_px", options.pixelNoise_px);
    options.isPixelNoiseGiven = true;
  }
  read(from, "tagFamily", options.tagFamily);
  read(from, "corners", options.corners);
  read(from, "odometryScaleSigma", options.odometryScaleSigma);
  read(from, "focalSigma", options.focalSigma);
  return options;
}

}  // namespace

Eigen::Isometry3d baseFromCamera(const Handle& from) {
  if (const auto pose = numbers(from, "camera_in_base", 6); !pose.empty()) {
    return RpyPose{{pose[0], pose[1], pose[2]}, {pose[3], pose[4], pose[5]}}.isometry();
  }
  std::string base = "base_link", camera = "camera_optical_frame";
  double wait_s = 10;
  read(from, "base_frame", base);
  read(from, "camera_frame", camera);
  read(from, "tf_wait", wait_s);
  tf2_ros::Buffer buffer;
  const tf2_ros::TransformListener listener(buffer);
  try {
    const auto t =
        buffer.lookupTransform(base, camera, ros::Time(0), ros::Duration(wait_s)).transform;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() << t.translation.x, t.translation.y, t.translation.z;
    pose.linear() = Eigen::Quaterniond(t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z)
                        .normalized()
                        .toRotationMatrix();
    return pose;
  } catch (const tf2::TransformException& error) {
    refuse(from, "camera_in_base",
           "tf does not know where " + camera + " is on " + base + " (" + error.what() +
               "); publish it, or give camera_in_base: [x, y, z, roll, pitch, yaw]");
  }
}

RobotNodeOptions nodeOptions(const Handle& from) {
  RobotNodeOptions options;
  options.name = from.getNamespace();
  options.observation = observationOptions(from);
  std::string target;
  if (read(from, "target", target)) options.target = readTarget(target);
  bool isPlayback = false;
  read(from, "playback", isPlayback);
  options.images.isPlayback = isPlayback;
  options.images.most = isPlayback ? 10000 : 1;
  options.patience_s = isPlayback ? 2 : 0.1;
  read(from, "patience", options.patience_s);
  read(from, "rate", options.images.rate);
  read(from, "silence", options.images.silence_s);
  return options;
}

ServoTask servoTask(const Handle& from) {
  using Named = std::pair<const char*, double*>;
  ServoTask task;
  const Handle robot(from, "robot"), limits(from, "robot/limits"), safety(from, "safety"),
      control(from, "control");
  std::string type = "unicycle", law = "vpServo";
  read(robot, "type", type);
  if (type != "unicycle" && type != "omni") refuse(robot, "type", "expected unicycle or omni");
  task.robot.type = type == "omni" ? RobotKind::omni : RobotKind::unicycle;
  if (const auto offset = numbers(robot, "camera_offset", 3); !offset.empty()) {
    task.robot.camera_offset << offset[0], offset[1], offset[2];
  }
  read(robot, "camera_yaw", task.robot.camera_yaw);
  RobotLimits& l = task.robot.limits;
  for (const auto& [key, limit] : std::initializer_list<Named>{{"v", &l.v},
                                                               {"w", &l.w},
                                                               {"dv", &l.dv},
                                                               {"dw", &l.dw},
                                                               {"brake_v", &l.brake_v},
                                                               {"brake_w", &l.brake_w}}) {
    readSize(limits, key, *limit);
  }
  SafetyOptions& s = task.safety;
  for (const auto& [key, age] : std::initializer_list<Named>{{"image_age", &s.image_age},
                                                             {"odometry_age", &s.odometry_age},
                                                             {"track_age", &s.track_age},
                                                             {"contradiction", &s.contradiction},
                                                             {"overrun", &s.overrun},
                                                             {"calm", &s.calm},
                                                             {"give_up", &s.give_up}}) {
    readSize(safety, key, *age);
  }
  readSize(control, "gain", task.control.gain);
  readSize(control, "tolerance", task.control.tolerance);
  readSize(control, "hidden_wait", task.control.hidden_wait);
  if (read(control, "law", law) && law != "vpServo" && law != "task") {
    refuse(control, "law", "expected vpServo or task");
  }
  if (law == "task") task.control.law = Law::task;
  readSize(from, "command_rate", task.rate);
  readSize(from, "ttl", task.ttl);
  check(task.robot,
        [&](const std::string& key, const std::string& message) { refuse(robot, key, message); });
  check(task.control,
        [&](const std::string& key, const std::string& message) { refuse(control, key, message); });
  return task;
}

TeachOptions teachOptions(const Handle& from) {
  TeachOptions options;
  std::string tracker;
  if (read(from, "tracker", tracker)) {
    options.tracker = trackerNamed(tracker, placeOf(from, "tracker"));
  }
  read(from, "tagFamily", options.tagFamily);
  read(from, "teach_depth", options.depth);
  return options;
}

}  // namespace depthservo_ros
