#include "report/foxglove.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "depthservo/sequence/CommandStream.h"
#include "report/reportable.h"
#include "sequence/ImageFile.h"
#include "text/base64.h"

namespace depthservo::foxglove {
namespace {

Json json(const Time& time) { return {{"sec", time.sec}, {"nsec", time.nsec}}; }
Json json(const Eigen::Vector3d& p) { return {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}}; }
Json pixel(double u, double v) { return {{"x", u}, {"y", v}}; }
Json quaternion(const Eigen::Quaterniond& q) {
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}
Json poseAt(const Eigen::Vector3d& p) {
  return {{"position", json(p)}, {"orientation", quaternion(Eigen::Quaterniond::Identity())}};
}
Json color(double r, double g, double b, double a = 1) {
  return {{"r", r}, {"g", g}, {"b", b}, {"a", a}};
}

/// Distinct for the colour-blind, too (Okabe and Ito).
Json colorOf(DepthStatus status) {
  switch (status) {
    case DepthStatus::valid:
      return color(0, 0.62, 0.45);
    case DepthStatus::rejected:
    case DepthStatus::lost:
      return color(0.84, 0.37, 0);
    case DepthStatus::coasting:
      return color(0.6, 0.6, 0.6);
    default:
      return color(0.34, 0.71, 0.91);
  }
}

void add(Json& object, const char* key, double value) {
  if (std::isfinite(value)) object[key] = value;
}

Json velocities(const Velocities& values, const std::vector<std::string>& names) {
  Json object = Json::object();
  for (std::size_t i = 0; i < names.size() && static_cast<Eigen::Index>(i) < values.size(); ++i) {
    add(object, shortName(names[i]).c_str(), values[static_cast<Eigen::Index>(i)]);
  }
  return object;
}

/// Points of which more is known than that they are lost.
std::vector<const FeatureRecord*> placed(const FrameRecord& frame) {
  std::vector<const FeatureRecord*> points;
  for (const FeatureRecord& feature : frame.features) {
    const DepthStatus status = reportable(feature.estimate).status;
    if (status != DepthStatus::lost && status != DepthStatus::unset) points.push_back(&feature);
  }
  return points;
}

Eigen::Vector3d positionOf(const DepthEstimate& e, double Z) { return {e.x * Z, e.y * Z, Z}; }

/// To first order, x, y and Z being independent: [Z 0 x; 0 Z y; 0 0 1] diag(sigma^2) [..]^T [m^2].
Eigen::Matrix3d covarianceOf(const DepthEstimate& e) {
  Eigen::Matrix3d J;
  J << e.Z(), 0, e.x, 0, e.Z(), e.y, 0, 0, 1;
  const Eigen::Vector3d sigma(e.sigma_xy, e.sigma_xy, e.sigma_Z());
  return J * sigma.cwiseAbs2().asDiagonal() * J.transpose();
}

constexpr int kUint8 = 1, kInt32 = 6, kFloat64 = 8;  // foxglove.NumericType

struct CloudField {
  const char* name;
  int type;
};
constexpr CloudField kCloudFields[] = {
    {"x", kFloat64},      {"y", kFloat64},      {"z", kFloat64},      {"sigma_z", kFloat64},
    {"z_low", kFloat64},  {"z_high", kFloat64}, {"cov_xx", kFloat64}, {"cov_xy", kFloat64},
    {"cov_xz", kFloat64}, {"cov_yy", kFloat64}, {"cov_yz", kFloat64}, {"cov_zz", kFloat64},
    {"id", kInt32},       {"measured", kUint8}, {"status", kUint8}};

int sizeOf(int type) { return type == kFloat64 ? 8 : type == kInt32 ? 4 : 1; }

template <class Number>
void append(std::string& bytes, Number number) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::string cloudBytes(const FeatureRecord& feature) {
  const DepthEstimate& e = feature.estimate;
  const Eigen::Vector3d p = positionOf(e, e.Z());
  const Eigen::Matrix3d C = covarianceOf(e);
  const auto [low, high] = e.interval();
  std::string bytes;
  for (const double value : {p.x(), p.y(), p.z(), e.sigma_Z(), low, high, C(0, 0), C(0, 1), C(0, 2),
                             C(1, 1), C(1, 2), C(2, 2)}) {
    append(bytes, value);
  }
  append(bytes, static_cast<std::int32_t>(feature.id));
  append(bytes, static_cast<std::uint8_t>(feature.measured));
  append(bytes, static_cast<std::uint8_t>(e.status));
  return bytes;
}

Json circle(double time_s, double u, double v, double diameter, double thickness,
            const Json& outline) {
  return {{"timestamp", json(Time(time_s))},
          {"position", pixel(u, v)},
          {"diameter", diameter},
          {"thickness", thickness},
          {"fill_color", color(0, 0, 0, 0)},
          {"outline_color", outline}};
}

std::string entityId(const FeatureRecord& feature) { return "point " + std::to_string(feature.id); }

}  // namespace

