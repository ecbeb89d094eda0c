// What a sweep of geometric runs costs: time per step against that of vpServo alone, two threads
// against one, and memory. Ratios of one call of this program; it wants a machine that does nothing
// else.
//
//   bench_sweep [RUNS]        default 10000; exit code 1 when a limit is exceeded

#include <sys/resource.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/vs/vpServo.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/robots/UnicycleCamera.h"
#include "depthservo/scenario/run.h"
#include "depthservo/visp/using.h"
#include "robots/makeRobot.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

constexpr double kMostTimesServo = 2, kLeastSpeedUp = 1.9, kMostGrowth_MB = 5, kMostTimesCpu = 1.05;

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double memory_MB() {  // resident now
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * 4096e-6;
}

Sweep sweepOf(const test::TemporaryFolder& folder, int runs) {
  folder.write("sweep.yaml",
               "name: bench\nscenario: " DEPTHSERVO_DATA
               "/scenarios/unicycle-4dots.yaml\n"
               "set: [sensing.source=geometry, expect=null]\nmetrics: [frames, final_error_px]\n"
               "axes: [{name: start, count: " +
                   std::to_string(runs) + ", cone: {angle: 0.5, distance: [2.5, 4], aim: 0.2}}]\n");
  return Sweep::load(folder / "sweep.yaml", [](const std::string& name) { return name; });
}

/// What the control law was given in an image: four points, normalised, and their depths.
struct Given {
  double x[4], y[4], Z[4];
};

/// Of one run after the other.
class Recorder : public RunWatcher {
 public:
  bool onFrame(const RunFrame& frame) override {
    if (frame.record.features.size() != 4) return true;
    Given& now = given.emplace_back();
    for (std::size_t i = 0; i < 4; ++i) {
      const DepthEstimate& e = frame.record.features[i].estimate;
      now.x[i] = e.x;
      now.y[i] = e.y;
      now.Z[i] = e.Z();
    }
    goals = frame.log.goals;
    camera = frame.log.camera;
    return true;
  }

  std::vector<Given> given;
  std::vector<Eigen::Vector2d> goals;
  PinholeCamera camera;
};

/// CPU time of so many control laws of vpServo with what some of the runs gave it, four points on a
/// unicycle.
double servo_s(const Sweep& sweep, std::size_t calls) {
  Recorder runs;
  for (std::size_t row = 0; row < std::min<std::size_t>(sweep.size(), 20); ++row) {
    run(sweep.scenario(sweep.row(row)), &runs, Keep::theOutcome);
  }
  vpFeaturePoint s[4], desired[4];
  vpServo task;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d goal = runs.camera.normalise(runs.goals[i].x(), runs.goals[i].y());
    s[i].buildFrom(goal.x(), goal.y(), 1);
    desired[i].buildFrom(goal.x(), goal.y(), 1);
    task.addFeature(s[i], desired[i]);
  }
  task.setServo(vpServo::EYEINHAND_L_cVe_eJe);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(0.57);
  RobotOptions robot;
  robot.camera_offset = {0.07, 0.02, 0.13};
  const auto model = makeRobot(robot, {});
  const vpVelocityTwistMatrix cVe = model->cVe();
  const vpMatrix eJe = model->eJe();
  double sum = 0;
  const double before = cpu_s();
  for (std::size_t call = 0; call < calls; ++call) {
    const Given& now = runs.given[call % runs.given.size()];
    for (std::size_t i = 0; i < 4; ++i) s[i].buildFrom(now.x[i], now.y[i], now.Z[i]);
    task.set_cVe(cVe);
    task.set_eJe(eJe);
    sum += task.computeControlLaw()[0];
  }
  const double took = cpu_s() - before;
  if (!std::isfinite(sum)) std::printf("vpServo gave no command\n");
  return took;
}

struct Cost {
  double wall_s, cpu_s;
  long waits;  // voluntary context switches
};

/// Of a sweep by so many threads.
Cost swept(const Sweep& sweep, const test::TemporaryFolder& folder, int jobs) {
  const std::filesystem::path place = folder / ("jobs" + std::to_string(jobs));
  std::filesystem::remove_all(place);
  SweepFolder results = SweepFolder::begin(place, sweep, {});
  const auto waits = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_nvcsw;
  };
  const double wall = wall_s(), cpu = cpu_s();
  const long waited = waits();
  runSweep(
      results, jobs, [] { return false; }, [](const SweepProgress&) {});
  return {wall_s() - wall, cpu_s() - cpu, waits() - waited};
}

int bench(int runs) {
  const test::TemporaryFolder folder;
  const Sweep sweep = sweepOf(folder, runs);
  double steps = 0, before = cpu_s(), memory = 0;
  for (int i = 0; i < runs; ++i) {
    if (i == runs / 10) memory = memory_MB();
    steps += runRow(sweep, static_cast<std::size_t>(i), [] { return false; }).metrics[0];
  }
  const double took = cpu_s() - before, growth = memory_MB() - memory;
  const double servo = servo_s(sweep, static_cast<std::size_t>(steps));
  std::printf(
      "%d runs, %.3g steps: %.2f us per step, vpServo alone %.2f us: %.2f times (limit %g)\n", runs,
      steps, 1e6 * took / steps, 1e6 * servo / steps, took / servo, kMostTimesServo);
  std::printf("memory grows by %.1f MB over the last nine tenths (limit %g)\n", growth,
              kMostGrowth_MB);
  const Cost one = swept(sweep, folder, 1), two = swept(sweep, folder, 2);
  std::printf(
      "1 thread %.2f s, 2 threads %.2f s: %.2f times as fast (limit %g); CPU %.2f and %.2f s, %.3f "
      "times (limit %g); %ld and %ld waits\n",
      one.wall_s, two.wall_s, one.wall_s / two.wall_s, kLeastSpeedUp, one.cpu_s, two.cpu_s,
      two.cpu_s / one.cpu_s, kMostTimesCpu, one.waits, two.waits);
  const bool isMet = took <= kMostTimesServo * servo && growth <= kMostGrowth_MB &&
                     one.wall_s >= kLeastSpeedUp * two.wall_s &&
                     two.cpu_s <= kMostTimesCpu * one.cpu_s;
  return isMet ? 0 : 1;
}

}  // namespace
}  // namespace depthservo

int main(int argc, char** argv) { return depthservo::bench(argc > 1 ? std::atoi(argv[1]) : 10000); }
