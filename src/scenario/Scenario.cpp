#include "depthservo/scenario/Scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "depthservo/depth/DepthGains.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "observation/estimatorWords.h"
#include "robots/makeRobot.h"
#include "text/Fields.h"
#include "text/StrictYaml.h"

namespace depthservo {
namespace {

using detail::Choice;
using detail::Fields;
using detail::Need;
using detail::Range;
using detail::StrictMapping;
using detail::YamlValue;

constexpr Range kAngle{-6.3, 6.3};                  // rad
constexpr Range kPosition{-1000, 1000};             // m
constexpr Range kLength = Range::above(0, 10);      // m
constexpr Range kDuration = Range::above(0, 3600);  // s
constexpr Range kDepth = Range::above(0, 1e6);      // m
constexpr int kMostPoints = 64;

const std::vector<Choice<RobotKind>>& robots() {
  static const std::vector<Choice<RobotKind>> all = {
      {RobotKind::unicycle, "unicycle"},
      {RobotKind::panUnicycle, "pan-unicycle"},
      {RobotKind::omni, "omni"},
      {RobotKind::mobileManipulator, "mobile-manipulator"},
      {RobotKind::free, "free"}};
  return all;
}

const std::vector<Choice<TargetKind>>& targets() {
  static const std::vector<Choice<TargetKind>> all = {{TargetKind::dots, "dots"},
                                                      {TargetKind::apriltag, "apriltag"}};
  return all;
}

const std::vector<Choice<Law>>& laws() {
  static const std::vector<Choice<Law>> all = {{Law::vpServo, "vpServo"},
                                               {Law::task, "task"},
                                               {Law::profile, "profile"},
                                               {Law::regulation, "regulation"}};
  return all;
}

const std::vector<Choice<FeatureKind>>& featureKinds() {
  static const std::vector<Choice<FeatureKind>> all = {{FeatureKind::points, "points"},
                                                       {FeatureKind::moments, "moments"}};
  return all;
}

std::vector<Choice<Outcome>> outcomes() {
  std::vector<Choice<Outcome>> all;
  for (const Outcome outcome :
       {Outcome::converged, Outcome::stalled, Outcome::leftImage, Outcome::lost, Outcome::diverged,
        Outcome::collision, Outcome::timeout}) {
    all.push_back({outcome, toString(outcome)});
  }
  return all;
}

// The configuration
// ---------------------------------------------------------------------------------

void describe(Fields& f, CameraOptions& camera) {
  const Range size{16, 8192}, focal = Range::above(0, 1e5), centre{0, 8191};
  for (auto [key, value] : {std::pair{"width", &camera.width}, {"height", &camera.height}}) {
    long long pixels = *value;
    f.integer(key, pixels, size, "px", Need::required);
    *value = static_cast<int>(pixels);
  }
  f.number("fx", camera.fx, focal, "px", Need::required);
  f.number("fy", camera.fy, focal, "px", Need::required);
  f.number("cx", camera.cx, centre, "px", Need::required);
  f.number("cy", camera.cy, centre, "px", Need::required);
  f.oneOrMore("rate", camera.rate, Range::above(0, 1000), "Hz", Need::required);
  f.number("jitter", camera.jitter, {0, 0.9}, "");
  f.number("dropped", camera.dropped, {0, 0.9}, "");
  f.number("focal_error", camera.focal_error, {-0.5, 0.5}, "");
  f.number("focal_sigma", camera.focal_sigma, {0, 1}, "");
}

void describe(Fields& f, const char* key, VelocityProfile& profile, const Range& velocity) {
  f.list(key, profile, [&](Fields& item, VelocitySegment& segment) {
    item.number("until", segment.until, kDuration, "s", Need::required);
    item.numbersOfAny("v", segment.v, velocity, "m/s, rad/s");
    item.numbersOfAny("amplitude", segment.amplitude, velocity, "m/s, rad/s");
    item.numbersOfAny("omega", segment.omega, {0, 1000}, "rad/s");
    item.numbersOfAny("phase", segment.phase, kAngle, "rad");
  });
}

void describe(Fields& f, RpyPose& pose, Need need) {
  f.numbers("xyz", pose.xyz, kPosition, "m", need);
  f.numbers("rpy", pose.rpy, kAngle, "rad", need);
}

void describe(Fields& f, TargetOptions& target) {
  f.choice("type", target.type, targets());
  f.rows("points", target.points, {-100, 100}, "m",
         target.type == TargetKind::dots ? Need::required : Need::optional);
  f.number("radius", target.radius, kLength, "m");
  std::vector<Choice<std::string>> families;
  const std::vector<std::string> names = aprilTagFamilies();
  for (const std::string& name : names) families.push_back({name, name.c_str()});
  f.choice("family", target.family, families);
  f.list("tags", target.tags, [](Fields& item, TagOptions& tag) {
    long long id = tag.id;
    item.integer("id", id, {0, 1e6}, "", Need::required);
    tag.id = static_cast<int>(id);
    item.number("size", tag.size, kLength, "m", Need::required);
    item.number("assumed_size", tag.assumed_size, kLength, "m");
    item.section("pose", Need::optional,
                 [&](Fields& pose) { describe(pose, tag.pose, Need::optional); });
  });
  f.section("pose", Need::optional,
            [&](Fields& pose) { describe(pose, target.pose, Need::optional); });
  describe(f, "twist", target.twist, {-10, 10});
}

void describe(Fields& f, RobotPose& pose, RobotKind robot) {
  const bool isFree = robot == RobotKind::free;
  const Need onFloor = isFree ? Need::optional : Need::required;
  f.number("x", pose.x, kPosition, "m", onFloor);
  f.number("y", pose.y, kPosition, "m", onFloor);
  f.number("theta", pose.theta, kAngle, "rad", onFloor);
  f.number("pan", pose.pan, kAngle, "rad");
  f.numbers("joints", pose.joints, kAngle, "rad");
  describe(f, pose.camera, isFree ? Need::required : Need::optional);
}

void describe(Fields& f, RobotOptions& robot) {
  f.choice("type", robot.type, robots(), Need::required);
  f.numbers("camera_offset", robot.camera_offset, {-10, 10}, "m");
  f.number("camera_yaw", robot.camera_yaw, kAngle, "rad");
  f.number("pan_axis", robot.pan_axis, {-10, 10}, "m");
  f.section("arm", Need::optional, [&](Fields& arm) {
    arm.numbers("mount", robot.arm.mount, {-10, 10}, "m");
    arm.number("column", robot.arm.column, {0, 10}, "m");
    arm.number("upper_arm", robot.arm.upper_arm, {0, 10}, "m");
    arm.number("forearm", robot.arm.forearm, {0, 10}, "m");
  });
  f.section("initial", Need::required,
            [&](Fields& pose) { describe(pose, robot.initial, robot.type); });
  f.section("goal", robot.goal,
            [&](Fields& pose, RobotPose& goal) { describe(pose, goal, robot.type); });
  f.section("limits", Need::optional, [&](Fields& limits) {
    limits.number("v", robot.limits.v, kLength, "m/s");
    limits.number("w", robot.limits.w, Range::above(0, 20), "rad/s");
    limits.number("dv", robot.limits.dv, Range::above(0, 1000), "m/s^2");
    limits.number("dw", robot.limits.dw, Range::above(0, 1000), "rad/s^2");
    limits.number("pan", robot.limits.pan, Range::above(0, 20), "rad/s");
    limits.number("joints", robot.limits.joints, Range::above(0, 20), "rad/s");
    limits.number("pan_min", robot.limits.pan_min, {-100, 100}, "rad");
    limits.number("pan_max", robot.limits.pan_max, {-100, 100}, "rad");
  });
  f.number("lag", robot.lag, {0, 5}, "s");
}

void describe(Fields& f, SensingOptions& sensing) {
  f.choice<SensingSource>(
      "source", sensing.source,
      {{SensingSource::geometry, "geometry"}, {SensingSource::image, "image"}});
  f.choice("tracker", sensing.tracker, targets());
  f.number("pixel_noise", sensing.pixel_noise, {0, 50}, "px");
  f.number("assumed_noise", sensing.assumed_noise, Range::above(0, 50), "px");
  f.list("hidden", sensing.hidden, [](Fields& item, HiddenPeriod& hidden) {
    item.number("from", hidden.from, {0, 3600}, "s", Need::required);
    item.number("to", hidden.to, {0, 3600}, "s", Need::required);
    item.integers("points", hidden.points, {0, kMostPoints - 1});
  });
  f.number("outliers", sensing.outliers, {0, 0.5}, "");
  f.number("delay", sensing.delay, {0, 2}, "s");
  f.number("latency", sensing.latency, {0, 2}, "s");
  f.number("gray_noise", sensing.gray_noise, {0, 100}, "gray levels");
  f.number("exposure", sensing.exposure, {0, 1}, "s");
  f.number("vignetting", sensing.vignetting, {0, 1}, "");
  f.flag("light_on_dark", sensing.light_on_dark);
}

void describe(Fields& f, OdometryOptions& odometry) {
  f.number("scale", odometry.scale, {0.1, 10}, "");
  f.number("scale_sigma", odometry.scale_sigma, {0, 1}, "");
  f.numbers("noise", odometry.noise, {0, 10}, "m/s, rad/s");
  f.numbers("gyro_bias", odometry.gyro_bias, {-1, 1}, "rad/s");
  f.number("rate", odometry.rate, Range::above(0, 10000), "Hz");
  f.choice<OdometryMode>(
      "mode", odometry.mode,
      {{OdometryMode::measured, "measured"}, {OdometryMode::commanded, "commanded"}});
  f.number("ticks", odometry.ticks, {0, 0.1}, "m");
  f.number("wheel_base", odometry.wheel_base, kLength, "m");
}

void describe(Fields& f, EstimatorOptions& depth) {
  f.choice("estimator", depth.estimator, estimatorWords());
  f.number("initial", depth.initial, kDepth, "m", Need::required);
  f.number("Z_min", depth.Z_min, kDepth, "m");
  f.number("Z_max", depth.Z_max, kDepth, "m");
  f.flag("object", depth.object);
  f.section("gains", Need::optional, [&](Fields& gains) {
    gains.number("settling", depth.gains.settling, Range::above(0, 1000), "s");
    gains.number("W_min", depth.gains.W_min, Range::above(0, 10), "m/s");
    gains.number("k", depth.gains.k, Range::above(0, 1e6), "1/s");
    gains.number("k_3", depth.gains.k_3, {0, 1e12}, "1/m^2");
  });
  f.section("joint", Need::optional, [&](Fields& joint) {
    joint.flag("time_offset", depth.joint.time_offset);
    joint.flag("gyro_bias", depth.joint.gyro_bias);
    joint.flag("focal", depth.joint.focal);
  });
  f.section("pose", Need::optional, [&](Fields& pose) {
    pose.number("ke", depth.pose.ke, Range::above(0, 1000), "1/s");
    pose.number("kappa", depth.pose.kappa, Range::above(0, 100), "m/s, rad/s");
    pose.flag("guard", depth.pose.guard);
  });
}

void describe(Fields& f, ControlOptions& control) {
  f.choice("features", control.features, featureKinds());
  f.number("size_weight", control.size_weight, Range::above(0, 1000), "");
  f.number("gain", control.gain, Range::above(0, 100), "1/s");
  f.number("gain_in_doubt", control.gain_in_doubt, Range::above(0, 1), "");
  f.number("tolerance", control.tolerance, Range::above(0, 1000), "px");
  f.choice<ServoDepth>("depth", control.depth,
                       {{ServoDepth::observed, "observed"}, {ServoDepth::blended, "blended"}});
  f.section("excite", control.excite, [](Fields& fields, ExciteOptions& excite) {
    fields.number("speed", excite.speed, Range::above(0, 1), "m/s");
    fields.number("limit", excite.limit, Range::above(0, 1e4), "px");
  });
  f.choice<InteractionKind>("interaction", control.interaction,
                                  {{InteractionKind::current, "current"},
                                   {InteractionKind::mean, "mean"},
                                   {InteractionKind::desired, "desired"}});
  f.number("hidden_sigma", control.hidden_sigma, Range::above(0, 1e5), "px");
  f.number("hidden_wait", control.hidden_wait, {0, 3600}, "s");
  f.choice("law", control.law, laws());
  describe(f, "profile", control.profile, {-20, 20});
  f.number("kc", control.kc, Range::above(0, 1000), "1/s");
  f.flag("coupled", control.coupled);
  f.rows("desired", control.desired, {-1e5, 1e5}, "px");
}

void describe(Fields& f, Scenario& scenario) {
  f.text("name", scenario.name, Need::required);
  long long seed = scenario.seed;
  f.integer("seed", seed, {0, 4294967295.0}, "");
  scenario.seed = static_cast<unsigned>(seed);
  f.number("duration", scenario.duration, kDuration, "s", Need::required);
  const auto section = [&](const char* key, auto& part, Need need) {
    f.section(key, need, [&](Fields& fields) { describe(fields, part); });
  };
  section("camera", scenario.camera, Need::required);
  section("target", scenario.target, Need::required);
  section("robot", scenario.robot, Need::required);
  section("sensing", scenario.sensing, Need::optional);
  section("odometry", scenario.odometry, Need::optional);
  section("depth", scenario.depth, Need::required);
  section("control", scenario.control, Need::optional);
  f.section("expect", scenario.expect, [](Fields& expect, Scenario::Expect& expected) {
    expect.choice("outcome", expected.outcome, outcomes(), Need::required);
  });
}

// Its visitors
// --------------------------------------------------------------------------------------

/// Lists keys: with `descend` all below too, else of one level.
class KeyLister : public Fields {
 public:
  KeyLister(std::vector<std::string>& keys, bool descend, std::string prefix = "")
      : keys_(keys), descend_(descend), prefix_(std::move(prefix)) {}

