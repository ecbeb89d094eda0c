// Image-based visual servoing of four points with ViSP alone. The depth of the points is not known:
// it is set to a constant, three times the true one, as many programs do. Compare with
// fourPointsObserved.cpp.
#include <depthservo/visp/using.h>
#include <visp3/core/vpExponentialMap.h>
#include <visp3/core/vpPoint.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

#include <algorithm>
#include <cmath>
#include <iostream>

int main() {
  const double dt = 1. / 30;
  const vpCameraParameters cam(600, 600, 320, 240);
  const vpHomogeneousMatrix cdMo(0, 0, 0.5, 0, 0, 0);  // the goal: 0.5 m before the target

  vpHomogeneousMatrix wMc(vpTranslationVector(0.35, -0.25, -0.9),
                          vpRotationMatrix(vpThetaUVector(0.2, 0.3, 0.4)));  // of a free camera

  vpPoint target[4] = {vpPoint(-0.1, -0.1, 0), vpPoint(0.1, -0.1, 0), vpPoint(0.1, 0.1, 0),
                       vpPoint(-0.1, 0.1, 0)};
  vpFeaturePoint s[4];  // before the task, which refers to them to its end
  vpFeaturePoint sd[4];

  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(0.3);
  for (int i = 0; i < 4; ++i) {
    target[i].track(cdMo);
    vpFeatureBuilder::create(sd[i], target[i]);
    s[i].set_Z(3.0);
    task.addFeature(s[i], sd[i]);
  }

  vpColVector v(6, 0.);
  int frame = 0;
  double error = 1, path = 0;
  for (; frame < 1500 && error > 1e-3; ++frame) {
    for (int i = 0; i < 4; ++i) {
      target[i].track(wMc.inverse());  // stands for the tracker in the image
      const vpImagePoint pixel(240 + 600 * target[i].get_y(), 320 + 600 * target[i].get_x());
      vpFeatureBuilder::create(s[i], cam, pixel);
    }
    v = task.computeControlLaw();
    error = task.getError().frobeniusNorm();
    wMc = wMc * vpExponentialMap::direct(v, dt);
    path += dt * std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }

  double worst = 0;
  for (int i = 0; i < 4; ++i) {
    worst = std::max(worst, std::fabs(s[i].get_Z() / target[i].get_Z() - 1));
  }
  std::cout << (error <= 1e-3 ? "converged" : "not converged") << " after " << frame * dt
            << " s, image error " << error << ", path " << path << " m, worst depth wrong by "
            << 100 * worst << " %" << std::endl;
}
