// The drop-ins for ViSP's features in closed loop: success from random starts, by the 3D parameters
// that the task is given (true, constant at a wrong guess of the start's, observed from the same
// guess), and what `observe` costs beside computeControlLaw. Two Markdown tables on stdout.
//   bench_features [--starts N] [--cost] [NAME]    NAME: features whose name contains it
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "support/FeatureTasks.h"

namespace {

using namespace depthservo;
using namespace depthservo::test;
using Parameter = FeatureTask::Parameter;

struct Kind {
  const char* name;
  std::function<std::unique_ptr<FeatureTask>()> make;
  double tilt, roll;  // of the starts, +- [rad]
};

const Kind kKinds[] = {
    {"`FeaturePointPolar` (4 points)", [] { return std::make_unique<PolarTask>(); }, .25, .8},
    {"`FeatureDepth` (2 1/2 D)", [] { return std::make_unique<DepthTask>(); }, .25, .8},
    {"`FeatureSegment` (2)", [] { return std::make_unique<SegmentTask>(); }, .25, .8},
    {"`FeatureLine` (4)", [] { return std::make_unique<LineTask>(); }, .25, .5},
    {"`FeatureEllipse`, circle",
     [] { return std::make_unique<EllipseTask<EllipseShape::planar>>(); }, .25, .8},
    {"`FeatureEllipse`, sphere",
     [] { return std::make_unique<EllipseTask<EllipseShape::sphere>>(); }, .25, .8},
    {"`ObservedPlane`, moments", [] { return std::make_unique<MomentsTask>(); }, .15, .5},
    {"`FeatureLuminance` (80x60)", [] { return std::make_unique<LuminanceTask>(); }, .08, .1}};

vpHomogeneousMatrix startOf(const Kind& kind, Random& random) {
  const bool isNear = kind.tilt < .1;  // photometric
  const double aside = isNear ? .04 : .15;
  double pose[6];  // drawn in this order
  for (int i = 0; i < 2; ++i) pose[i] = random.uniform(-aside, aside);
  pose[2] = isNear ? random.uniform(.5, .65) : random.uniform(.7, 1.2);
  for (int i = 3; i < 5; ++i) pose[i] = random.uniform(-kind.tilt, kind.tilt);
  pose[5] = random.uniform(-kind.roll, kind.roll);
  return vpHomogeneousMatrix(pose[0], pose[1], pose[2], pose[3], pose[4], pose[5]);
}

int arrivals(const Kind& kind, Parameter parameter, double factor, int starts) {
  int count = 0;
  Random random(1);
  for (int i = 0; i < starts; ++i) {
    const vpHomogeneousMatrix start = startOf(kind, random);
    const auto task = kind.make();
    try {
      count += succeeds(*task, start, parameter, factor, static_cast<unsigned>(i + 1));
    } catch (const vpException&) {  // ViSP refuses what it has come to
    }
  }
  return count;
}

void successTable(int starts, const char* name) {
  constexpr double kGuesses[] = {.25, .5, 1, 2, 4};
  std::printf("| feature, of %d starts | true |", starts);
  for (const char* what : {"constant", "observed"}) {
    for (const double guess : kGuesses) std::printf(" %s %gx |", what, guess);
  }
  std::printf("\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Kind& kind : kKinds) {
    if (!std::strstr(kind.name, name)) continue;
    std::printf("| %s | %d |", kind.name, arrivals(kind, Parameter::truth, 1, starts));
    for (const Parameter parameter : {Parameter::constant, Parameter::observed}) {
      for (const double guess : kGuesses) {
        std::printf(" %d |", arrivals(kind, parameter, guess, starts));
        std::fflush(stdout);
      }
    }
    std::printf("\n");
  }
}

using Clock = std::chrono::steady_clock;
double microseconds(Clock::duration d) {
  return std::chrono::duration<double, std::micro>(d).count();
}

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void costTable(const char* name) {
  std::printf("| feature | observe, all of the task [us] | computeControlLaw [us] | share |\n");
  std::printf("|---|---|---|---|\n");
  for (const Kind& kind : kKinds) {
    if (!std::strstr(kind.name, name)) continue;
    const bool isLarge = kind.tilt < .1;
    const auto features = kind.make();
    vpServo task;
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(vpServo::CURRENT);
    features->addTo(task);
    Random random(1);
    FourPointScene scene(startOf(kind, random).inverse());
    std::vector<double> observe, control;
    vpColVector v(6, 0.);
    features->setParameters(scene.cMo(), 1);
    for (int k = 0; k < (isLarge ? 60 : 300); ++k) {
      features->measure(scene.cMo(), random, 4e-4);
      const auto t0 = Clock::now();
      features->observe(v, kPeriod_s);
      const auto t1 = Clock::now();
      features->update();
      const auto t2 = Clock::now();
      const vpColVector u = task.computeControlLaw();
      const auto t3 = Clock::now();
      observe.push_back(microseconds(t1 - t0));
      control.push_back(microseconds(t3 - t2));
      v = scene.apply(u);
    }
    const double a = median(observe), b = median(control);
    std::printf("| %s | %.2f | %.2f | %.1f %% |\n", kind.name, a, b, 100 * a / b);
  }
}

}  // namespace

int main(int argc, char** argv) {
  int starts = 40;
  bool isCostOnly = false;
  const char* name = "";
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--cost") == 0) {
      isCostOnly = true;
    } else if (std::strcmp(argv[i], "--starts") == 0 && i + 1 < argc &&
               std::atoi(argv[i + 1]) > 0) {
      starts = std::atoi(argv[++i]);
    } else if (argv[i][0] != '-') {
      name = argv[i];
    } else {
      std::fprintf(stderr,
                   "usage: bench_features [--starts N] [--cost] [NAME]    (N > 0, default 40)\n");
      return 2;
    }
  }
  if (!isCostOnly) successTable(starts, name);
  costTable(name);
  return 0;
}
