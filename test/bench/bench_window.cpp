// Cost of the window estimator per image of four points, by method and number of earlier images,
// against the filter and the observer.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <vector>

#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/WindowDepthEstimator.h"

namespace depthservo {
namespace {

constexpr double kDt = 1. / 30;
constexpr std::size_t kFrames = 256;

/// A camera that moves away and back before four points, again and again.
struct Tour {
  std::vector<Motion> motion;
  std::vector<std::array<PointState, 4>> points;  // after the motion

  Tour() {
    std::array<PointState, 4> at{{{-.1, -.1, 1}, {.1, -.1, 1}, {.1, .1, 1}, {-.1, .1, 1}}};
    for (std::size_t k = 0; k < kFrames; ++k) {
      const double sign = k < kFrames / 2 ? 1 : -1;
      motion.push_back(
          Motion::fromTwist({{sign * .1, sign * .05, sign * .03}, {0, 0, sign * .1}}, kDt));
      for (PointState& p : at) p = flow(motion.back(), p).point;
      points.push_back(at);
    }
  }
};

void fourPoints(benchmark::State& state, const DepthEstimator& prototype) {
  const Tour tour;
  std::array<std::unique_ptr<DepthEstimator>, 4> estimators;
  for (std::size_t i = 0; i < 4; ++i) {
    estimators[i] = prototype.clone();
    const PointState& p = tour.points.back()[i];
    estimators[i]->reset({p.x, p.y, 1e-3}, {1});
  }
  std::size_t k = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < 4; ++i) {
      estimators[i]->predict(tour.motion[k]);
      const PointState& p = tour.points[k][i];
      estimators[i]->correct({p.x, p.y, 1e-3});
      benchmark::DoNotOptimize(estimators[i]->estimate());
    }
    k = (k + 1) % kFrames;
  }
  state.counters["Z"] = estimators[0]->estimate().Z();
}

void window(benchmark::State& state, WindowMethod method) {
  WindowOptions options;
  options.method = method;
  options.images = static_cast<std::size_t>(state.range(0));
  fourPoints(state, WindowDepthEstimator(options));
}

BENCHMARK_CAPTURE(window, least_squares, WindowMethod::leastSquares)->Arg(5)->Arg(20)->Arg(50);
BENCHMARK_CAPTURE(window, maximum_likelihood, WindowMethod::maximumLikelihood)
    ->Arg(5)
    ->Arg(20)
    ->Arg(50);
BENCHMARK_CAPTURE(window, robust, WindowMethod::robust)->Arg(5)->Arg(20)->Arg(50);

void filter(benchmark::State& state) { fourPoints(state, InverseDepthFilter()); }
BENCHMARK(filter);

void observer(benchmark::State& state) { fourPoints(state, NonlinearDepthObserver()); }
BENCHMARK(observer);

}  // namespace
}  // namespace depthservo
