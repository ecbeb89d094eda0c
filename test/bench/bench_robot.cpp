// bench_robot [--robots N]: whether depths are honest on a robot with everyday errors.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>

#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/RobotExperiment.h"

namespace {

using namespace depthservo;
using namespace depthservo::test;

double median(std::vector<double> v) {
  if (v.empty()) return NAN;
  std::nth_element(v.begin(), v.begin() + static_cast<long>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

struct Result {
  double coverage = NAN, share = 0, error = 0, errorScaled = 0, sigma = 0;
  double nees[4] = {NAN, NAN, NAN, NAN}, value[4] = {}, sigmas[4] = {};
  double us = 0;
};

using Set = std::vector<std::unique_ptr<PointSetEstimator>>;

/// One estimator, or one for each point.
Result judge(RobotRun& run, const RobotErrors& errors, Set& set, std::size_t points) {
  Result result;
  const bool isSplit = set.size() > 1;
  long valid = 0, covered = 0, all = 0;
  std::vector<double> relative, scaled, sigmas;
  const auto from = std::chrono::steady_clock::now();
  for (const RobotRun::Image& image : run.images) {
    for (auto& e : set) e->advance(run.odometry, image.stamp_s);
    if (!isSplit) set[0]->correct(image.points);
    for (const PointObservation& o : image.points) {
      if (isSplit) set[static_cast<std::size_t>(o.id)]->correct({o});
    }
    if (image.stamp_s < 3) continue;
    for (const PointObservation& o : image.points) {
      const auto i = static_cast<std::size_t>(o.id);
      const DepthEstimate e = set[isSplit ? i : 0]->estimate(o.id);
      ++all;
      if (e.status != DepthStatus::valid) continue;
      ++valid;
      const double Z = image.Z[i];
      covered += std::abs(e.Z() - Z) <= 2 * e.sigma_Z();
      relative.push_back(std::abs(e.Z() - Z) / Z);
      scaled.push_back(std::abs(e.Z() * (1 + errors.S) - Z) / Z);
      sigmas.push_back(e.sigma_Z() / e.Z());
    }
  }
  (void)points;
  result.us =
      std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - from).count() /
      static_cast<double>(run.images.size());
  result.coverage = valid ? static_cast<double>(covered) / static_cast<double>(valid) : NAN;
  result.share = all ? static_cast<double>(valid) / static_cast<double>(all) : 0;
  result.error = median(relative);
  result.errorScaled = median(scaled);
  result.sigma = median(sigmas);
  if (const auto* s = dynamic_cast<const SharedErrorFilter*>(set[0].get())) {
    const SharedErrorFilter::Shared states[] = {s->latency(), s->gyroBias(1), s->mount(0),
                                                s->mount(1)};
    const double truth[] = {errors.latency_s, errors.bias(1), errors.mount(0), errors.mount(1)};
    for (int i = 0; i < 4; ++i) {
      result.value[i] = states[i].value - truth[i];
      result.sigmas[i] = states[i].sigma;
      if (states[i].sigma < .5 * states[i].prior) {
        result.nees[i] = std::pow((states[i].value - truth[i]) / states[i].sigma, 2);
      }
    }
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  int robots = 24, first = 0, verbose = 0, places = 8, few = 12;
  const char* draw = "typical";
  for (int i = 1; i + 1 < argc; i += 2) {
    if (!std::strcmp(argv[i], "--robots")) robots = std::atoi(argv[i + 1]);
    if (!std::strcmp(argv[i], "--first")) first = std::atoi(argv[i + 1]);
    if (!std::strcmp(argv[i], "--draw")) draw = argv[i + 1];
    if (!std::strcmp(argv[i], "-v")) verbose = std::atoi(argv[i + 1]);
    if (!std::strcmp(argv[i], "--places")) places = std::atoi(argv[i + 1]);
    if (!std::strcmp(argv[i], "--points")) few = std::atoi(argv[i + 1]);
  }
  std::map<std::string, std::vector<Result>> all;
  for (int robot = first; robot < first + robots; ++robot) {
    Random random(static_cast<unsigned>(1000 + robot));
    RobotErrors errors;
    if (!std::strcmp(draw, "typical")) errors = RobotErrors::typical(random);
    if (!std::strcmp(draw, "prior")) errors = RobotErrors::ofPrior(random);
    const RobotErrors whole = RobotErrors::ofPrior(random);
    const std::string some = draw;
    if (some.find("td") != some.npos) errors.latency_s = whole.latency_s;
    if (some.find("jit") != some.npos) errors.jitter_s = whole.jitter_s;
    if (some.find("mnt") != some.npos) errors.mount = whole.mount;
    if (some.find("bias") != some.npos) errors.bias = whole.bias;
    if (some.find("slip") != some.npos) errors.slipSigma = whole.slipSigma;
    if (some.find("gyro") != some.npos) errors.gyroNoise = whole.gyroNoise;
    if (some.find("tick") != some.npos) errors.tick_m = whole.tick_m;
    if (some.find("wand") != some.npos) errors.wander_px = whole.wander_px;
    if (some.find("foc") != some.npos) errors.kappa = whole.kappa;
    if (some.find("S") != some.npos) errors.S = whole.S;
    const bool isArc = robot % 2 == 0;
    const Drive course = isArc ? Drive{.3, .12, .30, .10, 5} : Drive{.25, .1, .05, .15, 6};
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < few; ++i) {
      points.push_back(isArc ? Eigen::Vector3d(random.uniform(-1, 1), 3.3 + random.uniform(-1, 1),
                                               .3 + random.uniform(-.6, .6))
                             : Eigen::Vector3d(2.5 + random.uniform(-1.5, 1.5),
                                               3.5 + random.uniform(-1, 1),
                                               .3 + random.uniform(-.6, .6)));
    }
    RobotRun run = drive(course, errors, M_PI / 2, points, static_cast<unsigned>(robot));
    const DepthPrior prior{3};
    const DepthRange range;
    const auto go = [&](const char* name, Set set) {
      const Result r = judge(run, errors, set, points.size());
      all[name].push_back(r);
      if (verbose) {
        std::printf(
            "%3d %-14s cov %.3f share %.2f err %.2f%% scaled %.2f%% sigma %.2f%%  td %+.1f/%.1fms "
            "b %+.2f/%.2f m0 %+.1f/%.1f m1 %+.1f/%.1f mrad %.0f us\n",
            robot, name, r.coverage, r.share, 100 * r.error, 100 * r.errorScaled, 100 * r.sigma,
            1e3 * r.value[0], 1e3 * r.sigmas[0], 1e3 * r.value[1], 1e3 * r.sigmas[1],
            1e3 * r.value[2], 1e3 * r.sigmas[2], 1e3 * r.value[3], 1e3 * r.sigmas[3], r.us);
      }
    };
    const std::size_t n = points.size();
    {
      Set set;
      set.push_back(
          std::make_unique<PointwiseEstimator>(InverseDepthFilter({}, range), n, prior, range));
      go("filter", std::move(set));
    }
    SharedErrorFilterOptions o;
    o.places = static_cast<std::size_t>(places);
    {
      Set set;
      set.push_back(std::make_unique<SharedErrorFilter>(n, o, prior, range));
      go("shared", std::move(set));
    }
    {
      Set set;
      o.places = 1;
      for (std::size_t i = 0; i < n; ++i) {
        set.push_back(std::make_unique<SharedErrorFilter>(1, o, prior, range));
      }
      go("shared-alone", std::move(set));
    }
  }
  for (const auto& [name, results] : all) {
    double coverage = 0, worst = 1, share = 0, nees[4] = {}, us = 0;
    int count[4] = {};
    std::vector<double> error, scaled, sigma;
    for (const Result& r : results) {
      coverage += r.coverage / static_cast<double>(results.size());
      worst = std::min(worst, r.coverage);
      share += r.share / static_cast<double>(results.size());
      us += r.us / static_cast<double>(results.size());
      error.push_back(r.error);
      scaled.push_back(r.errorScaled);
      sigma.push_back(r.sigma);
      for (int i = 0; i < 4; ++i) {
        if (!std::isnan(r.nees[i])) {
          nees[i] += r.nees[i];
          ++count[i];
        }
      }
    }
    std::printf(
        "%-14s coverage %.3f worst %.3f valid %.2f error %.2f%% worst %.2f%% scaled %.2f%% worst "
        "%.2f%% sigma %.2f%%  nees td %.2f(%d) b %.2f(%d) m0 %.2f(%d) m1 %.2f(%d) %.1f us\n",
        name.c_str(), coverage, worst, share, 100 * median(error),
        100 * *std::max_element(error.begin(), error.end()), 100 * median(scaled),
        100 * *std::max_element(scaled.begin(), scaled.end()), 100 * median(sigma),
        nees[0] / std::max(count[0], 1), count[0], nees[1] / std::max(count[1], 1), count[1],
        nees[2] / std::max(count[2], 1), count[2], nees[3] / std::max(count[3], 1), count[3], us);
  }
}