  void number(const char* key, double&, const Range&, const char*, Need) override { add(key); }
  void number(const char* key, std::optional<double>&, const Range&, const char*) override {
    add(key);
  }
  void integer(const char* key, long long&, const Range&, const char*, Need) override { add(key); }
  void flag(const char* key, bool&) override { add(key); }
  void text(const char* key, std::string&, Need) override { add(key); }
  void numbers(const char* key, Eigen::Ref<Eigen::VectorXd>, const Range&, const char*,
               Need) override {
    add(key);
  }
  void numbersOfAny(const char* key, Eigen::VectorXd&, const Range&, const char*, Need) override {
    add(key);
  }
  void oneOrMore(const char* key, std::vector<double>&, const Range&, const char*, Need) override {
    add(key);
  }
  void integers(const char* key, std::vector<int>&, const Range&) override { add(key); }
  void section(const char* key, Need, const Describe& describeSection) override {
    add(key);
    if (!descend_) return;
    KeyLister below(keys_, true, prefix_ + key + ".");
    describeSection(below);
  }

 protected:
  void rowsOf(const char* key, std::size_t, Rows&, const Range&, const char*, Need) override {
    add(key);
  }
  void word(const char* key, std::size_t&, const std::vector<std::string>&, Need) override { add(key); }
  void optionalSection(const char* key, bool, const std::function<void()>& create,
                       const Describe& describeSection) override {
    if (descend_) create();
    section(key, Need::optional, describeSection);
  }
  void listOf(const char* key, std::size_t, const std::function<void(std::size_t)>& resize,
              const std::function<void(Fields&, std::size_t)>& describeItem) override {
    if (descend_) resize(1);
    section(key, Need::optional, [&](Fields& fields) { describeItem(fields, 0); });
  }

