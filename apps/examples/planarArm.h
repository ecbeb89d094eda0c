// A planar arm of three revolute joints, for the examples.
#pragma once

#include <depthservo/visp/using.h>
#include <visp3/core/vpHomogeneousMatrix.h>

#include <array>

constexpr double kLinks[3] = {0.30, 0.35, 0.15};  // m

/// Frames of the arm in the world: the base of each link, then the end effector.
inline std::array<vpHomogeneousMatrix, 4> frames(const vpColVector& q) {
  std::array<vpHomogeneousMatrix, 4> wMi;
  for (unsigned i = 0; i < 3; ++i) {
    const vpHomogeneousMatrix turn(0, 0, 0, 0, 0, q[i]), link(kLinks[i], 0, 0, 0, 0, 0);
    wMi[i] = wMi[i] * turn;
    wMi[i + 1] = wMi[i] * link;
  }
  return wMi;
}

inline vpHomogeneousMatrix wMe(const vpColVector& q) { return frames(q)[3]; }

/// Twist of the end effector in its own frame by joint velocities: joint i turns about the z axis
/// of link i, which is at (x, y) as seen from the end effector.
inline vpMatrix eJe(const vpColVector& q) {
  const auto wMi = frames(q);
  vpMatrix J(6, 3, 0.);
  for (unsigned i = 0; i < 3; ++i) {
    const vpHomogeneousMatrix eMi = wMi[3].inverse() * wMi[i];
    J[0][i] = eMi[1][3];
    J[1][i] = -eMi[0][3];
    J[5][i] = 1;
  }
  return J;
}
