// Observes the depth of a point while the camera moves sideways.
#include <depthservo/depth/NonlinearDepthObserver.h>

#include <cmath>
#include <iostream>

int main() {
  const double Z = 2, speed = 0.2, dt = 1. / 30;  // m, m/s, s
  const double sigma = 1e-4;
  depthservo::NonlinearDepthObserver observer;
  observer.reset({0.1, 0.05, sigma}, {Z / 2});

  const auto motion = depthservo::Motion::fromTwist({{speed, 0, 0}, {0, 0, 0}}, dt);
  for (int k = 1; k <= 300; ++k) {
    observer.predict(motion);
    observer.correct({0.1 - speed * dt * k / Z, 0.05, sigma});
  }

  const double error = std::abs(observer.estimate().Z() / Z - 1);
  std::cout << "relative depth error " << error << '\n';
  return error < 1e-3 ? 0 : 1;
}
