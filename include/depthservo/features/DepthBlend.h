#pragma once

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"

namespace depthservo {

/// Which depth a task is given.
enum class ServoDepth {
  blended,  ///< the estimate blended with the desired depth; cautious while the estimate is
            ///< doubtful
  observed  ///< the estimate as it is, however vague: the first commands may be many times too fast
};

/// From a depth as estimated to that which a task is given, as FeaturePoint::setServoDepth says.
/// \rtsafe
class DEPTHSERVO_API DepthBlend {
 public:
  explicit DepthBlend(const DepthRange& range = {}) : range_(range) {}

  void setChoice(ServoDepth choice) { choice_ = choice; }

  /// Depth at the goal [m]; what cannot be one is ignored. `meet`: one that was found out, which a
  /// given one overrules.
  void setDesired(double Z);
  void meetDesired(double Z);
  double desired() const { return Z_desired_; }  ///< 0 while unknown

  /// Of a group: the mean of the desired depths that are known, and the largest ratio of a depth to
  /// its cautiousZ, so that depths in doubt keep their proportions. \param Z_ofOthers where this
  /// depth has run to the near end of the range: the median of those that are found; else 0
  void setGroup(double Z_desired, double caution, double Z_ofOthers);

  void forget();  ///< all but choice and range

  double of(const DepthEstimate& estimate) const;  ///< [m], within the range

  const DepthRange& range() const { return range_; }

 private:
  DepthRange range_;
  ServoDepth choice_ = ServoDepth::blended;
  double Z_desired_ = 0;  // [m]; 0 when unknown
  double Z_desiredOfGroup_ = 0, cautionOfGroup_ = 1, Z_ofOthers_ = 0;
  bool isGiven_ = false;
};

/// Whether a task can use a depth: finite and as large as ViSP wants it (1e-6 m).
DEPTHSERVO_API bool isUsableDepth(double Z);

/// Whether a depth that is set anew is another, by its ratio to the one before: by more than half.
DEPTHSERVO_API bool isOtherDepth(double ratio);

/// Keeps a depth that was set as the guess, if it can be one. \return whether it is a new one, that
/// starts the depth anew: by more than half another than the guess before
DEPTHSERVO_API bool takeGuess(double Z, double& guess);

}  // namespace depthservo
