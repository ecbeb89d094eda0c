// The synthetic camera against a memset of its image; DotTracker against plain vpDot2 on the same
// frames.
#include <benchmark/benchmark.h>
#include <visp3/blob/vpDot2.h>

#include <cmath>
#include <cstring>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/DotTracker.h"
#include "depthservo/visp/using.h"

namespace {

using namespace depthservo;
using Image = vpImage<unsigned char>;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};

/// Four dots of the given radius in pixels at 0.6 m.
DotTarget target(double radius_px = 14) {
  return {{{-0.08, -0.08, 0}, {0.08, -0.08, 0}, {0.08, 0.08, 0}, {-0.08, 0.08, 0}},
          radius_px * 0.6 / 600};
}

SyntheticView view(int k) {
  SyntheticView v;
  v.cMo.linear() =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 0.5, std::sin(0.1 * k)).normalized()).matrix();
  v.cMo.translation() = Eigen::Vector3d(0.02 * std::sin(0.05 * k), 0.02 * std::cos(0.04 * k), 0.6);
  v.twist.linear = {0.2, 0.1, 0};
  v.frame = static_cast<std::uint64_t>(k);
  return v;
}

void render(benchmark::State& state, const SyntheticCameraOptions& options) {
  SyntheticCamera camera(kCamera, target(), options);
  Image image;
  int k = 0;
  for (auto _ : state) {
    camera.render(view(++k), image);
    benchmark::DoNotOptimize(image.bitmap);
    benchmark::ClobberMemory();
  }
}

void memsetOfTheImage(benchmark::State& state) {
  Image image(480, 640);
  for (auto _ : state) {
    std::memset(image.bitmap, 220, image.getSize());
    benchmark::DoNotOptimize(image.bitmap);
    benchmark::ClobberMemory();
  }
}

void syntheticImage(benchmark::State& state) { render(state, {}); }

void syntheticImageBlurred(benchmark::State& state) {
  SyntheticCameraOptions options;
  options.exposure_s = 0.02;
  render(state, options);
}

void syntheticImageNoisy(benchmark::State& state) {
  SyntheticCameraOptions options;
  options.gray_noise = 3;
  options.vignetting = 0.3;
  render(state, options);
}

std::vector<Image> frames(double radius_px) {
  SyntheticCameraOptions options;
  options.gray_noise = 3;
  SyntheticCamera camera(kCamera, target(radius_px), options);
  std::vector<Image> images(50);
  for (int k = 0; k < 50; ++k) camera.render(view(k), images[static_cast<std::size_t>(k)]);
  return images;
}

std::vector<Eigen::Vector2d> starts(double radius_px) {
  const SyntheticCamera camera(kCamera, target(radius_px));
  std::vector<Eigen::Vector2d> centres;
  for (std::size_t i = 0; i < 4; ++i) centres.push_back(camera.ellipse(view(0).cMo, i)->centre);
  return centres;
}

/// Frame numbers there and back, so that the dots never jump.
std::size_t bounce(std::size_t k) {
  const std::size_t phase = k % 98;
  return phase < 50 ? phase : 98 - phase;
}

void fourDotsByDotTracker(benchmark::State& state) {
  const auto radius_px = static_cast<double>(state.range(0));
  const auto images = frames(radius_px);
  DotTracker tracker(starts(radius_px));
  std::size_t k = 0, seen = 0;
  for (auto _ : state) seen += tracker.track(images[bounce(k++)], {}).size();
  if (seen != 4 * k) state.SkipWithError("a dot was lost");
}

void fourDotsByVpDot2(benchmark::State& state) {
  const auto radius_px = static_cast<double>(state.range(0));
  const auto images = frames(radius_px);
  const auto first = starts(radius_px);
  std::vector<vpDot2> dots(4);
  for (std::size_t i = 0; i < 4; ++i) {
    dots[i].setGraphics(false);
    dots[i].initTracking(images[0], vpImagePoint(first[i].y(), first[i].x()));
  }
  std::size_t k = 0;
  for (auto _ : state) {
    const Image& image = images[bounce(k++)];
    for (vpDot2& dot : dots) dot.track(image);
    benchmark::DoNotOptimize(dots.data());
  }
}

BENCHMARK(memsetOfTheImage);
BENCHMARK(syntheticImage);
BENCHMARK(syntheticImageBlurred);
BENCHMARK(syntheticImageNoisy);
BENCHMARK(fourDotsByVpDot2)->Arg(5)->Arg(8)->Arg(14)->Arg(25);
BENCHMARK(fourDotsByDotTracker)->Arg(5)->Arg(8)->Arg(14)->Arg(25);

}  // namespace
