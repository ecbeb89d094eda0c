// Cost and accuracy of the pose of a known target with four points, on the same images: the sampled
// observer, ViSP's virtual visual servoing and OpenCV's solvePnP, each from its previous pose.
//   bench_pose        counters: rms position error [mm] with 0.5 px noise at 800 px focal length
#include <benchmark/benchmark.h>
#include <visp3/vision/vpPose.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

#include "depthservo/pose/VisualMotionObserver.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

constexpr double kDt = 1. / 30, kFocal_px = 800, kSigma = .5 / kFocal_px;
constexpr int kFrames = 600;
const std::vector<Eigen::Vector3d> kPoints{
    {-.02, .12, .10}, {.02, .08, .10}, {-.02, .08, .14}, {.02, .12, .14}};

enum Target { still, moving };

/// Images of a target before a camera at rest; after the last frame the first may follow.
struct Images {
  std::vector<Eigen::Isometry3d> truth;
  std::vector<std::vector<PointObservation>> points;

  explicit Images(Target target) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> noise(0, kSigma);
    for (int i = 0; i < kFrames; ++i) {
      const double phase = target == still ? 0 : 2 * M_PI * i / kFrames;
      Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();
      cMo.translation() << .1 * std::sin(phase), -.1, .4 + .1 * std::sin(2 * phase);
      cMo.linear() = Eigen::AngleAxisd(.4 * std::sin(phase), Eigen::Vector3d::UnitY()).matrix();
      truth.push_back(cMo);
      points.emplace_back();
      for (int id = 0; id < 4; ++id) {
        const Eigen::Vector3d cP = cMo * kPoints[static_cast<std::size_t>(id)];
        points.back().push_back(
            {id, {cP.x() / cP.z() + noise(random), cP.y() / cP.z() + noise(random), kSigma}});
      }
    }
  }
};

const Images& images(Target target) {
  static const Images ofStill(still), ofMoving(moving);
  return target == still ? ofStill : ofMoving;
}

/// Runs one method over the images: first for its accuracy, then for its time.
template <typename Method>
void measure(benchmark::State& state, Method update) {
  for (const Target target : {still, moving}) {
    double sum = 0;
    int count = 0;
    for (int i = 0; i < kFrames; ++i) {
      const Eigen::Vector3d position = update(images(target).points[static_cast<std::size_t>(i)]);
      if (i < kFrames / 10) continue;
      sum += (position - images(target).truth[static_cast<std::size_t>(i)].translation())
                 .squaredNorm();
      ++count;
    }
    state.counters[target == still ? "still_mm" : "moving_mm"] = 1e3 * std::sqrt(sum / count);
  }
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(update(images(moving).points[i]));
    i = (i + 1) % kFrames;
  }
}

/// advance, correct and all four depths. Argument: ke [1/s].
void observerUpdate(benchmark::State& state) {
  VisualMotionObserverOptions options;
  options.ke = static_cast<double>(state.range(0));
  options.cMo = images(still).truth.front();
  VisualMotionObserver observer(kPoints, options);
  MotionBuffer odometry(128);
  double t = 0;
  const auto update = [&](const std::vector<PointObservation>& image) -> Eigen::Vector3d {
    odometry.push(t, {});
    odometry.holdUntil(t + kDt);
    observer.advance(odometry, t);
    observer.correct(image);
    for (int id = 0; id < 4; ++id) benchmark::DoNotOptimize(observer.estimate(id));
    t += kDt;
    return observer.cMo().translation();
  };
  measure(state, update);
}
BENCHMARK(observerUpdate)->Arg(3)->Arg(9)->Arg(30);

void vispVirtualVisualServoing(benchmark::State& state) {
  vpHomogeneousMatrix cMo;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 4; ++j) cMo[i][j] = images(still).truth.front().matrix()(i, j);
  }
  measure(state, [&](const std::vector<PointObservation>& image) -> Eigen::Vector3d {
    vpPose pose;
    for (const PointObservation& point : image) {
      const Eigen::Vector3d& P = kPoints[static_cast<std::size_t>(point.id)];
      vpPoint visp(P.x(), P.y(), P.z());
      visp.set_x(point.measurement.x);
      visp.set_y(point.measurement.y);
      pose.addPoint(visp);
    }
    pose.computePose(vpPose::VIRTUAL_VS, cMo);
    return {cMo[0][3], cMo[1][3], cMo[2][3]};
  });
}
BENCHMARK(vispVirtualVisualServoing);

void opencvSolvePnP(benchmark::State& state) {
  std::vector<cv::Point3d> object;
  object.reserve(kPoints.size());
  for (const Eigen::Vector3d& P : kPoints) object.emplace_back(P.x(), P.y(), P.z());
  const Eigen::Vector3d start = images(still).truth.front().translation();
  cv::Vec3d rotation(0, 0, 0), translation(start.x(), start.y(), start.z());
  std::vector<cv::Point2d> points(4);
  measure(state, [&](const std::vector<PointObservation>& image) -> Eigen::Vector3d {
    for (std::size_t i = 0; i < 4; ++i) {
      points[i] = {image[i].measurement.x, image[i].measurement.y};
    }
    cv::solvePnP(object, points, cv::Matx33d::eye(), cv::noArray(), rotation, translation, true,
                 cv::SOLVEPNP_ITERATIVE);
    return {translation[0], translation[1], translation[2]};
  });
}
BENCHMARK(opencvSolvePnP);

}  // namespace
}  // namespace depthservo
