#pragma once

#include <Eigen/Core>
#include <string>

#include "depthservo/api.h"
#include "depthservo/motion/Motion.h"

namespace depthservo {

/// Why a camera's motion tells nothing of a point's depth or of the focal length.
enum class Hindrance {
  none,              ///< it does tell
  noMotion,          ///< the camera is at rest
  noTranslation,     ///< depth: it only turns about its optical centre
  alongLineOfSight,  ///< depth: it moves within 6 degrees of the direction to the point
  tooSlow,           ///< it moves or turns the right way, but not enough
  noRotation,        ///< focal length: it does not turn
  opticalAxisOnly,   ///< focal length: it turns about the optical axis only
  radialOnly,        ///< focal length: the point only moves to and from the middle of the image
};

/// In words: "no translation", "moving along the line of sight of point 3", "rotation about the
/// optical axis only".
DEPTHSERVO_API std::string describe(Hindrance hindrance, int point);

/// What the camera's recent motion can tell, and if nothing, why: windowed mean squares of its
/// twist. Depth is told by translation across the line of sight, with speed
///     W = |(-vx + x vz, -vy + y vz)|,
/// a focal length by rotation about x or y (De Luca, Oriolo, Robuffo Giordano 2008, sec. 3.2, 5).
/// Whether that suffices is the estimator's to say (status `unexcited`); this names the cause.
///
/// Real-time: nothing allocates or throws but `describe`; unusable motions are ignored.
class DEPTHSERVO_API Excitation {
 public:
  struct Options {
    double window_s = 1;     ///< forgetting
    double speed = 2e-3;     ///< below it the camera does not translate [m/s]
    double turnRate = 2e-3;  ///< below it the camera does not turn [rad/s]
  };

  Excitation();
  explicit Excitation(const Options& options);

  /// The camera's motion since the last call. \rtsafe
  void add(const Motion& motion);

  double speed() const;                     ///< root mean square of |v| [m/s] \rtsafe
  double turnRate() const;                  ///< root mean square of |w| [rad/s] \rtsafe
  double across(double x, double y) const;  ///< root mean square of W of (x, y) [m/s] \rtsafe

  /// What hinders the depth of the point (x, y), given that it cannot be learnt. \rtsafe
  Hindrance ofDepth(double x, double y) const;

  /// What hinders the focal length from the point (x, y), given that it cannot be learnt. \rtsafe
  Hindrance ofFocal(double x, double y) const;

 private:
  Options options_;
  Eigen::Matrix3d linear_ = Eigen::Matrix3d::Zero();   // mean of v v^T
  Eigen::Matrix3d angular_ = Eigen::Matrix3d::Zero();  // mean of w w^T
  double filled_ = 0;                                  // share of the window seen
};

}  // namespace depthservo
