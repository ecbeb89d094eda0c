#include "sequence/cameraFiles.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "sequence/vispCamera.h"
#include "text/StrictYaml.h"

namespace depthservo::detail {
namespace {

constexpr Range kNumber{-1e9, 1e9};
constexpr Range kFocal = Range::above(0, 1e5);  // px
constexpr Range kCentre{-1e5, 1e5};             // px
constexpr Range kSide{1, 16384};                // px

struct CameraPreset {
  const char* name;
  PinholeCamera camera;
};

/// Published calibrations: TUM RGB-D benchmark ("Intrinsic camera calibration of the Kinect"; fr3
/// comes undistorted), ICL-NUIM.
const std::vector<CameraPreset>& presets() {
  static const std::vector<CameraPreset> all = {
      {"tum-fr1",
       {640, 480, 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}}},
      {"tum-fr2",
       {640, 480, 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}}},
      {"tum-fr3", {640, 480, 535.4, 539.2, 320.1, 247.6, {}}},
      {"icl", {640, 480, 481.20, -480.00, 319.5, 239.5, {}}},
  };
  return all;
}

/// Refuses intrinsic parameters that no camera has; `key` is where they stand.
void checkIntrinsics(const PinholeCamera& camera, const StrictMapping& file, const char* key) {
  if (!kFocal.contains(camera.fx) || !kFocal.contains(std::abs(camera.fy)) ||
      !kCentre.contains(camera.cx) || !kCentre.contains(camera.cy)) {
    file.fail(key, fmt::format("expected fx and |fy| in {}, cx and cy in {}", kFocal.text("px"),
                               kCentre.text("px")));
  }
}

/// Refuses a model that is not a pinhole even when its coefficients are zero or missing: an ideal
/// fisheye draws r = f theta, a pinhole r = f tan(theta).
void checkModel(const std::string& model, const StrictMapping& file) {
  static const std::set<std::string> pinholes = {
      "plumb_bob", "radial-tangential", "radtan", "rational_polynomial", "none", "pinhole", ""};
  if (pinholes.count(model) > 0) return;
  file.fail("distortion_model",
            fmt::format("'{}' is not supported, whatever its coefficients are; undistort the "
                        "images, then say plumb_bob (or no model) and zeros",
                        model));
}

/// Coefficients (k1, k2, p1, p2[, k3[, zeros]]) of the model called plumb_bob or
/// radial-tangential.
LensDistortion distortionOf(const std::vector<double>& coefficients, const std::string& model,
                            const StrictMapping& file) {
  bool isZero = true;
  for (const double c : coefficients) isZero = isZero && c == 0;
  if (isZero) return {};
  if (model != "plumb_bob" && model != "radial-tangential" && model != "radtan") {
    file.fail("distortion_model", fmt::format("'{}' has coefficients, expected plumb_bob or "
                                              "radial-tangential; undistort the images and write "
                                              "zeros",
                                              model));
  }
  for (std::size_t i = 5; i < coefficients.size(); ++i) {
    if (coefficients[i] != 0) {
      file.fail("distortion_coefficients",
                "expected k1, k2, p1, p2, k3 only; undistort the images and write zeros");
    }
  }
  const auto at = [&](std::size_t i) { return i < coefficients.size() ? coefficients[i] : 0; };
  return {at(0), at(1), at(2), at(3), at(4)};
}

/// Refuses a distortion that has no inverse somewhere in the image.
void checkDistortion(const PinholeCamera& camera, const StrictMapping& file) {
  constexpr int kSteps = 32;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const double u = (camera.width - 1) * i / double(kSteps);
      const double v = (camera.height - 1) * j / double(kSteps);
      if (!camera.canNormalise(u, v)) {
        file.fail(
            "distortion_coefficients",
            fmt::format("the distortion folds the image over itself at pixel ({:.0f}, {:.0f}); "
                        "are these the coefficients of this camera and image size?",
                        u, v));
      }
    }
  }
}

std::vector<double> matrix(const StrictMapping& file, const std::string& key, std::size_t size) {
  const StrictMapping m = file.mapping(key, {"rows", "cols", "data"});
  const long long rows = m.integer("rows", {1, 4}, ""), cols = m.integer("cols", {1, 100}, "");
  if (size > 0 && static_cast<std::size_t>(rows * cols) != size) {
    m.fail("rows", fmt::format("expected {} elements, got {} x {}", size, rows, cols));
  }
  return m.numbers("data", static_cast<std::size_t>(rows * cols), kNumber, "");
}

