#pragma once

#include <visp3/visual_features/vpFeatureLuminance.h>

#include <Eigen/Core>
#include <memory>

#include "depthservo/api.h"
#include "depthservo/depth/ErrorProfile.h"
#include "depthservo/features/ObservedPlane.h"
#include "depthservo/features/ObservingShapeFeature.h"

namespace depthservo {

/// A vpFeatureLuminance (photometric servo: Collewet, Marchand, IEEE T-RO 2011) whose pixels get
/// the depths of the plane 1/Z = A x + B y + C, observed from the images themselves: at every image
/// the plane is the one with which the image before, moved by the camera's motion, becomes this one
/// best.
///
///     depthservo::FeatureLuminance s;               // was: vpFeatureLuminance s;
///     s.init(I.getHeight(), I.getWidth(), guess);   // unchanged; any guess
///     s.setCameraParameters(cam);                   // unchanged; without distortion
///     ...
///     s.buildFrom(I);                               // unchanged
///     s.observe(v, dt);                             // new: sets Z of every pixel
///     v = task.computeControlLaw();                 // unchanged
///
/// The motion between two images must not be far beyond what the image is smooth over. Errors of
/// the odometry count as far as they are white, of scale, or of focal length. An image that is
/// exactly the one before is taken for none: the plane is predicted. Where points of the plane are
/// observed, `update` takes their plane instead. The depth of `estimate` is that on the optical
/// axis. `observe` allocates nothing; `init` does.
class DEPTHSERVO_API FeatureLuminance
    : public ObservingShapeFeature<DEPTHSERVO_VISP vpFeatureLuminance> {
 public:
  FeatureLuminance();
  FeatureLuminance(const FeatureLuminance& other);
  FeatureLuminance& operator=(const FeatureLuminance& other);
  ~FeatureLuminance() override;

  /// As ViSP's. \param Z the guess [m]
  void init(unsigned rows, unsigned columns, double Z);
  void init() override { ObservingShapeFeature::init(); }

  /// As of FeaturePoint.
  void setErrors(const ErrorProfile& errors) { errors_ = errors; }

  /// Takes the plane of observed points, instead of `observe`. \rtsafe
  void update(const ObservedPlane& plane);

  /// (A, B, C) as observed [1/m], and its covariance.
  const Eigen::Vector3d& abc() const { return abc_; }
  const Eigen::Matrix3d& covariance() const { return P_; }

  FeatureLuminance* duplicate() const override { return new FeatureLuminance(*this); }

 protected:
  void follow(const Motion& motion) override;
  void forget() override;

 private:
  class Images;

  bool predict(const Motion& motion);
  bool align(const Motion& motion);
  void describePlane(const Motion& motion, bool isAligned);
  void show(const Eigen::Vector3d& abc);
  bool isAhead(const Eigen::Vector3d& abc) const;

  std::unique_ptr<Images> images_;
  ErrorProfile errors_ = ErrorProfile::arm();
  Eigen::Vector3d abc_ = Eigen::Vector3d::UnitZ();
  Eigen::Matrix3d P_ = Eigen::Matrix3d::Identity();
};

}  // namespace depthservo
