// Cost of observing depth, and its share of ViSP's control law for four points.
//   bench_observer            prints `share`: observe of 4 features, or the joint filter of 4 or 8,
//                             / computeControlLaw of 4
#include <benchmark/benchmark.h>
#include <unistd.h>
#include <visp3/vs/vpServo.h>

#include <array>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "depthservo/depth/FocalLengthObserver.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/features/FeaturePointGroup.h"
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

constexpr double kDt = 1. / 30;
constexpr std::size_t kFrames = 256;

/// A camera that moves away and back before four points, again and again.
struct Tour {
  std::vector<vpColVector> twist;
  std::vector<Motion> motion;
  std::vector<std::array<PointState, 8>> points;  // after the motion; the first four a square

  Twist twistAt(std::size_t k) const {
    const vpColVector& v = twist[k];
    return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  }

  Tour() {
    std::array<PointState, 8> at{{{-.1, -.1, 1},
                                  {.1, -.1, 1},
                                  {.1, .1, 1},
                                  {-.1, .1, 1},
                                  {-.2, 0, .9},
                                  {.2, 0, .8},
                                  {0, .2, 1.1},
                                  {0, -.2, 1.2}}};
    std::vector<vpColVector> away;
    for (std::size_t k = 0; k < kFrames / 2; ++k) {
      const double t = static_cast<double>(k) * kDt;
      const double u[] = {.1 * std::cos(t), .05, .05 * std::sin(t), .02, -.03, .1 * std::cos(t)};
      vpColVector v(6);
      for (unsigned j = 0; j < 6; ++j) v[j] = u[j];
      away.push_back(v);
    }
    twist = away;
    for (auto v = away.rbegin(); v != away.rend(); ++v) twist.push_back(-*v);
    for (std::size_t k = 0; k < twist.size(); ++k) {
      motion.push_back(Motion::fromTwist(twistAt(k), kDt));
      for (PointState& p : at) p = flow(motion.back(), p).point;
      points.push_back(at);
    }
  }
};

const Tour& tour() {
  static const Tour instance;
  return instance;
}

void BM_motionFromTwist(benchmark::State& state) {
  const Twist twist{{.1, .2, .3}, {.1, .2, .3}};
  for (auto _ : state) benchmark::DoNotOptimize(Motion::fromTwist(twist, kDt));
}
BENCHMARK(BM_motionFromTwist);

void BM_flow(benchmark::State& state) {
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(flow(tour().motion[k], tour().points[k][0]));
    k = (k + 1) % kFrames;
  }
}
BENCHMARK(BM_flow);

void BM_focalLengthStep(benchmark::State& state) {
  constexpr double kFocal_px = 600;
  FocalLengthObserver observer;
  observer.reset({kFocal_px * tour().points[kFrames - 1][0].x,
                  kFocal_px * tour().points[kFrames - 1][0].y, .5});
  std::size_t k = 0;
  for (auto _ : state) {
    const PointState& p = tour().points[k][0];
    observer.predict(tour().motion[k]);
    observer.correct({kFocal_px * p.x, kFocal_px * p.y, .5});
    benchmark::DoNotOptimize(observer.estimate());
    k = (k + 1) % kFrames;
  }
}
BENCHMARK(BM_focalLengthStep);

void BM_nonlinearObserverStep(benchmark::State& state) {
  NonlinearDepthObserver observer;
  const PointState& start = tour().points.back()[0];
  observer.reset({start.x, start.y, 8e-4}, {2});
  std::size_t k = 0;
  for (auto _ : state) {
    const PointState& p = tour().points[k][0];
    observer.predict(tour().motion[k]);
    observer.correct({p.x, p.y, 8e-4});
    k = (k + 1) % kFrames;
  }
  benchmark::DoNotOptimize(observer.estimate());
}
BENCHMARK(BM_nonlinearObserverStep);

template <typename Features>
void setPoints(Features& s, std::size_t k) {
  for (std::size_t i = 0; i < 4; ++i) {
    s[i].set_x(tour().points[k][i].x);
    s[i].set_y(tour().points[k][i].y);
  }
}

void BM_observeFourFeatures(benchmark::State& state) {
  std::vector<FeaturePoint> s(4);
  std::size_t k = 0;
  for (auto _ : state) {
    setPoints(s, k);
    for (FeaturePoint& f : s) f.observe(tour().twist[k], kDt);
    k = (k + 1) % kFrames;
  }
}
BENCHMARK(BM_observeFourFeatures);

