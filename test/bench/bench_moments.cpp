// Cost of three moment features of four points, interaction matrices included: FeatureMoments,
// which also fits the plane, and ViSP's own chain with a plane that is given, each alone and with
// computeControlLaw.
#include <benchmark/benchmark.h>
#include <unistd.h>
#include <visp3/core/vpMomentArea.h>
#include <visp3/core/vpMomentAreaNormalized.h>
#include <visp3/core/vpMomentBasic.h>
#include <visp3/core/vpMomentCentered.h>
#include <visp3/core/vpMomentDatabase.h>
#include <visp3/core/vpMomentGravityCenter.h>
#include <visp3/core/vpMomentObject.h>
#include <visp3/core/vpPoint.h>
#include <visp3/visual_features/vpFeatureMomentArea.h>
#include <visp3/visual_features/vpFeatureMomentAreaNormalized.h>
#include <visp3/visual_features/vpFeatureMomentBasic.h>
#include <visp3/visual_features/vpFeatureMomentCentered.h>
#include <visp3/visual_features/vpFeatureMomentDatabase.h>
#include <visp3/visual_features/vpFeatureMomentGravityCenter.h>
#include <visp3/vs/vpServo.h>

#include <cstdlib>
#include <vector>

#include "depthservo/features/FeatureMoments.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

/// One thread in the linear algebra. Its libraries read the environment when they are loaded,
/// before any code of this program: so set it and start over.
__attribute__((constructor)) void pinThreads(int, char** argv, char**) {
  if (std::getenv("OPENBLAS_NUM_THREADS") && std::getenv("OMP_NUM_THREADS")) return;
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  setenv("OMP_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

const Eigen::Vector3d kPlane(.3, -.2, .8);
const double kCorners[4][2] = {{-.1, -.12}, {.15, -.1}, {.12, .1}, {-.13, .09}};

double chiAt(double x, double y) { return kPlane.dot(Eigen::Vector3d(x, y, 1)); }

/// What a ViSP user writes: moments and features in the order of their dependence, since
/// vpFeatureMomentDatabase::updateAll runs them in parallel.
class VispChain {
 public:
  VispChain()
      : object_(3),
        basicFeature(moments_, kPlane[0], kPlane[1], kPlane[2], &features_),
        centreFeature(moments_, kPlane[0], kPlane[1], kPlane[2], &features_),
        centredFeature(moments_, kPlane[0], kPlane[1], kPlane[2], &features_),
        areaFeature(moments_, kPlane[0], kPlane[1], kPlane[2], &features_),
        sizeFeature(moments_, kPlane[0], kPlane[1], kPlane[2], &features_),
        size_(1, 1) {
    object_.setType(vpMomentObject::DISCRETE);
    for (const auto& [x, y] : kCorners) {
      vpPoint point;
      point.set_x(x);
      point.set_y(y);
      points_.push_back(point);
    }
    object_.fromVector(points_);
    basic_.linkTo(moments_);
    centre_.linkTo(moments_);
    centred_.linkTo(moments_);
    area_.linkTo(moments_);
    size_.linkTo(moments_);
    basicFeature.linkTo(features_);
    centreFeature.linkTo(features_);
    centredFeature.linkTo(features_);
    areaFeature.linkTo(features_);
    sizeFeature.linkTo(features_);
    update();
  }

  void update() {
    object_.fromVector(points_);
    moments_.updateAll(object_);
    centre_.compute();
    centred_.compute();
    area_.compute();
    size_.compute();
    const double A = kPlane[0], B = kPlane[1], C = kPlane[2];
    basicFeature.update(A, B, C);
    centreFeature.update(A, B, C);
    centredFeature.update(A, B, C);
    areaFeature.update(A, B, C);
    sizeFeature.update(A, B, C);
  }

 private:
  vpMomentObject object_;
  vpMomentDatabase moments_;
  vpFeatureMomentDatabase features_;

 public:
  vpFeatureMomentBasic basicFeature;
  vpFeatureMomentGravityCenter centreFeature;
  vpFeatureMomentCentered centredFeature;
  vpFeatureMomentArea areaFeature;
  vpFeatureMomentAreaNormalized sizeFeature;

 private:
  vpMomentBasic basic_;
  vpMomentGravityCenter centre_;
  vpMomentCentered centred_;
  vpMomentArea area_;
  vpMomentAreaNormalized size_;
  std::vector<vpPoint> points_;
};

class OurMoments {
 public:
  OurMoments() : feature(1) {
    for (const auto& [x, y] : kCorners) {
      DepthEstimate point;
      point.x = x;
      point.y = y;
      point.chi = chiAt(x, y);
      point.sigma_chi = .01;
      points_.push_back(point);
    }
    update();
  }
  void update() { feature.update(points_); }

  FeatureMoments feature;

 private:
  std::vector<DepthEstimate> points_;
};

void BM_viSPsChain(benchmark::State& state) {
  VispChain visp;
  for (auto _ : state) {
    visp.update();
    benchmark::DoNotOptimize(visp.centreFeature.interaction());
    benchmark::DoNotOptimize(visp.sizeFeature.interaction());
  }
}
BENCHMARK(BM_viSPsChain);

void BM_featureMoments(benchmark::State& state) {
  OurMoments ours;
  for (auto _ : state) {
    ours.update();
    benchmark::DoNotOptimize(ours.feature.interaction());
  }
}
BENCHMARK(BM_featureMoments);

void setUp(vpServo& task) {
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(.5);
}

void BM_viSPsChainWithControl(benchmark::State& state) {
  VispChain visp, desired;
  vpServo task;
  setUp(task);
  task.addFeature(visp.centreFeature, desired.centreFeature);
  task.addFeature(visp.sizeFeature, desired.sizeFeature);
  for (auto _ : state) {
    visp.update();
    benchmark::DoNotOptimize(task.computeControlLaw());
  }
}
BENCHMARK(BM_viSPsChainWithControl);

void BM_featureMomentsWithControl(benchmark::State& state) {
  OurMoments ours, desired;
  vpServo task;
  setUp(task);
  task.addFeature(ours.feature, desired.feature);
  for (auto _ : state) {
    ours.update();
    benchmark::DoNotOptimize(task.computeControlLaw());
  }
}
BENCHMARK(BM_featureMomentsWithControl);

/// Not a benchmark of speed: that both chains compute the same.
void BM_largestDifferenceFromViSP(benchmark::State& state) {
  VispChain visp;
  OurMoments ours;
  double largest = 0;
  for (auto _ : state) {
    const vpMatrix L = ours.feature.interaction();
    const vpMatrix centre = visp.centreFeature.interaction(), size = visp.sizeFeature.interaction();
    for (unsigned j = 0; j < 6; ++j) {
      largest = std::max({largest, std::abs(L[0][j] - centre[0][j]),
                          std::abs(L[1][j] - centre[1][j]), std::abs(L[2][j] - size[0][j])});
    }
  }
  state.counters["largest"] = largest;
}
BENCHMARK(BM_largestDifferenceFromViSP)->Iterations(1);

}  // namespace
}  // namespace depthservo
