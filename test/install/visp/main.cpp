// A ViSP servo loop with depthservo's feature: four points, the guessed depth three times too
// large.
#include <depthservo/features/FeaturePoint.h>
#include <depthservo/visp/using.h>
#include <visp3/core/vpPoint.h>
#include <visp3/robot/vpSimulatorCamera.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/vs/vpServo.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

int main() {
  const double dt = 1. / 30;  // s
  std::vector<vpPoint> points{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}};
  const vpHomogeneousMatrix cdMo(0, 0, 0.75, 0, 0, 0);
  vpHomogeneousMatrix cMo(0.15, -0.1, 1., 0.1, -0.1, 0.3);
  vpSimulatorCamera robot;
  robot.setSamplingTime(dt);
  robot.setPosition(cMo.inverse());

  depthservo::FeaturePoint s[4];
  vpFeaturePoint s_star[4];
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(0.5);
  for (int i = 0; i < 4; ++i) {
    points[i].track(cdMo);
    vpFeatureBuilder::create(s_star[i], points[i]);
    s[i].set_Z(3);
    task.addFeature(s[i], s_star[i]);
  }

  vpColVector v(6, 0.);
  double depthError = 0;
  for (int k = 0; k < 400; ++k) {
    cMo = robot.getPosition().inverse();
    for (int i = 0; i < 4; ++i) {
      points[i].track(cMo);
      s[i].set_x(points[i].get_x());
      s[i].set_y(points[i].get_y());
      s[i].observe(v, dt);
    }
    v = task.computeControlLaw();
    robot.setVelocity(vpRobot::CAMERA_FRAME, v);
  }
  for (int i = 0; i < 4; ++i)
    depthError = std::max(depthError, std::abs(s[i].get_Z() / points[i].get_Z() - 1));
  const double imageError = task.getError().frobeniusNorm();
  std::cout << "image error " << imageError << ", relative depth error " << depthError << '\n';
  return imageError < 1e-3 && depthError < 0.1 ? 0 : 1;
}
