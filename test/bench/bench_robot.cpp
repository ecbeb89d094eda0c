// bench_robot [--robots N] [--first N]: whether depths are honest on robots with everyday errors,
// and what one image costs. Exit code 1 when a row misses its limit.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/RobotExperiment.h"

namespace {

using namespace depthservo;
using namespace depthservo::test;
using Make = std::function<std::unique_ptr<PointSetEstimator>()>;
using Draw = std::function<Robot(unsigned)>;

constexpr DepthPrior kPrior{3};

std::unique_ptr<PointSetEstimator> joint() {
  return std::make_unique<SharedErrorFilter>(Robot::kPoints, SharedErrorFilterOptions{}, kPrior);
}
std::unique_ptr<PointSetEstimator> alone() {
  return std::make_unique<SeparatePoints>(SharedErrorFilter(1, {}, kPrior), Robot::kPoints, kPrior);
}
std::unique_ptr<PointSetEstimator> whiteJoint() {
  return std::make_unique<JointDepthFilter>(Robot::kPoints, JointDepthFilterOptions{}, kPrior);
}
std::unique_ptr<PointSetEstimator> whiteAlone() {
  return std::make_unique<PointwiseEstimator>(InverseDepthFilter(), Robot::kPoints, kPrior);
}

struct Limits {
  double coverage = 0, mostCoverage = 1.001, valid = 0, worstScaled = 1;
};

/// \return whether it is within the limits
bool row(const char* name, const Draw& draw, const Make& make, int first, int robots,
         const Limits& limits) {
  double coverage = 0, worst = 1, valid = 0, worstScaled = 0;
  std::vector<double> error, scaled;
  for (int i = first; i < first + robots; ++i) {
    const auto estimator = make();
    const Honesty h = draw(static_cast<unsigned>(i)).judge(*estimator);
    coverage += h.coverage / robots;
    worst = std::min(worst, h.coverage);
    valid += h.valid / robots;
    error.push_back(h.error);
    scaled.push_back(h.scaled);
    worstScaled = std::max(worstScaled, h.scaled);
  }
  const bool isMet = coverage >= limits.coverage && coverage <= limits.mostCoverage &&
                     valid >= limits.valid && worstScaled <= limits.worstScaled;
  std::printf("%-44s %5.3f %5.3f  %4.2f  %5.2f %% %5.2f %% %5.2f %%  %s\n", name, coverage, worst,
              valid, 100 * Robot::median(error), 100 * Robot::median(scaled), 100 * worstScaled,
              isMet ? "met" : "MISSED");
  return isMet;
}

/// Median time of an image [us].
double cost(std::size_t points, std::size_t places) {
  const Robot robot = Robot::typical(2);
  SharedErrorFilterOptions options;
  options.places = places;
  SharedErrorFilter filter(points, options, kPrior);
  std::vector<double> times;
  for (const RobotRun::Image& image : robot.run.images) {
    std::vector<PointObservation> seen;
    for (std::size_t i = 0; i < points; ++i) {
      PointObservation o = image.points[i % image.points.size()];
      o.id = static_cast<int>(i);
      seen.push_back(o);
    }
    const auto from = std::chrono::steady_clock::now();
    filter.advance(robot.run.odometry, image.stamp_s);
    filter.correct(seen);
    times.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - from).count());
  }
  return Robot::median(times);
}

}  // namespace

int main(int argc, char** argv) {
  int robots = 40, first = 0;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--robots") robots = std::atoi(argv[i + 1]);
    if (std::string(argv[i]) == "--first") first = std::atoi(argv[i + 1]);
  }
  const Draw typical = [](unsigned seed) { return Robot::typical(seed); };
  const Draw ofPrior = [](unsigned seed) { return Robot::ofPrior(seed); };
  const Draw slipping = [](unsigned seed) { return Robot::slipping(seed, .05); };
  const Draw slippery = [](unsigned seed) { return Robot::slipping(seed, .1); };
  const Draw perfect = [](unsigned seed) { return Robot(seed, RobotErrors{}); };
  std::printf("%-44s cover worst  valid  error   scaled  worst\n", "robots, estimator");
  bool isMet = row("typical, filter, white noise", typical, whiteAlone, first, robots, {});
  isMet &= row("typical, joint, white noise", typical, whiteJoint, first, robots, {});
  isMet &= row("typical, filter", typical, alone, first, robots, {.9, 1.001, .6, 1});
  isMet &= row("typical, joint", typical, joint, first, robots, {.93, 1.001, .7, .04});
  isMet &= row("as uncertain as the profile, filter", ofPrior, alone, first, 5 * robots / 2, {});
  isMet &= row("as uncertain as the profile, joint", ofPrior, joint, first, 5 * robots / 2,
               {.9, .985, .7, .04});
  isMet &= row("slip of 5 %, filter", slipping, alone, first, robots, {});
  isMet &= row("slip of 5 %, joint", slipping, joint, first, robots, {.9, 1.001, .7, 1});
  isMet &= row("slip of 10 %, filter", slippery, alone, first, robots, {});
  isMet &= row("slip of 10 %, joint", slippery, joint, first, robots, {});
  isMet &= row("perfect, filter", perfect, alone, first, robots, {.95, 1.001, .6, 1});
  isMet &= row("perfect, joint", perfect, joint, first, robots, {.95, 1.001, .7, .04});
  isMet &= row("perfect, joint, white noise", perfect, whiteJoint, first, robots, {});
  std::printf("one image: 8 points %.1f us, 12 %.1f us, 100 %.1f us\n", cost(8, 8), cost(12, 12),
              cost(100, 8));
  return isMet ? 0 : 1;
}