/// ROS camera_info. The images are raw, so the rectification and projection matrices play no part.
CameraFile readCameraInfo(const YamlValue& root, const std::string& path) {
  const StrictMapping info(
      root, path, "",
      {"image_width", "image_height", "camera_name", "camera_matrix", "distortion_model",
       "distortion_coefficients", "rectification_matrix", "projection_matrix"});
  PinholeCamera camera;
  camera.width = static_cast<int>(info.integer("image_width", kSide, "px"));
  camera.height = static_cast<int>(info.integer("image_height", kSide, "px"));
  if (info.has("camera_name")) info.text("camera_name");
  const std::vector<double> K = matrix(info, "camera_matrix", 9);
  camera.fx = K[0];
  camera.fy = K[4];
  camera.cx = K[2];
  camera.cy = K[5];
  checkIntrinsics(camera, info, "camera_matrix");
  if (K[1] != 0 || K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1) {
    info.fail("camera_matrix", "expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
  }
  const std::string model =
      info.has("distortion_model") ? info.text("distortion_model") : "plumb_bob";
  checkModel(model, info);
  if (info.has("distortion_coefficients")) {
    camera.distortion = distortionOf(matrix(info, "distortion_coefficients", 0), model, info);
    checkDistortion(camera, info);
  }
  if (info.has("rectification_matrix")) matrix(info, "rectification_matrix", 9);
  if (info.has("projection_matrix")) matrix(info, "projection_matrix", 12);
  return {camera, std::nullopt};
}

Eigen::Isometry3d poseOf(const StrictMapping& file) {
  const std::vector<double> T = matrix(file, "T_BS", 16);
  Eigen::Isometry3d pose;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) pose.matrix()(i, j) = T[static_cast<std::size_t>(4 * i + j)];
  }
  const Eigen::Matrix3d R = pose.linear();
  constexpr double kRounded = 1e-3;  // files hold few digits
  if (!(R * R.transpose()).isIdentity(kRounded) || R.determinant() < 0 || T[12] != 0 ||
      T[13] != 0 || T[14] != 0 || T[15] != 1) {
    file.fail("T_BS", "expected a pose: [R t; 0 0 0 1] with a rotation R, row by row");
  }
  pose.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  return pose;
}

const std::vector<std::string>& eurocKeys() {
  static const std::vector<std::string> keys = {
      "sensor_type", "comment",          "T_BS",
      "rate_hz",     "resolution",       "camera_model",
      "intrinsics",  "distortion_model", "distortion_coefficients"};
  return keys;
}

CameraFile readEurocCamera(const YamlValue& root, const std::string& path) {
  const StrictMapping sensor(root, path, "", eurocKeys());
  if (sensor.has("camera_model") && sensor.text("camera_model") != "pinhole") {
    sensor.fail("camera_model", "expected pinhole");
  }
  PinholeCamera camera;
  const std::vector<double> size = sensor.numbers("resolution", 2, kSide, "px");
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  const std::vector<double> K = sensor.numbers("intrinsics", 4, kNumber, "px");
  camera.fx = K[0];
  camera.fy = K[1];
  camera.cx = K[2];
  camera.cy = K[3];
  checkIntrinsics(camera, sensor, "intrinsics");
  const std::string model =
      sensor.has("distortion_model") ? sensor.text("distortion_model") : "radial-tangential";
  checkModel(model, sensor);
  if (sensor.has("distortion_coefficients")) {
    camera.distortion =
        distortionOf(sensor.numbers("distortion_coefficients", 0, kNumber, ""), model, sensor);
    checkDistortion(camera, sensor);
  }
  return {camera, poseOf(sensor)};
}

}  // namespace

std::optional<PinholeCamera> cameraPreset(const std::string& name) {
  for (const CameraPreset& preset : presets()) {
    if (name == preset.name) return preset.camera;
  }
  return std::nullopt;
}

std::vector<std::string> cameraPresetNames() {
  std::vector<std::string> names;
  for (const CameraPreset& preset : presets()) names.push_back(preset.name);
  return names;
}

CameraFile readCamera(const std::string& path) {
  if (isXml(path)) return {readVispCamera(path), std::nullopt};
  YamlValue root = loadYaml(path);
  return root.find("T_BS") || root.find("intrinsics") ? readEurocCamera(root, path)
                                                      : readCameraInfo(root, path);
}

CameraFile parseCamera(const std::string& text, const std::string& file) {
  return readCameraInfo(parseYaml(text, file), file);
}

Eigen::Isometry3d readEurocPose(const std::string& path) {
  const YamlValue root = loadYaml(path);
  return poseOf(StrictMapping(root, path, "", eurocKeys()));
}

}  // namespace depthservo::detail
