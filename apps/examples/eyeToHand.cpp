// Eye-to-hand with observed depth: a fixed camera looks at four points that a planar arm of three
// revolute joints carries. As the camera sees it, the points stand still and the camera moves
// against the hand: its twist relative to them is -cVe eJe qdot.
#include <depthservo/features/FeaturePoint.h>
#include <depthservo/features/cameraTwist.h>
#include <visp3/core/vpPoint.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/vs/vpServo.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "planarArm.h"

int main() {
  const double dt = 1. / 30;
  const vpHomogeneousMatrix eMo(0.05, 0.02, 0, 0, 0, M_PI / 2);  // the points on the hand
  const vpHomogeneousMatrix cMw = vpHomogeneousMatrix(0.6, 0.2, -0.9, 0.2, 0, 0).inverse();

  vpColVector q(3), q_goal(3);
  q[0] = -0.2, q[1] = 0.9, q[2] = -0.5;
  q_goal[0] = 0.2, q_goal[1] = 0.5, q_goal[2] = 0.1;

  vpPoint target[4] = {vpPoint(-0.1, -0.1, 0), vpPoint(0.1, -0.1, 0), vpPoint(0.1, 0.1, 0),
                       vpPoint(-0.1, 0.1, 0)};
  depthservo::FeaturePoint s[4];
  vpFeaturePoint sd[4];

  vpServo task;
  task.setServo(vpServo::EYETOHAND_L_cVe_eJe);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(0.8);
  for (int i = 0; i < 4; ++i) {
    target[i].track(cMw * wMe(q_goal) * eMo);
    vpFeatureBuilder::create(sd[i], target[i]);
    s[i].set_Z(2.7);  // a guess, three times the truth
    task.addFeature(s[i], sd[i]);
  }

  vpColVector v(6, 0.);
  int frame = 0;
  double error = 1;
  for (; frame < 900 && error > 1e-3; ++frame) {
    for (int i = 0; i < 4; ++i) {
      target[i].track(cMw * wMe(q) * eMo);  // stands for the tracker in the image
      s[i].set_x(target[i].get_x());
      s[i].set_y(target[i].get_y());
      s[i].observe(v, dt);
    }
    const vpVelocityTwistMatrix cVe(cMw * wMe(q));  // changes with the hand
    task.set_cVe(cVe);
    task.set_eJe(eJe(q));
    const vpColVector qdot = task.computeControlLaw();
    error = task.getError().frobeniusNorm();
    v = -depthservo::cameraTwist(cVe, eJe(q), qdot);
    q += dt * qdot;
  }

  double worst = 0;
  for (int i = 0; i < 4; ++i) {
    worst = std::max(worst, std::fabs(s[i].get_Z() / target[i].get_Z() - 1));
  }
  std::cout << (error <= 1e-3 ? "converged" : "not converged") << " after " << frame * dt
            << " s, image error " << error << ", worst depth wrong by " << 100 * worst << " %"
            << std::endl;
}