 private:
  void add(const char* key) { keys_.push_back(prefix_ + key); }

  std::vector<std::string>& keys_;
  bool descend_;
  std::string prefix_;
};

/// Fills a configuration from YAML; keys that are not there keep their default.
class Reader : public Fields {
 public:
  Reader(const YamlValue& value, const std::string& file, const std::string& path,
         const Describe& describeAll)
      : mapping_(value, file, path, keysOf(describeAll)) {
    describeAll(*this);
  }

  void number(const char* key, double& value, const Range& range, const char* unit,
              Need need) override {
    if (reads(key, need)) value = mapping_.number(key, range, unit);
  }
  void number(const char* key, std::optional<double>& value, const Range& range,
              const char* unit) override {
    if (isSet(key)) value = mapping_.number(key, range, unit);
  }
  void integer(const char* key, long long& value, const Range& range, const char* unit,
               Need need) override {
    if (reads(key, need)) value = mapping_.integer(key, range, unit);
  }
  void flag(const char* key, bool& value) override {
    if (reads(key, Need::optional)) value = mapping_.flag(key);
  }
  void text(const char* key, std::string& value, Need need) override {
    if (reads(key, need)) value = mapping_.text(key);
  }
  void numbers(const char* key, Eigen::Ref<Eigen::VectorXd> value, const Range& range,
               const char* unit, Need need) override {
    if (!reads(key, need)) return;
    const std::vector<double> numbers = mapping_.numbers(key, value.size(), range, unit);
    value = Eigen::Map<const Eigen::VectorXd>(numbers.data(), value.size());
  }
  void numbersOfAny(const char* key, Eigen::VectorXd& value, const Range& range, const char* unit,
                    Need need) override {
    if (!reads(key, need)) return;
    const std::vector<double> numbers = mapping_.numbers(key, 0, range, unit);
    value = Eigen::Map<const Eigen::VectorXd>(numbers.data(),
                                              static_cast<Eigen::Index>(numbers.size()));
  }
  void oneOrMore(const char* key, std::vector<double>& value, const Range& range, const char* unit,
                 Need need) override {
    if (!reads(key, need)) return;
    const bool isList = mapping_.value(key).kind == YamlValue::Kind::list;
    value = isList ? mapping_.numbers(key, 0, range, unit)
                   : std::vector<double>{mapping_.number(key, range, unit)};
    if (value.empty()) mapping_.fail(key, "expected a number or a list of numbers, got []");
  }
  void integers(const char* key, std::vector<int>& value, const Range& range) override {
    if (!reads(key, Need::optional)) return;
    value.clear();
    for (const double number : mapping_.numbers(key, 0, range, "")) {
      if (number != static_cast<int>(number)) mapping_.fail(key, "expected whole numbers");
      value.push_back(static_cast<int>(number));
    }
  }
  void section(const char* key, Need need, const Describe& describeSection) override {
    if (!reads(key, need)) return;
    Reader(mapping_.value(key), mapping_.file(), mapping_.pathOf(key), describeSection);
  }

