#pragma once

#include <visp3/core/vpColVector.h>
#include <visp3/core/vpMatrix.h>
#include <visp3/visual_features/vpBasicFeature.h>

#include <iostream>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/motion/ToldMotion.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

namespace detail {
/// \return a motion that is not usable where the twist is not
DEPTHSERVO_API Motion motionOf(const DEPTHSERVO_VISP vpColVector& twist, double dt);

/// One line; nothing before the first estimate.
DEPTHSERVO_API void describeDepth(std::ostream& out, const DepthEstimate& estimate);
}  // namespace detail

/// What the drop-ins for ViSP's features have in common: `observe`, and what they override. See
/// FeaturePoint for the loop they stand in; the order is the same: set the feature, `observe`,
/// computeControlLaw. Until the first `observe` everything is as with ViSP's own feature. An
/// `observe` before which the feature was not set predicts: it is hidden, and moves to where it
/// must be.
///
/// Real-time: `observe` does not allocate, throw, lock or print. What reaches ViSP is finite.
template <typename VispFeature>
class ObservingFeature : public VispFeature {
 public:
  using VispFeature::error;
  using VispFeature::interaction;

  ObservingFeature() = default;
  ObservingFeature(const ObservingFeature& other) : VispFeature() { *this = other; }
  ObservingFeature& operator=(const ObservingFeature& other) {
    if (this == &other) return *this;
    static_cast<DEPTHSERVO_VISP vpBasicFeature&>(*this) =
        other;  // vpFeatureLuminance's own does not
    VispFeature::operator=(other);
    this->deallocate = VispFeature::user;  // this object belongs to whoever declared it
    for (unsigned i = 0; i < this->nbParameters; ++i) this->flags[i] = other.flags[i];
    motion_ = other.motion_;
    interactionAsked_ = other.interactionAsked_;
    depthUnused_ = other.depthUnused_;
    return *this;
  }

  /// Takes the camera twist (6: vx vy vz wx wy wz [m/s, rad/s], camera frame) that was applied for
  /// dt [s] since the previous image, and the feature as set since then. A twist of another size, a
  /// value that is not finite or dt <= 0 is counted (`refused`): the motion of that time (of the
  /// last dt that could be used) is unknown. The depth coasts with a sigma that grows as
  /// `setUnknownMotion` allows, measured or not, and measurements say where the feature is, nothing
  /// of its depth. \rtsafe
  void observe(const DEPTHSERVO_VISP vpColVector& twist, double dt) {
    observe(detail::motionOf(twist, dt));
  }
  /// The same from the motion itself. \rtsafe
  void observe(const Motion& motion) { follow(motion_.take(motion)); }

  /// How the camera may move while its motion is unknown. \rtsafe
  void setUnknownMotion(const UnknownMotion& bounds) { motion_.setBounds(bounds); }

  /// True when the task computes errors with this feature without ever asking for its interaction
  /// matrix, as vpServo does in its default mode DESIRED and in USER_DEFINED: the observed depth is
  /// then not used.
  bool depthUnused() const { return depthUnused_; }

  /// Calls of `observe` whose twist or dt could not be used.
  unsigned refused() const { return motion_.refused(); }

  /// For how long, up to the last `observe`, the twists could not be used [s]; 0 while they can.
  double unknownFor_s() const { return motion_.unknownFor_s(); }

  void init() override {
    VispFeature::init();
    motion_ = {};
    interactionAsked_ = depthUnused_ = false;
    forget();
  }

  DEPTHSERVO_VISP vpMatrix interaction(unsigned int select = VispFeature::FEATURE_ALL) override {
    interactionAsked_ = true;
    makeUsable();
    this->setFlags();  // what was observed was not set: ViSP's debug builds would warn
    DEPTHSERVO_VISP vpMatrix L = VispFeature::interaction(select);
    this->resetFlags();
    return L;
  }

  DEPTHSERVO_VISP vpColVector error(const DEPTHSERVO_VISP vpBasicFeature& s_star,
                                    unsigned int select = VispFeature::FEATURE_ALL) override {
    depthUnused_ = !interactionAsked_;
    interactionAsked_ = false;
    meet(s_star);
    return VispFeature::error(s_star, select);
  }

  void print(unsigned int select = VispFeature::FEATURE_ALL) const override {
    VispFeature::print(select);
    describe(std::cout);
  }

 protected:
  /// \param motion as ToldMotion takes it; of no duration while nothing is known \rtsafe
  virtual void follow(const Motion& motion) = 0;
  virtual void forget() = 0;      ///< all that was observed
  virtual void makeUsable() = 0;  ///< before ViSP computes an interaction matrix
  virtual void meet(const DEPTHSERVO_VISP vpBasicFeature&) {}  ///< the desired feature
  virtual void describe(std::ostream&) const = 0;  ///< what was observed; nothing before

  ToldMotion motion_;

 private:
  bool interactionAsked_ = false, depthUnused_ = false;
};

}  // namespace depthservo
