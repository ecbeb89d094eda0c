#pragma once

#include <cmath>

#include "depthservo/depth/ErrorProfile.h"

namespace depthservo {

/// Noise of which a part is anew in each image and a part lasts.
struct NoiseLevel {
  double white = 0;     ///< 1 sigma, in the unit of what errs
  GaussMarkov lasting;  ///< likewise

  /// 1 sigma of a single value.
  double sigma() const { return std::hypot(white, lasting.sigma); }

  /// Its variance where it is taken for white noise of images dt [s] apart; 0: of one image.
  double asWhite(double dt) const {
    const double times = dt > 0 ? lasting.asWhite(dt) : 1;
    return white * white + times * lasting.sigma * lasting.sigma;
  }
};

/// Errors of where points are seen, per axis.
struct MeasurementNoise {
  NoiseLevel pixel_px;               ///< of each point
  NoiseLevel position_m, angle_rad;  ///< of the pose of each image: common to its points

  /// As a profile has it; what is white of the pixels is told with each measurement.
  static MeasurementNoise of(const ErrorProfile& errors) {
    const auto ofPose = [&](double sigma) {
      return errors.poseTau_s > 0 ? NoiseLevel{0, {sigma, errors.poseTau_s}}
                                  : NoiseLevel{sigma, {}};
    };
    return {{0, errors.wander_px}, ofPose(errors.position_m), ofPose(errors.angle_rad)};
  }
};

}  // namespace depthservo
