#pragma once

#include <memory>

#include "servo/ControlLaw.h"

namespace depthservo {

/// A law with a small motion across the line of sight on top, while and only while depths are not
/// known: from the moment a point that is unexcited or converging has a sigma_Z above 10 % of Z
/// until all are below 5 %.
///
/// The motion turns in the image plane at 0.5 Hz. It is taken from the null space of the task where
/// there is enough of it, so that the points stay where they are; otherwise it displaces them, by
/// what the greatest chi + 2 sigma_chi of them allows within the declared limit.
class ExcitingLaw : public ControlLaw {
 public:
  ExcitingLaw(std::unique_ptr<ControlLaw> law, const Scenario& scenario,
              const FeaturePointGroup& features);

  Eigen::VectorXd command(const ControlInput& now) override;
  std::optional<Eigen::VectorXd> between(const ControlInput& now) override {
    return law_->between(now);
  }
  bool usesFeatures() const override { return law_->usesFeatures(); }
  std::string state() const override;

 private:
  bool isNeeded() const;
  Eigen::VectorXd excitation(const ControlInput& now, double dt);

  std::unique_ptr<ControlLaw> law_;
  const FeaturePointGroup& features_;
  double speed_, limit_;  // [m/s], [-] normalised
  double period_s_;       // of the images, before the second
  double lastTime_s_ = -1, phase_ = 0;
  Eigen::Vector3d displacement_ = Eigen::Vector3d::Zero();  // by all excitation [m]
  bool isOn_ = false;
};

}  // namespace depthservo