void BM_observeGroupOfFour(benchmark::State& state) {
  FeaturePointGroup s(PointwiseEstimator(NonlinearDepthObserver(), 4), 4);
  std::size_t k = 0;
  for (auto _ : state) {
    setPoints(s, k);
    s.observe(tour().twist[k], kDt);
    k = (k + 1) % kFrames;
  }
}
BENCHMARK(BM_observeGroupOfFour);

/// CPU time of this program [s]: other programs may run beside it.
double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// ViSP's control law for four points. The time shown is this law's, per call.
class Task {
 public:
  Task() : s(4), s_star_(4) {
    task_.setServo(vpServo::EYEINHAND_CAMERA);
    task_.setInteractionMatrixType(vpServo::CURRENT);
    for (std::size_t i = 0; i < 4; ++i) {
      s_star_[i].buildFrom(i % 3 ? .2 : -.2, i > 1 ? .2 : -.2, .5);
      task_.addFeature(s[i], s_star_[i]);
    }
    setPoints(s, 0);
    for (FeaturePoint& f : s) f.observe(tour().twist[0], kDt);
  }

  std::vector<FeaturePoint> s;

  /// Sets what `work` costs, without `overhead`, and its share of the control law. Both sides take
  /// blocks long enough for the clock.
  template <typename Overhead, typename Work>
  void compare(benchmark::State& state, const Overhead& overhead, const Work& work) {
    double overhead_s = 0, work_s = 0, control_s = 0, calls = 0;
    for (auto _ : state) {
      const double t0 = cpu_s();
      for (std::size_t k = 0; k < kBlock; ++k) overhead(k % kFrames);
      const double t1 = cpu_s();
      for (std::size_t k = 0; k < kBlock; ++k) work(k % kFrames);
      const double t2 = cpu_s();
      for (std::size_t k = 0; k < kBlock; ++k) task_.computeControlLaw();
      const double t3 = cpu_s();
      overhead_s += t1 - t0;
      work_s += t2 - t1;
      control_s += t3 - t2;
      calls += kBlock;
      state.SetIterationTime((t3 - t2) / kBlock);
    }
    state.counters["work_ns"] = 1e9 * (work_s - overhead_s) / calls;
    state.counters["control_ns"] = 1e9 * control_s / calls;
    state.counters["share"] = (work_s - overhead_s) / control_s;
  }

 private:
  static constexpr std::size_t kBlock = 8 * kFrames;
  std::vector<vpFeaturePoint> s_star_;
  vpServo task_;
};

/// Setting x and y is not counted: the loop without depthservo does it as well.
void BM_observeAgainstControlLaw(benchmark::State& state) {
  Task task;
  std::vector<vpFeaturePoint> plain(4);
  task.compare(
      state, [&](std::size_t k) { setPoints(plain, k); },
      [&](std::size_t k) {
        setPoints(task.s, k);
        for (FeaturePoint& f : task.s) f.observe(tour().twist[k], kDt);
      });
}
BENCHMARK(BM_observeAgainstControlLaw)->UseManualTime()->Iterations(50);

/// JointDepthFilter with its time offset: advance and correct.
void BM_jointAgainstControlLaw(benchmark::State& state) {
  Task task;
  const auto n = static_cast<std::size_t>(state.range(0));
  JointDepthFilter joint(n);
  MotionBuffer odometry(64);
  std::vector<PointObservation> seen(n);
  std::size_t image = 0;
  task.compare(
      state, [](std::size_t) {},
      [&](std::size_t k) {
        odometry.push(static_cast<double>(image) * kDt, tour().twistAt(k));
        ++image;
        joint.advance(odometry, static_cast<double>(image) * kDt);
        for (std::size_t i = 0; i < n; ++i) {
          const PointState& p = tour().points[k][i];
          seen[i] = {static_cast<int>(i), {p.x, p.y, 8e-4}};
        }
        joint.correct(seen);
      });
  if (joint.estimate(0).status == DepthStatus::lost) state.SkipWithError("lost its points");
}
BENCHMARK(BM_jointAgainstControlLaw)->Arg(4)->Arg(8)->UseManualTime()->Iterations(50);

}  // namespace
}  // namespace depthservo
