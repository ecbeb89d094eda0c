#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"

namespace depthservo::detail {

/// A published calibration by its name (tum-fr1, ...); none for another name.
std::optional<PinholeCamera> cameraPreset(const std::string& name);
std::vector<std::string> cameraPresetNames();

/// A camera as a file describes it.
struct CameraFile {
  PinholeCamera camera;
  /// Pose of the camera in the body it is mounted on; only EuRoC's sensor.yaml says.
  std::optional<Eigen::Isometry3d> bMc;
};

/// Reads a ROS camera_info, as camera_calibration writes it, or the sensor.yaml of a EuRoC camera.
/// Throws InputError; so it does when the lens distortion folds back within the image.
CameraFile readCamera(const std::string& path);
/// The same of the text of a camera_info. \param file for messages
CameraFile parseCamera(const std::string& text, const std::string& file);

/// T_BS of any EuRoC sensor.yaml: the sensor in the body. Throws InputError.
DEPTHSERVO_INNER Eigen::Isometry3d readEurocPose(const std::string& path);

}  // namespace depthservo::detail
