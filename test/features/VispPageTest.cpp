// The code of README, doc/visp.md, known-target.md and core.md, block by block, with what each takes for granted.
#include <gtest/gtest.h>
#include <visp3/blob/vpDot2.h>
#include <visp3/core/vpCameraParameters.h>
#include <visp3/robot/vpSimulatorCamera.h>

#include <iostream>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "visp_md/2.inc"

namespace {

[[maybe_unused]] void loop(vpSimulatorCamera& robot, const vpCameraParameters& cam,
                           std::vector<vpDot2>& dot, double dt, const bool& done) {
#include "visp_md/1.inc"
}

[[maybe_unused]] void anotherEstimator() {
#include "visp_md/3.inc"
}

[[maybe_unused]] void eyeToHand(vpServo& task, std::vector<depthservo::FeaturePoint>& s,
                                vpColVector& v, double dt, const vpHomogeneousMatrix& cMe,
                                const vpMatrix& eJe) {
#include "visp_md/4.inc"
}

[[maybe_unused]] void severalAtOnce(const vpColVector& v, double row_s, double image_s) {
#include "visp_md/5.inc"
}

[[maybe_unused]] void moments(vpServo& task, vpColVector& v, double dt) {
#include "depthservo/visp/using.h"
#include "visp_md/6.inc"
}

[[maybe_unused]] void readme(vpServo& task, const vpCameraParameters& cam, std::vector<vpDot2>& dot,
                             double dt) {
#include "readme_md/1.inc"
}

[[maybe_unused]] void knownTarget(vpServo& task, const vpCameraParameters& cam,
                                  std::vector<vpDot2>& dot, std::vector<vpFeaturePoint>& sd,
                                  vpColVector& v, double dt) {
#include "known_target_md/1.inc"
}

struct MyTrack {
  int id;
  double u, v;
};

[[maybe_unused]] void coreAlone(const std::vector<MyTrack>& tracks, double row_s, double image_s,
                                double vx, double vy, double vz, double wx, double wy, double wz) {
#include "core_md/1.inc"
  static_cast<void>(coverage);
}

[[maybe_unused]] void plane(const depthservo::PointFeatures& points,
                            vpFeatureMomentDatabase& features){
#include "visp_md/7.inc"
}

TEST(VispPage, estimatorsOfTheFeaturesAreMade) {
  anotherEstimator();
  severalAtOnce(vpColVector(6, 0.), 0, 0);
}

}  // namespace
