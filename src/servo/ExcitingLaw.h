#pragma once

#include <memory>

#include "robots/cameraJacobian.h"
#include "servo/ControlLaw.h"

namespace depthservo {

/// A law with a small motion across the line of sight on top, while and only while depths are not
/// known: from the moment a point that is unexcited or converging has a sigma_Z above 10 % of Z
/// until all are below 5 %.
///
/// The camera circles at 0.5 Hz, and of all velocities that do this the robot takes those by which
/// the points move least: a free camera keeps looking at them, which is the null space of the task
/// where there is one. A task that asks for more than the robot can is slowed down first, so that
/// the circle keeps its speed.
///
/// By itself the motion displaces a point by at most a third of the limit, whatever its depth
/// within two sigma, and turns back there. The rest is for the task, which takes the displacement
/// back and so carries the point to the other side when the motion turns round, and for drives that
/// lag. A law that does not look at the points takes nothing back: there the camera returns at the
/// end.
class ExcitingLaw : public ControlLaw {
 public:
  ExcitingLaw(std::unique_ptr<ControlLaw> law, const LawSetup& setup,
              const PointFeatures& features);

  Velocities command(const ControlInput& now) override;
  std::optional<Velocities> between(const ControlInput& now) override;
  bool usesFeatures() const override { return law_->usesFeatures(); }
  const char* activity() const override;

 private:
  bool isNeeded() const;
  Velocities excitation(const CameraJacobian& J, double dt);
  Velocities limited(const Velocities& velocity, const CameraJacobian& J,
                     const Velocities& limits) const;
  double shareWithinLimit(const Vector6d& step) const;
  void carryAlong(const RobotModel& robot, double dt);

  std::unique_ptr<ControlLaw> law_;
  const PointFeatures& features_;
  double speed_, reach_;  // [m/s], [-] normalised
  double period_s_;       // of the images, before the second
  double lastTime_s_ = -1, phase_ = 0;
  Vector6d displacement_ = Vector6d::Zero();  // of the camera by all excitation [m, rad]
  bool isOn_ = false, isReturning_ = false;
  Velocities added_;  // velocities, n; none before the first command
};

}  // namespace depthservo
