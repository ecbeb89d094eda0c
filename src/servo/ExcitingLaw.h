#pragma once

#include <memory>

#include "servo/ControlLaw.h"

namespace depthservo {

/// A law with a small motion across the line of sight on top, while and only while depths are not
/// known: from the moment a point that is unexcited or converging has a sigma_Z above 10 % of Z
/// until all are below 5 %.
///
/// The camera circles at 0.5 Hz, and does besides whatever makes the points move least: it keeps
/// looking at them, which is the null space of the task where there is one. Where the law asks for
/// more than the robot can, it leaves the motion its share.
///
/// By itself the motion may displace a point by half the limit, whatever its depth within two
/// sigma; the other half is for the task, which takes the displacement back and so carries the
/// point as far to the other side when the motion turns round. A law that does not look at the
/// points takes nothing back: then the camera returns by itself when the motion ends.
class ExcitingLaw : public ControlLaw {
 public:
  ExcitingLaw(std::unique_ptr<ControlLaw> law, const Scenario& scenario,
              const FeaturePointGroup& features);

  Eigen::VectorXd command(const ControlInput& now) override;
  std::optional<Eigen::VectorXd> between(const ControlInput& now) override;
  bool usesFeatures() const override { return law_->usesFeatures(); }
  std::string state() const override;

 private:
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  bool isNeeded() const;
  Eigen::VectorXd excitation(const Eigen::MatrixXd& J, double dt);
  Eigen::VectorXd limited(const Eigen::VectorXd& velocity, const Eigen::MatrixXd& J,
                          const CameraRobot& robot) const;
  double shareWithinLimit(const Vector6d& step) const;
  Eigen::VectorXd excited(const Eigen::VectorXd& command, const CameraRobot& robot) const;
  void carryAlong(const CameraRobot& robot, double dt);

  std::unique_ptr<ControlLaw> law_;
  const FeaturePointGroup& features_;
  double speed_, reach_;  // [m/s], [-] normalised
  double period_s_;       // of the images, before the second
  double lastTime_s_ = -1, phase_ = 0;
  Vector6d displacement_ = Vector6d::Zero();  // of the camera by all excitation [m, rad]
  bool isOn_ = false;
  Eigen::VectorXd added_;  // velocities
};

}  // namespace depthservo