 protected:
  void rowsOf(const char* key, std::size_t width, Rows& value, const Range& range, const char* unit,
              Need need) override {
    if (reads(key, need)) value = mapping_.rows(key, width, range, unit);
  }
  void word(const char* key, std::size_t& index, const std::vector<std::string>& words,
            Need need) override {
    if (!reads(key, need)) return;
    const std::string text = mapping_.text(key);
    const auto found = std::find(words.begin(), words.end(), text);
    if (found == words.end()) mapping_.fail(key, detail::unknownWord(text, words));
    index = static_cast<std::size_t>(found - words.begin());
  }
  void optionalSection(const char* key, bool, const std::function<void()>& create,
                       const Describe& describeSection) override {
    if (!isSet(key)) return;
    create();
    section(key, Need::required, describeSection);
  }
  void listOf(const char* key, std::size_t, const std::function<void(std::size_t)>& resize,
              const std::function<void(Fields&, std::size_t)>& describeItem) override {
    if (!reads(key, Need::optional)) return;
    const std::vector<YamlValue>& items = mapping_.list(key).items;
    resize(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      Reader(items[i], mapping_.file(), mapping_.pathOf(key),
             [&](Fields& fields) { describeItem(fields, i); });
    }
  }

 private:
  static std::vector<std::string> keysOf(const Describe& describeAll) {
    std::vector<std::string> keys;
    KeyLister lister(keys, false);
    describeAll(lister);
    return keys;
  }
  bool reads(const char* key, Need need) const {
    if (need == Need::required) mapping_.value(key);
    return mapping_.has(key);
  }
  bool isSet(const char* key) const {
    return mapping_.has(key) && mapping_.value(key).kind != YamlValue::Kind::null;
  }

