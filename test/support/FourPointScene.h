#pragma once

#include <visp3/core/vpCameraParameters.h>
#include <visp3/core/vpPoint.h>
#include <visp3/robot/vpSimulatorCamera.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

#include <array>
#include <functional>
#include <vector>

#include "depthservo/visp/using.h"

namespace depthservo::test {

constexpr double kPeriod_s = 1.0 / 30;

/// ViSP's simulated 6-dof camera before a square of four points, about 1 m away; goal at 0.5 m.
class FourPointScene {
 public:
  FourPointScene()
      : FourPointScene(vpHomogeneousMatrix(vpTranslationVector(.12, -.08, -1.),
                                           vpRotationMatrix(vpThetaUVector(.1, -.15, .25)))) {}

  /// \param wMc where the camera starts, in the frame of the square
  explicit FourPointScene(const vpHomogeneousMatrix& wMc) {
    robot_.setSamplingTime(kPeriod_s);
    robot_.setPosition(wMc);
  }

  vpHomogeneousMatrix cMo() { return robot_.getPosition().inverse(); }

  /// Point i as the camera sees it now: get_x(), get_y(), get_Z().
  vpPoint seen(std::size_t i) { return at(i, robot_.getPosition().inverse()); }
  vpPoint desired(std::size_t i) const { return at(i, vpHomogeneousMatrix(0, 0, .5, 0, 0, 0)); }

  /// Moves for one period; returns the twist really applied, within the robot's limits.
  vpColVector apply(const vpColVector& v) {
    vpColVector limits(6, robot_.getMaxTranslationVelocity());
    for (unsigned j = 3; j < 6; ++j) limits[j] = robot_.getMaxRotationVelocity();
    const vpColVector applied = vpRobot::saturateVelocities(v, 0.999 * limits);
    robot_.setVelocity(vpRobot::CAMERA_FRAME, applied);
    return applied;
  }

  /// Point i from any pose.
  static vpPoint at(std::size_t i, const vpHomogeneousMatrix& cMo) {
    constexpr double h = 0.08;
    vpPoint p(i == 1 || i == 2 ? h : -h, i > 1 ? h : -h, 0);
    p.track(cMo);
    return p;
  }

 private:
  vpSimulatorCamera robot_;
};

struct ServoOutcome {
  std::vector<vpColVector> commands;
  double error = 0;                       // norm of s - s* at the end
  std::array<double, 4> relativeDepth{};  // used Z / true Z - 1 at the end
};

/// A whole servo run. `observe(i, v)` is called for feature i after its x and y were set, with the
/// twist applied since the previous image.
template <typename Features>
ServoOutcome servo(Features& s, vpServo::vpServoIteractionMatrixType type, int frames,
                   const std::function<void(std::size_t, const vpColVector&)>& observe = {}) {
  const vpCameraParameters cam(600, 600, 320, 240);
  FourPointScene scene;
  std::vector<vpFeaturePoint> s_star(4);
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(type);
  task.setLambda(0.8);
  for (std::size_t i = 0; i < 4; ++i) {
    vpPoint p = scene.desired(i);
    vpFeatureBuilder::create(s_star[i], p);
    task.addFeature(s[i], s_star[i]);
  }
  ServoOutcome outcome;
  vpColVector v(6, 0.);
  for (int k = 0; k < frames; ++k) {
    for (std::size_t i = 0; i < 4; ++i) {
      const vpPoint p = scene.seen(i);
      vpFeatureBuilder::create(s[i], cam,
                               vpImagePoint(240 + 600 * p.get_y(), 320 + 600 * p.get_x()));
    }
    for (std::size_t i = 0; observe && i < 4; ++i) observe(i, v);
    const vpColVector command = task.computeControlLaw();
    outcome.commands.push_back(command);
    outcome.error = task.getError().frobeniusNorm();
    for (std::size_t i = 0; i < 4; ++i) {
      outcome.relativeDepth[i] = s[i].get_Z() / scene.seen(i).get_Z() - 1;
    }
    v = scene.apply(command);
  }
  return outcome;
}

}  // namespace depthservo::test
