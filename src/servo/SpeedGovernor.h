#pragma once

#include <vector>

#include "depthservo/api.h"
#include "depthservo/features/PointFeatures.h"

namespace depthservo {

/// What a command is based on.
enum class Basis {
  features,  ///< measured, or predicted well enough
  slowed,    ///< the same, but the robot is held back: hidden features are predicted vaguely
  waiting,   ///< the robot stands still: hidden features are predicted too vaguely
  nothing,   ///< a feature is lost
};
DEPTHSERVO_INNER const char* toString(Basis basis);  ///< a sentence

/// Holds the robot back while hidden points are predicted vaguely, without a jerk.
class DEPTHSERVO_INNER SpeedGovernor {
 public:
  /// \param hiddenSigma_px image sigma predicted for a hidden point at which the robot stops; it
  /// goes at full speed up to half of it
  SpeedGovernor(double hiddenSigma_px, double focal_px)
      : hiddenSigma_px_(hiddenSigma_px), focal_px_(focal_px) {}

  /// After an image of this time. \param measured in it
  void update(double time_s, const PointFeatures& features,
              const std::vector<PointObservation>& measured);
  /// The same for a law that does not look at the features.
  void release() { basis_ = Basis::features; }

  Basis basis() const { return basis_; }
  double speed() const { return speed_; }  ///< share of the command that is given, 0..1
  bool isFree() const { return basis_ == Basis::features && speed_ == 1; }

 private:
  double allowedSpeed(const PointFeatures& features,
                      const std::vector<PointObservation>& measured) const;

  double hiddenSigma_px_, focal_px_;
  Basis basis_ = Basis::nothing;
  double speed_ = 1;
  double last_s_ = -1;  // < 0: none before
};

}  // namespace depthservo
