#include <gtest/gtest.h>

#include "depthservo/pose/PoseRegulation.h"
#include "depthservo/pose/VisualMotionObserver.h"
#include "support/AllocationCounter.h"

namespace depthservo {
namespace {

TEST(VisualMotionObserver, doesNotAllocateInTheLoop) {
  const std::vector<Eigen::Vector3d> points{
      {.5, .5, .5}, {-.5, .5, .5}, {-.5, -.5, .5}, {.5, -.5, .5}};
  VisualMotionObserverOptions options;
  Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
  cMo.translation().z() = 1.5;
  options.cMo = cMo;
  options.coupledGoal = cMo;
  options.method = ImageErrorMethod::iterated;
  VisualMotionObserver observer(points, options);
  const PoseRegulation regulation(cMo);
  MotionBuffer odometry(128);
  std::vector<PointObservation> image(4);
  const std::size_t before = test::allocations();
  double sum = 0;
  for (int i = 0; i < 100000; ++i) {
    const double t = i / 30.;
    odometry.push(t, regulation.command(observer.cMo()));
    observer.advance(odometry, t);
    for (int id = 0; id < 4; ++id) {
      const Eigen::Vector3d cP = cMo * points[static_cast<std::size_t>(id)];
      image[static_cast<std::size_t>(id)] = {id, {cP.x() / cP.z(), cP.y() / cP.z(), 1e-3}};
    }
    if (i % 7 != 0) observer.correct(image);
    for (int id = 0; id < 4; ++id) sum += observer.estimate(id).Z();
    if (i % 1000 == 0) observer.reset(cMo);
  }
  EXPECT_EQ(test::allocations() - before, 0u);
  EXPECT_GT(sum, 0);
}

}  // namespace
}  // namespace depthservo
