// Where the points come from: time per image of each source, split into reading the image, tracking
// and estimation; and KltTracker against OpenCV's Lucas-Kanade alone, on the same images and
// corners.
#include <benchmark/benchmark.h>
#include <stdlib.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <opencv2/core/utility.hpp>
#include <opencv2/video/tracking.hpp>

#include "depthservo/rig/RecordedRig.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/KltTracker.h"
#include "depthservo/visp/using.h"

namespace {

using namespace depthservo;
using Image = vpImage<unsigned char>;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};
constexpr int kFrames = 60;
const Twist kTwist{{0.05, 0.01, 0.02}, {0, 0, 0}};

SyntheticCameraOptions noisy() {
  SyntheticCameraOptions options;
  options.gray_noise = 2;
  return options;
}

SyntheticView viewOf(int k, double Z) {
  const Motion motion = Motion::fromTwist(kTwist, k / 30.);
  SyntheticView view;
  view.cMo.translation() = Eigen::Vector3d(0, 0, Z) + motion.t;
  view.frame = static_cast<std::uint64_t>(k);
  return view;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Replays a recording of the scene; counters are medians over all images [us].
void replayed(benchmark::State& state, SyntheticCamera scene, const SequenceSettings& settings,
              double Z, TrackerKind tracker) {
  std::string folder = (std::filesystem::temp_directory_path() / "bench-sources-XXXXXX").string();
  mkdtemp(folder.data());
  SequenceWriter writer(folder + "/sequence");
  Image image;
  for (int k = 0; k < kFrames; ++k) {
    scene.render(viewOf(k, Z), image);
    writer.addImage(fileTime(k / 30.), image);
    writer.addOdometry(fileTime(k / 30.), kTwist);
  }
  SequenceSettings all = settings;
  all.camera = kCamera;
  writer.finish(all);
  const Sequence sequence(folder + "/sequence");
  ObservationOptions options;
  options.tracker = tracker;
  std::map<std::string, std::vector<double>> seconds;
  std::size_t points = 0;
  for (auto _ : state) {
    const RunLog log = replay(sequence, options);
    for (const auto& [stage, laps] : log.timings) {
      seconds[stage].insert(seconds[stage].end(), laps.begin(), laps.end());
    }
    points = log.frames.back().features.size();
  }
  std::filesystem::remove_all(folder);
  for (const auto& [stage, laps] : seconds) state.counters[stage + "_us"] = 1e6 * median(laps);
  state.counters["points"] = static_cast<double>(points);
}

void dots(benchmark::State& state) {
  const DotTarget target{{{-0.08, -0.08, 0}, {0.08, -0.08, 0}, {0.08, 0.08, 0}, {-0.08, 0.08, 0}},
                         0.014};
  SequenceSettings settings;
  settings.target = target;
  replayed(state, SyntheticCamera(kCamera, target, noisy()), settings, 0.6, TrackerKind::dots);
}

void aprilTag(benchmark::State& state) {
  AprilTagTarget target{"36h11", {{3, 0.16, Eigen::Isometry3d::Identity()}}};
  SequenceSettings settings;
  settings.tags = target;
  replayed(state, SyntheticCamera(kCamera, target.patches(), noisy()), settings, 0.8,
           TrackerKind::apriltag);
}

std::vector<GrayPatch> wall() { return {GrayPatch::random(4, 3, 160, 120, 1)}; }

void naturalCorners(benchmark::State& state) {
  replayed(state, SyntheticCamera(kCamera, wall(), noisy()), {}, 1.2, TrackerKind::klt);
}

double cpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Both on one thread, image by image in turn; processor time, medians.
void kltAgainstOpenCvAlone(benchmark::State& state) {
  cv::setNumThreads(1);
  SyntheticCamera scene(kCamera, wall(), noisy());
  std::vector<Image> images(kFrames);
  for (int k = 0; k < kFrames; ++k) {
    scene.render(viewOf(k, 1.2), images[static_cast<std::size_t>(k)]);
  }
  std::vector<double> ours, openCv;
  std::size_t points = 0;
  for (auto _ : state) {
    KltTracker tracker;
    std::vector<cv::Point2f> corners, found;
    std::vector<unsigned char> status;
    std::vector<float> error;
    cv::Mat before;
    for (Image& image : images) {
      const double start = cpuSeconds();
      const auto& tracked = tracker.track(image, {});
      const double tracking = cpuSeconds() - start;
      const cv::Mat now(480, 640, CV_8U, image.bitmap);
      if (!before.empty()) {
        const double begin = cpuSeconds();
        cv::calcOpticalFlowPyrLK(before, now, corners, found, status, error, cv::Size(21, 21), 3);
        openCv.push_back(cpuSeconds() - begin);
        ours.push_back(tracking);
      }
      before = now;
      corners.clear();
      for (const TrackedPoint& p : tracked) {
        corners.emplace_back(static_cast<float>(p.u), static_cast<float>(p.v));
      }
      points = corners.size();
    }
  }
  double sumOurs = 0, sumOpenCv = 0;
  for (const double t : ours) sumOurs += t;
  for (const double t : openCv) sumOpenCv += t;
  state.counters["ours_us"] = 1e6 * median(ours);
  state.counters["opencv_us"] = 1e6 * median(openCv);
  state.counters["ratio_of_medians"] = median(ours) / median(openCv);
  state.counters["ratio_of_sums"] = sumOurs / sumOpenCv;  // with the choice of new corners
  state.counters["points"] = static_cast<double>(points);
}

BENCHMARK(dots)->Unit(benchmark::kMillisecond);
BENCHMARK(aprilTag)->Unit(benchmark::kMillisecond);
BENCHMARK(naturalCorners)->Unit(benchmark::kMillisecond);
BENCHMARK(kltAgainstOpenCvAlone)->Unit(benchmark::kMillisecond);

}  // namespace