  StrictMapping mapping_;
};

/// Writes a configuration as JSON; what is not set is null.
class JsonWriter : public Fields {
 public:
  using Json = nlohmann::ordered_json;
  explicit JsonWriter(Json& json) : json_(json) { json_ = Json::object(); }

  void number(const char* key, double& value, const Range&, const char*, Need) override {
    json_[key] = value;
  }
  void number(const char* key, std::optional<double>& value, const Range&, const char*) override {
    json_[key] = value ? Json(*value) : Json();
  }
  void integer(const char* key, long long& value, const Range&, const char*, Need) override {
    json_[key] = value;
  }
  void flag(const char* key, bool& value) override { json_[key] = value; }
  void text(const char* key, std::string& value, Need) override { json_[key] = value; }
  void numbers(const char* key, Eigen::Ref<Eigen::VectorXd> value, const Range&, const char*,
               Need) override {
    json_[key] = std::vector<double>(value.begin(), value.end());
  }
  void numbersOfAny(const char* key, Eigen::VectorXd& value, const Range&, const char*,
                    Need) override {
    json_[key] = std::vector<double>(value.begin(), value.end());
  }
  void oneOrMore(const char* key, std::vector<double>& value, const Range&, const char*,
                 Need) override {
    json_[key] = value.size() == 1 ? Json(value.front()) : Json(value);
  }
  void integers(const char* key, std::vector<int>& value, const Range&) override {
    json_[key] = value;
  }
  void section(const char* key, Need, const Describe& describeSection) override {
    JsonWriter below(json_[key]);
    describeSection(below);
  }

 protected:
  void rowsOf(const char* key, std::size_t, Rows& value, const Range&, const char*, Need) override {
    json_[key] = value;
  }
  void word(const char* key, std::size_t& index, const std::vector<std::string>& words, Need) override {
    json_[key] = words[index];
  }
  void optionalSection(const char* key, bool exists, const std::function<void()>&,
                       const Describe& describeSection) override {
    if (exists) {
      section(key, Need::optional, describeSection);
    } else {
      json_[key] = nullptr;
    }
  }
  void listOf(const char* key, std::size_t size, const std::function<void(std::size_t)>&,
              const std::function<void(Fields&, std::size_t)>& describeItem) override {
    Json items = Json::array();
    for (std::size_t i = 0; i < size; ++i) {
      JsonWriter item(items.emplace_back());
      describeItem(item, i);
    }
    json_[key] = std::move(items);
  }

 private:
  Json& json_;
};

// Reading
// -------------------------------------------------------------------------------------------

void markOption(YamlValue& value, const std::string& option) {
  value.option = option;
  for (YamlValue& item : value.items) markOption(item, option);
  for (auto& entry : value.entries) markOption(entry.value, option);
}

/// Puts "key.path=value" into the tree.
void applyOverride(YamlValue& root, const std::string& file, const std::string& setting) {
  const std::string option = "--set " + setting;
  const auto refuse = [&](const std::string& why) { throw InputError({file, 0, option}, why); };
  detail::checkText(option, "--set", {4096, 4096});
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) refuse("expected key.path=value");
  std::string path = setting.substr(0, equals);
  const std::vector<std::string> valid = Scenario::keys();
  if (std::find(valid.begin(), valid.end(), path) == valid.end()) {
    refuse("unknown key; the nearest valid key is '" + nearestWord(path, valid) + "'");
  }
  YamlValue value;
  try {
    value = detail::parseYaml(setting.substr(equals + 1), option);
  } catch (const InputError& e) {
    refuse(e.message());
  }
  const bool remove = value.kind == YamlValue::Kind::null;
  if (remove && setting.substr(equals + 1) != "null" && setting.substr(equals + 1) != "~") {
    refuse("no value after '='; write null to remove the key");
  }
  markOption(value, option);

