#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "depthservo/observation/RunLog.h"
#include "depthservo/visp/visp.h"

/// Messages of Foxglove's well-known schemas (https://docs.foxglove.dev/docs/sdk/schemas), as JSON.
/// What is not known is left out where the schema allows it; a message never has NaN.
namespace depthservo::foxglove {

using Json = nlohmann::ordered_json;

constexpr const char *kWorld = "world", *kCamera = "camera";  // frames

/// Seconds and nanoseconds of a time not before the epoch, as files hold it: 9 decimals.
struct Time {
  std::uint64_t sec, nsec;
  explicit Time(double time_s);
  std::uint64_t total_ns() const { return sec * 1'000'000'000 + nsec; }
};

enum class Level { info = 2, warning = 3 };

/// A gray image as PNG.
Json compressedImage(double time_s, const DEPTHSERVO_VISP vpImage<unsigned char>& image);
/// Draws the camera's frustum, too.
Json cameraCalibration(double time_s, const PinholeCamera& camera);
Json frameTransform(double time_s, const char* parent, const char* child,
                    const Eigen::Isometry3d& parentFromChild);
Json log(double time_s, Level level, const std::string& name, const std::string& message);

/// Points with a usable estimate in the camera frame: x, y, z [m], sigma and interval of z,
/// covariance, id, status.
Json pointCloud(const FrameRecord& frame);
/// The same to look at: spheres, and the interval of each depth on its line of sight.
Json sceneUpdate(const FrameRecord& frame);
/// Circles on the image: points measured, points predicted (thin), and goals.
Json imageAnnotations(const FrameRecord& frame, const std::vector<Eigen::Vector2d>& goals);

/// Of our own schemas in data/foxglove.
Json depths(const FrameRecord& frame);
Json robot(const FrameRecord& frame, const std::vector<std::string>& velocityNames,
           bool isTwistKnown);

}  // namespace depthservo::foxglove