Time::Time(double time_s) {
  const double whole = std::floor(time_s);
  sec = static_cast<std::uint64_t>(whole);
  nsec = static_cast<std::uint64_t>(std::llround((time_s - whole) * 1e9));
  if (nsec < 1'000'000'000) return;
  ++sec;
  nsec = 0;
}

Json compressedImage(double time_s, const DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  constexpr int kQuick = -1;
  const std::string png = detail::pngOf(
      image.bitmap, {static_cast<int>(image.getWidth()), static_cast<int>(image.getHeight())},
      kQuick);
  return {{"timestamp", json(Time(time_s))},
          {"frame_id", kCamera},
          {"data", detail::base64(png)},
          {"format", "png"}};
}

Json cameraCalibration(double time_s, const PinholeCamera& c) {
  const LensDistortion& d = c.distortion;
  return {{"timestamp", json(Time(time_s))},
          {"frame_id", kCamera},
          {"width", c.width},
          {"height", c.height},
          {"distortion_model", "plumb_bob"},
          {"D", {d.k1(), d.k2(), d.p1(), d.p2(), d.k3()}},
          {"K", {c.fx, 0., c.cx, 0., c.fy, c.cy, 0., 0., 1.}},
          {"R", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
          {"P", {c.fx, 0., c.cx, 0., 0., c.fy, c.cy, 0., 0., 0., 1., 0.}}};
}

Json frameTransform(double time_s, const char* parent, const char* child,
                    const Eigen::Isometry3d& parentFromChild) {
  return {{"timestamp", json(Time(time_s))},
          {"parent_frame_id", parent},
          {"child_frame_id", child},
          {"translation", json(Eigen::Vector3d(parentFromChild.translation()))},
          {"rotation", quaternion(Eigen::Quaterniond(parentFromChild.linear()))}};
}

Json log(double time_s, Level level, const std::string& name, const std::string& message) {
  return {{"timestamp", json(Time(time_s))},
          {"level", static_cast<int>(level)},
          {"message", message},
          {"name", name},
          {"file", ""},
          {"line", 0}};
}

Json pointCloud(const FrameRecord& frame) {
  Json fields = Json::array();
  int stride = 0;
  for (const CloudField& field : kCloudFields) {
    fields.push_back({{"name", field.name}, {"offset", stride}, {"type", field.type}});
    stride += sizeOf(field.type);
  }
  std::string data;
  for (const FeatureRecord* feature : placed(frame)) data += cloudBytes(*feature);
  return {{"timestamp", json(Time(frame.time_s))},
          {"frame_id", kCamera},
          {"pose", poseAt(Eigen::Vector3d::Zero())},
          {"point_stride", stride},
          {"fields", fields},
          {"data", detail::base64(data)}};
}

Json sceneUpdate(const FrameRecord& frame) {
  constexpr double kLeast_m = 0.004, kFarthest = 4;  // of a sphere; of an interval, in Z
  Json deletions = Json::array(), entities = Json::array();
  const Json time = json(Time(frame.time_s)), none = Json::array();
  const auto points = placed(frame);
  for (const FeatureRecord& feature : frame.features) {
    if (std::find(points.begin(), points.end(), &feature) != points.end()) continue;
    deletions.push_back({{"timestamp", time}, {"type", 0}, {"id", entityId(feature)}});
  }
  for (const FeatureRecord* feature : points) {
    const DepthEstimate& e = feature->estimate;
    const auto [low, high] = e.interval();
    const Eigen::Vector3d p = positionOf(e, e.Z());
    const double size = std::max(kLeast_m, 2 * e.sigma_xy * e.Z());
    const Json ends = {json(positionOf(e, low)),
                       json(positionOf(e, std::min(high, kFarthest * e.Z())))};
    const Json shade = colorOf(e.status);
    Json sphere = {
        {"pose", poseAt(p)}, {"size", json(Eigen::Vector3d::Constant(size))}, {"color", shade}};
    Json line = {{"type", 0},      {"pose", poseAt(Eigen::Vector3d::Zero())},
                 {"thickness", 2}, {"scale_invariant", true},
                 {"points", ends}, {"color", shade},
                 {"colors", none}, {"indices", none}};
    Json text = {{"pose", poseAt(p)}, {"billboard", true},
                 {"font_size", 12},   {"scale_invariant", true},
                 {"color", shade},    {"text", std::to_string(feature->id)}};
    entities.push_back({{"timestamp", time},
                        {"frame_id", kCamera},
                        {"id", entityId(*feature)},
                        {"lifetime", {{"sec", 0}, {"nsec", 0}}},
                        {"frame_locked", true},
                        {"metadata", {{{"key", "status"}, {"value", toString(e.status)}}}},
                        {"arrows", none},
                        {"cubes", none},
                        {"spheres", Json::array({sphere})},
                        {"cylinders", none},
                        {"lines", Json::array({line})},
                        {"triangles", none},
                        {"texts", Json::array({text})},
                        {"models", none}});
  }
  return {{"deletions", deletions}, {"entities", entities}};
}

Json imageAnnotations(const FrameRecord& frame, const std::vector<Eigen::Vector2d>& goals) {
  constexpr double kDot_px = 12, kGoal_px = 20, kThin_px = 1, kThick_px = 3;
  const Json goal = color(0.9, 0.62, 0);
  Json circles = Json::array(), texts = Json::array();
  for (const Eigen::Vector2d& g : goals) {
    if (!g.allFinite()) continue;
    circles.push_back(circle(frame.time_s, g.x(), g.y(), kGoal_px, kThin_px, goal));
  }
  for (const FeatureRecord& feature : frame.features) {
    if (!std::isfinite(feature.u) || !std::isfinite(feature.v)) continue;
    const Json shade = colorOf(feature.estimate.status);
    circles.push_back(circle(frame.time_s, feature.u, feature.v, kDot_px,
                             feature.measured ? kThick_px : kThin_px, shade));
    texts.push_back({{"timestamp", json(Time(frame.time_s))},
                     {"position", pixel(feature.u + kDot_px, feature.v)},
                     {"text", std::to_string(feature.id)},
                     {"font_size", kDot_px},
                     {"text_color", shade},
                     {"background_color", color(0, 0, 0, 0)}});
  }
  return {{"circles", circles}, {"points", Json::array()}, {"texts", texts}};
}

Json depths(const FrameRecord& frame) {
  Json points = Json::array();
  for (const FeatureRecord& feature : frame.features) {
    if (feature.estimate.status == DepthStatus::unset) continue;
    const DepthEstimate e = reportable(feature.estimate);
    const auto [low, high] = e.interval();
    Json point = {{"id", feature.id}};
    add(point, "u", feature.u);
    add(point, "v", feature.v);
    point["measured"] = feature.measured;
    point["Z"] = e.Z();
    point["sigma_Z"] = e.sigma_Z();
    point["Z_low"] = low;
    add(point, "Z_high", high);
    point["status"] = toString(e.status);
    add(point, "excitation", e.excitation);
    add(point, "Z_true", feature.Z_true);
    points.push_back(std::move(point));
  }
  return {{"timestamp", json(Time(frame.time_s))}, {"frame_id", kCamera}, {"points", points}};
}

Json robot(const FrameRecord& frame, const std::vector<std::string>& velocityNames,
           bool isTwistKnown) {
  Json message = {{"timestamp", json(Time(frame.time_s))}};
  add(message, "error_px", frame.error_px);
  if (frame.command.size() > 0) message["command"] = velocities(frame.command, velocityNames);
  if (frame.applied.size() > 0) message["applied"] = velocities(frame.applied, velocityNames);
  if (isTwistKnown) {
    Velocities twist(6);
    twist << frame.twist.linear, frame.twist.angular;
    message["twist"] = velocities(twist, {"vx", "vy", "vz", "wx", "wy", "wz"});
  }
  if (frame.robotPose.allFinite()) {
    message["pose"] = velocities(frame.robotPose, {"x", "y", "theta"});
  }
  return message;
}

}  // namespace depthservo::foxglove