  YamlValue* mapping = &root;
  for (std::size_t dot; (dot = path.find('.')) != std::string::npos; path.erase(0, dot + 1)) {
    const std::string key = path.substr(0, dot);
    YamlValue* below = mapping->find(key);
    if (!below) {
      YamlValue empty;
      empty.kind = YamlValue::Kind::mapping;
      markOption(empty, option);
      mapping->entries.push_back({key, 0, std::move(empty)});
      below = &mapping->entries.back().value;
    }
    if (below->kind != YamlValue::Kind::mapping) {
      refuse("'" + key + "' is not a mapping; set '" + key + "' as a whole");
    }
    mapping = below;
  }
  auto& entries = mapping->entries;
  if (YamlValue* existing = mapping->find(path); existing && !remove) {
    *existing = std::move(value);
  } else if (!remove) {
    entries.push_back({path, 0, std::move(value)});
  } else {
    entries.erase(std::remove_if(entries.begin(), entries.end(),
                                 [&](const auto& entry) { return entry.key == path; }),
                  entries.end());
  }
}

/// Brings the short forms of sensing.hidden, [from, to] and one mapping alone, to a list of
/// mappings.
void expandHidden(YamlValue& root) {
  YamlValue* sensing = root.find("sensing");
  YamlValue* hidden = sensing ? sensing->find("hidden") : nullptr;
  if (!hidden) return;
  if (hidden->kind == YamlValue::Kind::mapping) {
    YamlValue list;
    list.kind = YamlValue::Kind::list;
    list.line = hidden->line;
    list.option = hidden->option;
    list.items.push_back(*hidden);
    *hidden = std::move(list);
  }
  for (YamlValue& item : hidden->items) {
    if (item.kind != YamlValue::Kind::list || item.items.size() != 2) continue;
    YamlValue mapping;
    mapping.kind = YamlValue::Kind::mapping;
    mapping.line = item.line;
    mapping.option = item.option;
    mapping.entries = {{"from", item.line, item.items[0]}, {"to", item.line, item.items[1]}};
    item = std::move(mapping);
  }
}

using Refuse = std::function<void(const std::string& path, const std::string& message)>;

void checkProfile(const std::string& path, const VelocityProfile& profile, std::size_t size,
                  const Refuse& refuse) {
  double until = 0;
  for (const VelocitySegment& segment : profile) {
    if (segment.until <= until) {
      refuse(path, fmt::format("until = {} s comes after {} s; times must increase", segment.until,
                               until));
    }
    until = segment.until;
    for (const auto& [key, values] : {std::pair{"v", &segment.v},
                                      {"amplitude", &segment.amplitude},
                                      {"omega", &segment.omega},
                                      {"phase", &segment.phase}}) {
      if (values->size() == 0 || values->size() == static_cast<Eigen::Index>(size)) continue;
      refuse(path, fmt::format("{}: expected {} numbers, got {}", key, size, values->size()));
    }
  }
}

/// What a robot or a law cannot do.
void checkRobot(const Scenario& s, const Refuse& refuse) {
  const RobotOptions& robot = s.robot;
  const bool hasWheels = robot.type == RobotKind::unicycle;
  if (!hasWheels && robot.lag != 0) refuse("robot.lag", "only robot.type unicycle has a lag");
  if (!hasWheels && robot.camera_yaw != 0) {
    refuse("robot.camera_yaw", "only robot.type unicycle has a camera_yaw");
  }
  if (!hasWheels && s.odometry.ticks != 0) {
    refuse("odometry.ticks", "only robot.type unicycle has wheels that count");
  }
  if (!hasWheels && s.odometry.mode == OdometryMode::commanded && !s.odometry.noise.isZero()) {
    refuse("odometry.mode", "noise of commanded odometry needs robot.type unicycle");
  }
  const bool isFree = robot.type == RobotKind::free;
  for (const auto& [key, pose] : {std::pair{"robot.initial", &robot.initial},
                                  {"robot.goal", robot.goal ? &*robot.goal : &robot.initial}}) {
    const bool hasFloorPose = pose->x != 0 || pose->y != 0 || pose->theta != 0;
    const bool hasCameraPose = !pose->camera.xyz.isZero() || !pose->camera.rpy.isZero();
    if (isFree && hasFloorPose) refuse(key, "a free camera is placed by xyz and rpy");
    if (!isFree && hasCameraPose) refuse(key, "xyz and rpy are for robot.type free");
    if (robot.type != RobotKind::panUnicycle && pose->pan != 0) {
      refuse(key, "pan is for robot.type pan-unicycle");
    }
    if (robot.type != RobotKind::mobileManipulator && !pose->joints.isZero()) {
      refuse(key, "joints are for robot.type mobile-manipulator");
    }
  }
  if (robot.type == RobotKind::mobileManipulator && !robot.camera_offset.isZero()) {
    refuse("robot.camera_offset", "the camera of a mobile-manipulator is at the tip of its arm");
  }
  if (robot.limits.pan_min > robot.limits.pan_max) {
    refuse("robot.limits.pan_min", fmt::format("{} rad is above pan_max = {} rad",
                                               robot.limits.pan_min, robot.limits.pan_max));
  }
  if (s.control.law == Law::task &&
      (robot.type == RobotKind::unicycle || robot.type == RobotKind::mobileManipulator)) {
    refuse("control.law",
           "task needs a robot that can move the camera at will: pan-unicycle, omni or free");
  }
  if (s.control.law == Law::task && robot.type == RobotKind::panUnicycle && robot.pan_axis == 0) {
    refuse("robot.pan_axis", "the task law needs a pan axis that is not above the wheel axle");
  }
  if (s.control.law == Law::regulation) {
    if (s.depth.estimator != EstimatorKind::pose) {
      refuse("control.law",
             "regulation steers by the pose of the target: needs depth.estimator: pose");
    }
    if (!s.robot.goal) refuse("control.law", "regulation needs a desired pose: give robot.goal");
    if (robot.type != RobotKind::omni && !isFree) {
      refuse("control.law", "regulation needs a robot.type omni or free");
    }
  }
  if (s.control.coupled && s.control.law != Law::regulation) {
    refuse("control.coupled", "needs control.law: regulation");
  }
  if (s.control.features == FeatureKind::moments) {
    if (s.control.law != Law::vpServo) {
      refuse("control.features", "moments need control.law: vpServo");
    }
    if (s.target.points.size() < 3) {
      refuse("control.features", fmt::format("moments need 3 points or more, the target has {}",
                                             s.target.points.size()));
    }
  }
  if ((s.control.law == Law::profile) == s.control.profile.empty()) {
    refuse("control.profile",
           s.control.profile.empty()
               ? "the law profile needs velocities: profile: [{until: 10, v: [...]}]"
               : "needs control.law: profile");
  }
}

/// Tags that do not fit together, or keys that do not fit the type of target.
void checkTarget(const Scenario& s, const YamlValue& root, const Refuse& refuse) {
  const auto isGiven = [&](const char* section, const char* key) {
    const YamlValue* below = const_cast<YamlValue&>(root).find(section);
    return below && const_cast<YamlValue*>(below)->find(key);
  };
  const TargetOptions& target = s.target;
  if (target.type == TargetKind::dots) {
    if (!target.tags.empty()) refuse("target.tags", "needs target.type: apriltag");
    if (isGiven("target", "family")) refuse("target.family", "needs target.type: apriltag");
  } else {
    if (isGiven("target", "radius")) refuse("target.radius", "is for dots");
    if (target.points != target.trueTags().corners()) {
      refuse("target.points", "is for dots; a tag's points are its corners");
    }
    if (target.tags.empty() || 4 * target.tags.size() > kMostPoints) {
      refuse("target.tags",
             fmt::format("expected 1 to {} tags, got {}", kMostPoints / 4, target.tags.size()));
    }
    const int count = aprilTagCount(target.family);
    for (std::size_t i = 0; i < target.tags.size(); ++i) {
      const int id = target.tags[i].id;
      if (id >= count) {
        refuse("target.tags", fmt::format("the family {} has the ids 0 to {}, not {}",
                                          target.family, count - 1, id));
      }
      for (std::size_t j = 0; j < i; ++j) {
        if (target.tags[j].id == id)
          refuse("target.tags", fmt::format("tag {} is there twice", id));
      }
    }
    if (s.sensing.light_on_dark) refuse("sensing.light_on_dark", "tags are dark on light");
  }
  if (isGiven("sensing", "tracker") && s.sensing.tracker != target.type) {
    refuse("sensing.tracker", target.type == TargetKind::dots ? "target.type is dots; write dots"
                                                              : "target.type is apriltag; write "
                                                                "apriltag");
  }
}

/// What no single key can tell.
void checkTogether(const Scenario& s, const YamlValue& root, const std::string& file) {
  // Faults are shown at the deepest mapping of the path that exists.
  const auto refuse = [&](const std::string& path, const std::string& message) {
    const YamlValue* at = &root;
    std::string rest = path + ".";
    for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest.erase(0, dot + 1)) {
      const YamlValue* below = const_cast<YamlValue*>(at)->find(rest.substr(0, dot));
      if (!below) break;
      at = below;
    }
    if (at->option.empty()) throw InputError({file, at->line, path}, message);
    throw InputError({file, 0, at->option}, path + ": " + message);
  };
  const CameraOptions& camera = s.camera;
  if (camera.cx > camera.width - 1 || camera.cy > camera.height - 1) {
    refuse("camera", fmt::format("the principal point ({}, {}) px lies outside the {}x{} image",
                                 camera.cx, camera.cy, camera.width, camera.height));
  }
  checkTarget(s, root, refuse);
  const auto& points = s.target.points;
  if (points.empty() || points.size() > kMostPoints) {
    refuse("target.points",
           fmt::format("expected 1 to {} points, got {}", kMostPoints, points.size()));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (points[i] == points[j]) {
        refuse("target.points", fmt::format("points {} and {} are the same; remove one", j, i));
      }
    }
  }
  checkProfile("target.twist", s.target.twist, 6, refuse);
  const auto velocities = makeRobot(s.robot, s.robot.initial)->velocityNames();
  checkProfile("control.profile", s.control.profile, velocities.size(), refuse);
  checkRobot(s, refuse);
  for (const auto& hidden : s.sensing.hidden) {
    if (hidden.from >= hidden.to) {
      refuse("sensing.hidden",
             fmt::format("from = {} s must be before to = {} s", hidden.from, hidden.to));
    }
    for (const int point : hidden.points) {
      if (point >= static_cast<int>(points.size())) {
        refuse("sensing.hidden", fmt::format("there is no point {}; the target has points 0 to {}",
                                             point, points.size() - 1));
      }
    }
  }
  const double fastest = *std::max_element(camera.rate.begin(), camera.rate.end());
  const double interval_s = (1 - camera.jitter) / fastest;
  if (s.sensing.exposure > interval_s) {
    refuse("sensing.exposure", fmt::format("{} s is longer than the time between images, {} s",
                                           s.sensing.exposure, interval_s));
  }
  const EstimatorOptions& depth = s.depth;
  if (depth.Z_min >= depth.Z_max) {
    refuse("depth.Z_min", fmt::format("{} m must be below Z_max = {} m", depth.Z_min, depth.Z_max));
  }
  if (depth.initial < depth.Z_min || depth.initial > depth.Z_max) {
    refuse("depth.initial", fmt::format("{} m lies outside Z_min = {} m .. Z_max = {} m",
                                        depth.initial, depth.Z_min, depth.Z_max));
  }
  if (depth.estimator == EstimatorKind::pose) {
    const auto known = s.target.dots().points;
    if (s.target.type == TargetKind::apriltag && known.empty()) {
      refuse("target.tags", "depth.estimator: pose needs to know the tags: give assumed_size");
    }
    if (const auto why = whyNoTarget(known)) {
      refuse("target.points", fmt::format("depth.estimator: pose needs more: {}", *why));
    }
  }
  if (depth.object && depth.estimator != EstimatorKind::nonlinear) {
    refuse("depth.object",
           fmt::format("needs depth.estimator: nonlinear, not {}", toString(depth.estimator)));
  }
  if (depth.gains.k.has_value() != depth.gains.k_3.has_value()) {
    refuse("depth.gains", "k and k_3 go together; give both, or settling and W_min");
  }
  if (depth.gains.k_3) {
    const std::string objection = DepthGains::objection(*depth.gains.k_3, kGainExcitation, fastest);
    if (!objection.empty()) refuse("depth.gains.k_3", objection);
  }
  const auto& desired = s.control.desired;
  const bool needsGoal = s.control.law != Law::profile;
  if (needsGoal ? s.robot.goal.has_value() == !desired.empty()
                : s.robot.goal.has_value() || !desired.empty()) {
    if (!needsGoal) refuse("control.law", "profile has no goal; remove robot.goal and desired");
    refuse(desired.empty() ? "robot.goal" : "control.desired",
           "expected exactly one of robot.goal (a pose) and control.desired (pixels)");
  }
  if (!desired.empty() && desired.size() != points.size()) {
    refuse("control.desired", fmt::format("expected one pixel for each of the {} points, got {}",
                                          points.size(), desired.size()));
  }
  for (const auto& pixel : desired) {
    if (!camera.pinhole().contains(pixel.x(), pixel.y())) {
      refuse("control.desired", fmt::format("({}, {}) px lies outside the {}x{} image", pixel.x(),
                                            pixel.y(), camera.width, camera.height));
    }
  }
}

}  // namespace

Scenario Scenario::load(const std::string& path, const std::vector<std::string>& overrides) {
  YamlValue root = detail::loadYaml(path);
  for (const std::string& setting : overrides) applyOverride(root, path, setting);
  expandHidden(root);
  Scenario scenario;
  scenario.file = path;
  Reader(root, path, "", [&](Fields& fields) { describe(fields, scenario); });
  if (scenario.target.type == TargetKind::apriltag && scenario.target.points.empty()) {
    scenario.target.points = scenario.target.trueTags().corners();
  }
  checkTogether(scenario, root, path);
  scenario.sensing.tracker = scenario.target.type;
  return scenario;
}

std::string Scenario::toJson() const {
  Scenario copy = *this;
  nlohmann::ordered_json json;
  JsonWriter writer(json);
  describe(writer, copy);
  const bool hasDots = target.type == TargetKind::dots;
  for (const char* key : {"family", "tags"}) {
    if (hasDots) json["target"].erase(key);
  }
  if (!hasDots) json["target"].erase("radius");
  return json.dump();
}

std::vector<std::string> Scenario::keys() {
  Scenario all;
  std::vector<std::string> keys;
  KeyLister lister(keys, true);
  describe(lister, all);
  return keys;
}

}  // namespace depthservo
