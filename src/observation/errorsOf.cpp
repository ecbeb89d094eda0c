#include "observation/errorsOf.h"

namespace depthservo {

ErrorKind errorKindOf(const ObservationOptions& options) {
  if (options.depth.errors != ErrorKind::automatic) return options.depth.errors;
  if (options.odometryNoise) return ErrorKind::declared;
  const bool isFromPoses =
      options.motion == MotionSource::groundtruth || options.motion == MotionSource::target;
  return isFromPoses ? ErrorKind::poses : ErrorKind::typical;
}

std::optional<ErrorProfile> errorsOf(const ObservationOptions& options) {
  ErrorProfile profile;
  switch (errorKindOf(options)) {
    case ErrorKind::typical:
      profile = ErrorProfile::typical();
      break;
    case ErrorKind::arm:
      profile = ErrorProfile::arm();
      break;
    case ErrorKind::poses:
      profile = ErrorProfile::poses();
      if (options.motion == MotionSource::target) {  // its pose is measured in each image
        profile.position_m = 0.001;
        profile.angle_rad = 0.002;
      }
      break;
    case ErrorKind::file:
      profile = options.depth.profile;
      break;
    default:
      return std::nullopt;
  }
  if (options.odometryNoise) profile.odometry = *options.odometryNoise;
  if (options.odometryScaleSigma > 0) profile.scale = options.odometryScaleSigma;
  if (options.focalSigma > 0) profile.focal = options.focalSigma;
  return profile;
}

}  // namespace depthservo
