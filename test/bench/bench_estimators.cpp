// bench_estimators [--seeds N] [--json]: how far the filters are from the Cramer-Rao bound, whether
// their sigma is honest, also when the odometry is better or worse than declared, and what they
// cost. Exit code 1 when a row misses its limit.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "depth/FilterPointSteps.h"
#include "depthservo/depth/InverseDepthFilterBatch.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "support/EstimatorExperiment.h"

namespace {

using namespace depthservo;
using namespace depthservo::test;

struct Row {
  std::string id, subject;
  double value, low, high;  // met when low <= value <= high
  bool isMet() const { return value >= low && value <= high; }
};

/// Worst of a filter's statistics over the frames from 60 on.
struct Worst {
  double mean = 0, coverage = 1, nees = 0;  // of the error of chi; error / sigma, signed

  Worst(const Statistics& statistics, bool isShort) {
    for (std::size_t i = 2; i < kCheckpointCount - (isShort ? 1 : 0); ++i) {
      const double m = statistics.meanOverSigma(i);
      if (std::abs(m) > std::abs(mean)) mean = m;
      coverage = std::min(coverage, statistics.coverage(i));
      nees = std::max(nees, statistics.nees(i));
    }
  }
};

/// The filter without any correction of the bias of measured odometry noise.
Trace uncorrected(const SimulatedRun& run, const InverseDepthFilterOptions& options,
                  std::size_t point) {
  detail::FilterPoint p;
  Trace trace;
  for (std::size_t k = 0; k < run.measured.size(); ++k) {
    if (k == 0) {
      detail::resetPoint(p, run.measured[0][point], {run.guesses[point]});
    } else {
      const Motion motion =
          Motion::fromTwist(run.twist(static_cast<int>(k)), Trajectory::kPeriod_s);
      OdometryNoise::Step step = options.odometry.over(motion);
      step.bias_variance = 0;
      detail::predictPoint(p, detail::FilterStep(motion, step), options);
      detail::correctPoint(p, run.measured[k][point], options, {1e-3, 1e6});
    }
    trace.chi.push_back(p.chi);
    trace.variance.push_back(p.cc);
  }
  return trace;
}

constexpr double kLevels[] = {0, .5, 1, 2};

/// One line of the bias table: true noise by declared noise.
struct BiasLine {
  std::string name;
  std::vector<Worst> byLevel;
};

class Bench {
 public:
  Bench(unsigned seeds, unsigned first) : seeds_(seeds), first_(first) {}

  void filterAlone() {
    const OdometryNoise measured = OdometryNoise::white(.005, .002);
    const OdometryNoise commanded = OdometryNoise::white(.005, .002, OdometryMode::commanded);
    const struct {
      const char* name;
      OdometryNoise odometry;
      double outliers, limit;
    } cases[] = {{"perfect", OdometryNoise::none(), 0, 1.10},
                 {"commanded", commanded, 0, 1.10},
                 {"measured", measured, 0, 1.20},
                 {"outliers 2 %", OdometryNoise::none(), .02, 1.10}};
    for (const auto& c : cases) {
      const bool hasOutliers = c.outliers > 0;
      for (const Trajectory& t : moving()) {
        Conditions conditions{c.odometry};
        conditions.outliers = c.outliers;
        const auto [statistics, bound] = alone(t, conditions);
        for (std::size_t i = 2; i < kCheckpointCount; ++i) {
          const std::string where = at(t, c.name, i);
          add(hasOutliers ? "A5" : "A1", "RMSE/bound " + where,
              statistics.rmse(i) / bound[static_cast<std::size_t>(kCheckpoints[i])], 0, c.limit);
          if (hasOutliers) continue;
          const bool isBiased = c.odometry.mode == OdometryMode::measured && t.name[1] == '2';
          add("A3", "NEES " + where, statistics.nees(i), .75, isBiased ? 1.6 : 1.35);
          if (!isBiased) add("A3", "2-sigma coverage " + where, statistics.coverage(i), .93, .97);
        }
        if (hasOutliers)
          add("A5", "largest error at the end/bound " + t.name, statistics.worst() / bound.back(),
              0, 6);
      }
    }
  }

  /// What remains of the bias of measured odometry noise, when it is other than declared.
  void bias() {
    const OdometryNoise declared = OdometryNoise::white(.005, .002);
    for (const Trajectory& t : moving()) {
      biasOf(t.name, declared, false, 1, [&](double level, unsigned seed) {
        return simulate(t, {t.cP}, {OdometryNoise::white(.005 * level, .002 * level)}, seed);
      });
    }
    const std::pair<const char*, OdometryNoise> tags[] = {{"tag", OdometryNoise::white(.01, .005)},
                                                          {"tag, default noise", OdometryNoise{}}};
    for (const auto& [name, noise] : tags) {
      const OdometryNoise& odometry = noise;
      biasOf(name, odometry, true, 4, [&](double level, unsigned seed) {
        return TagSequence::simulate(odometry, level, seed);
      });
    }
  }

  void guesses() {
    for (const Trajectory& t : moving()) {
      int fewest = 1000, most = 0;
      for (const double guess : {.1, .25, 1., 4., 10.}) {
        Conditions conditions;
        Statistics statistics;
        for (unsigned seed = first_; seed < first_ + seeds_; ++seed) {
          SimulatedRun run = simulate(t, {t.cP}, conditions, seed);
          run.guesses[0] = guess * t.cP.z();
          statistics.add(run, filtered(run, withOdometry(conditions.odometry)));
        }
        fewest = std::min(fewest, statistics.medianFramesTo5Percent());
        most = std::max(most, statistics.medianFramesTo5Percent());
      }
      add("A4",
          "median frames to 5 % " + t.name + ", guesses 0.1x to 10x, spread from " +
              std::to_string(fewest),
          most - fewest, 0, 1);
    }
  }

  void rest() {
    const OdometryNoise measured = OdometryNoise::white(.005, .002);
    for (const char* name : {"S0", "R0"}) {
      const Trajectory t = trajectory(name);
      std::vector<double> changes, ratios;
      for (unsigned seed = first_; seed < first_ + seeds_; ++seed) {
        const SimulatedRun run = simulate(t, {t.cP}, {measured}, seed);
        InverseDepthFilter filter(withOdometry(measured));
        filter.reset(run.measured[0][0], {t.cP.z() / 1.5, .5});
        for (int k = 1; k < Trajectory::kFrames; ++k) {
          filter.predict(Motion::fromTwist(run.twist(k), Trajectory::kPeriod_s));
          filter.correct(run.measured[static_cast<std::size_t>(k)][0]);
        }
        changes.push_back(std::abs(filter.chi() * t.cP.z() / 1.5 - 1));
        ratios.push_back(std::sqrt(filter.variance_chi()) / .5);
      }
      std::sort(changes.begin(), changes.end());
      std::sort(ratios.begin(), ratios.end());
      add("A6", std::string("95 % of runs: change of chi in 10 s [%], ") + name,
          100 * changes[changes.size() * 95 / 100], 0, 1);
      add("A6", std::string("median sigma after/before, ") + name, ratios[ratios.size() / 2], .99,
          1.5);
    }
  }

  void joint() {
    const OdometryNoise measured = OdometryNoise::white(.005, .002);
    for (const int latency : {0, 1}) {
      for (const Trajectory& t : moving()) {
        if (t.name == "T1c") continue;
        Conditions conditions{measured};
        conditions.latency = latency;
        JointDepthFilterOptions options;
        options.filter = withOdometry(measured);
        options.estimateTimeOffset = latency > 0;
        const auto bound = boundOf(t, t.fourPoints(), measured, DepthPrior::kWideSigma_chi);
        Statistics statistics;
        for (unsigned seed = first_; seed < first_ + seeds_; ++seed) {
          const SimulatedRun run = simulate(t, t.fourPoints(), conditions, seed);
          JointDepthFilter filter(4, options);
          statistics.add(run, filtered(run, filter));
        }
        for (std::size_t i = 2; i < kCheckpointCount; ++i) {
          const std::string where = at(t, latency > 0 ? "one frame late" : "in time", i);
          add(latency > 0 ? "A7" : "A2", "joint RMSE/bound " + where,
              statistics.rmse(i) / bound[static_cast<std::size_t>(kCheckpoints[i])], 0,
              latency > 0 ? 1.5 : 1.15);
          if (latency == 0) {
            add("A3", "joint NEES " + where, statistics.nees(i), .75, 1.35);
          } else {  // with measured noise the time offset is pulled: no limit is set
            add("A7", "joint NEES " + where, statistics.nees(i), 0, 1e9);
          }
        }
      }
    }
  }

  void cost() {
    const double euler = eulerStep_ns();
    add("A8", "De Luca Euler step [ns]", euler, 0, 1e9);
    const double scalar = scalar_ns();
    add("A8", "filter, one point: motion, predict, correct [ns]", scalar, 0, 60);
    add("A8", "filter, one point / De Luca Euler step", scalar / euler, 0, 8);
    using Instructions = InverseDepthFilterBatch::Instructions;
    add("A8", "batch of 100, portable [ns per point]", batch_ns(100, Instructions::portable), 0,
        1e9);
    if (InverseDepthFilterBatch::isSupported(Instructions::avx2)) {
      const double batch = batch_ns(100, Instructions::avx2);
      add("A8", "batch of 100, AVX2 [ns per point]", batch, 0, 12);
      add("A8", "batch of 100, AVX2 / De Luca Euler step", batch / euler, 0, 2);
    }
    add("A8", "joint, 4 points, without time offset [us per image]", joint_us(4, false), 0, 2);
    add("A8", "joint, 4 points [us per image]", joint_us(4, true), 0, 2);
    add("A8", "joint, 8 points, without time offset [us per image]", joint_us(8, false), 0, 10);
    add("A8", "joint, 8 points [us per image]", joint_us(8, true), 0, 10);
  }

  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<BiasLine>& biasTable() const { return biasTable_; }

 private:
  static InverseDepthFilterOptions withOdometry(const OdometryNoise& odometry) {
    InverseDepthFilterOptions options;
    options.odometry = odometry;
    return options;
  }

  static std::vector<Trajectory> moving() {
    std::vector<Trajectory> all = trajectories();
    all.resize(all.size() - 2);
    return all;
  }

  static std::string at(const Trajectory& t, const std::string& condition, std::size_t i) {
    return t.name + ", " + condition + ", frame " + std::to_string(kCheckpoints[i]);
  }

  std::pair<Statistics, std::vector<double>> alone(const Trajectory& t,
                                                   const Conditions& conditions) const {
    Statistics statistics;
    for (unsigned seed = first_; seed < first_ + seeds_; ++seed) {
      const SimulatedRun run = simulate(t, {t.cP}, conditions, seed);
      statistics.add(run, filtered(run, withOdometry(conditions.odometry)));
    }
    return {statistics, boundOf(t, {t.cP}, conditions.odometry, HUGE_VAL)};
  }

  void biasOf(const std::string& name, const OdometryNoise& declared, bool isShort,
              std::size_t points,
              const std::function<SimulatedRun(double level, unsigned seed)>& draw) {
    BiasLine line{name, {}};
    for (const double level : kLevels) {
      Statistics statistics, without;
      for (unsigned seed = first_; seed < first_ + seeds_; ++seed) {
        const SimulatedRun run = draw(level, seed);
        for (std::size_t i = 0; i < points; ++i) {
          statistics.add(run, filtered(run, withOdometry(declared), i), i);
          if (level > 1) without.add(run, uncorrected(run, withOdometry(declared), i), i);
        }
      }
      const Worst worst(statistics, isShort);
      char at[32];
      std::snprintf(at, sizeof at, ", noise %g x declared", level);
      if (level > 1) {
        const Worst plain(without, isShort);  // equal where there is no bias: .05 is chance
        add("B2", "|mean error/sigma| " + name + at, std::abs(worst.mean), 0,
            std::abs(plain.mean) + .05);
        add("B2", "NEES " + name + at, worst.nees, 0, 1.02 * plain.nees);
      } else {
        add("B1", "|mean error/sigma| " + name + at, std::abs(worst.mean), 0, .35);
        add("B1", "2-sigma coverage " + name + at, worst.coverage, .93, 1);
      }
      line.byLevel.push_back(worst);
    }
    biasTable_.push_back(line);
  }

  void add(const std::string& id, const std::string& subject, double value, double low,
           double high) {
    rows_.push_back({id, subject, value, low, high});
  }

  /// Shortest of many repetitions: the least disturbed by what else runs.
  static double shortest_ns(const std::function<void()>& run, double steps) {
    using Clock = std::chrono::steady_clock;
    double best = 1e18;
    for (int i = 0; i < 300; ++i) {
      const auto start = Clock::now();
      run();
      best = std::min(best, std::chrono::duration<double, std::nano>(Clock::now() - start).count());
    }
    return best / steps;
  }

  /// The textbook form of De Luca, Oriolo, Robuffo Giordano 2008, eq. 11-14, integrated by Euler.
  static double eulerStep_ns() {
    double x = .1, y = -.1, chi = .5;
    const Twist u{{.1, 0, .05}, {.01, .02, .03}};
    const double k = 8, k_3 = 1600, dt = 1. / 30;
    return shortest_ns(
        [&] {
          for (int i = 0; i < 1000; ++i) {
            double zx = .1, zy = -.1;
            benchmark::DoNotOptimize(zx);
            benchmark::DoNotOptimize(zy);
            const double ox = x * u.linear.z() - u.linear.x(), oy = y * u.linear.z() - u.linear.y();
            const double ex = zx - x, ey = zy - y;
            const double wx = u.angular.x(), wy = u.angular.y(), wz = u.angular.z();
            const double dx = ox * chi + x * y * wx - (1 + x * x) * wy + y * wz + k * ex;
            const double dy = oy * chi + (1 + y * y) * wx - x * y * wy - x * wz + k * ey;
            const double dchi =
                chi * chi * u.linear.z() + chi * (y * wx - x * wy) + k_3 * (ox * ex + oy * ey);
            x += dt * dx;
            y += dt * dy;
            chi += dt * dchi;
          }
          benchmark::DoNotOptimize(chi);
        },
        1000);
  }

  static Motion there() { return Motion::fromTwist({{.1, .02, .05}, {.01, .02, .03}}, 1. / 30); }
  static Motion back() {
    Motion motion = there().inverse();
    motion.dt = -motion.dt;
    return motion;
  }

  static double scalar_ns() {
    InverseDepthFilter filter;
    const Motion motions[] = {there(), back()};
    filter.reset({.1, -.1, 1e-3}, {1});
    PointMeasurement z[2] = {{.1, -.1, 1e-3}, {.1, -.1, 1e-3}};
    filter.predict(motions[0]);
    z[0] = {filter.estimate().x, filter.estimate().y, 1e-3};
    filter.predict(motions[1]);
    return shortest_ns(
        [&] {
          for (int i = 0; i < 1000; ++i) {
            filter.predict(motions[i & 1]);
            filter.correct(z[i & 1]);
          }
        },
        1000);
  }

  static double batch_ns(std::size_t n, InverseDepthFilterBatch::Instructions instructions) {
    InverseDepthFilterBatch batch(n, {}, {}, instructions);
    Random random(1);
    std::vector<double> x[2], y[2];
    const std::vector<double> sigma(n, 1e-3);
    const Motion motions[] = {there(), back()};
    for (std::size_t i = 0; i < n; ++i) {
      batch.reset(i, {random.uniform(-.3, .3), random.uniform(-.3, .3), 1e-3}, {1});
    }
    for (int k = 0; k < 2; ++k) {
      batch.predict(motions[k]);
      for (std::size_t i = 0; i < n; ++i) {
        x[k].push_back(batch.estimate(i).x);
        y[k].push_back(batch.estimate(i).y);
      }
    }
    return shortest_ns(
        [&] {
          for (int i = 0; i < 20; ++i) {
            batch.predict(motions[i & 1]);
            batch.correct(x[i & 1].data(), y[i & 1].data(), sigma.data());
          }
        },
        20. * static_cast<double>(n));
  }

  static double joint_us(std::size_t n, bool estimateTimeOffset) {
    JointDepthFilterOptions options;
    options.estimateTimeOffset = estimateTimeOffset;
    const Trajectory t = trajectory("T5");
    std::vector<Eigen::Vector3d> points;
    Random random(1);
    for (std::size_t i = 0; i < n; ++i) points.push_back(t.cP + random.vector(.3));
    const SimulatedRun run = simulate(t, points, {}, 1);
    const MotionBuffer odometry = run.odometry();
    std::vector<std::vector<PointObservation>> seen(run.measured.size());
    for (std::size_t k = 0; k < seen.size(); ++k) {
      for (std::size_t i = 0; i < n; ++i)
        seen[k].push_back({static_cast<int>(i), run.measured[k][i]});
    }
    JointDepthFilter filter(n, options);
    const double ns = shortest_ns(
        [&] {
          filter.reset();
          for (std::size_t k = 0; k < seen.size(); ++k) {
            filter.advance(odometry, static_cast<double>(k) * Trajectory::kPeriod_s);
            filter.correct(seen[k]);
          }
        },
        static_cast<double>(seen.size()));
    return 1e-3 * ns;
  }

  unsigned seeds_, first_;
  std::vector<Row> rows_;
  std::vector<BiasLine> biasTable_;
};

void print(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    std::printf("%-3s %-64s %9.4g", row.id.c_str(), row.subject.c_str(), row.value);
    if (row.high >= 1e9) {
      std::printf("\n");
    } else if (row.low > 0) {
      std::printf("  in [%g, %g] %s\n", row.low, row.high, row.isMet() ? "met" : "MISSED");
    } else {
      std::printf("  <= %g %s\n", row.high, row.isMet() ? "met" : "MISSED");
    }
  }
}

/// As it stands in the README.
void print(const std::vector<BiasLine>& table) {
  std::printf("\n| mean error/sigma, coverage, NEES |");
  for (const double level : kLevels) std::printf(" noise %g x declared |", level);
  std::printf("\n|---|---|---|---|---|\n");
  for (const BiasLine& line : table) {
    std::printf("| %s |", line.name.c_str());
    for (const Worst& w : line.byLevel)
      std::printf(" %+.2f, %.3f, %.2f |", w.mean, w.coverage, w.nees);
    std::printf("\n");
  }
}

void printJson(const std::vector<Row>& rows, unsigned seeds, unsigned first) {
  nlohmann::json json{{"seeds", seeds},
                      {"first_seed", first},
                      {"compiler", __VERSION__},
                      {"rows", nlohmann::json::array()}};
  for (const Row& row : rows) {
    json["rows"].push_back({{"id", row.id},
                            {"subject", row.subject},
                            {"value", row.value},
                            {"low", row.low},
                            {"high", row.high},
                            {"met", row.isMet()}});
  }
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  unsigned seeds = 2000, first = 1;
  bool asJson = false;
  for (int i = 1; i < argc; ++i) {
    const bool hasNumber = i + 1 < argc && std::atoi(argv[i + 1]) > 0;
    if (std::strcmp(argv[i], "--json") == 0) {
      asJson = true;
    } else if (std::strcmp(argv[i], "--seeds") == 0 && hasNumber) {
      seeds = static_cast<unsigned>(std::atoi(argv[++i]));
    } else if (std::strcmp(argv[i], "--first-seed") == 0 && hasNumber) {
      first = static_cast<unsigned>(std::atoi(argv[++i]));
    } else {
      std::fprintf(stderr,
                   "usage: bench_estimators [--seeds N] [--first-seed N] [--json]    (N > 0, "
                   "default 2000 seeds from 1)\n");
      return 2;
    }
  }
  Bench bench(seeds, first);
  bench.filterAlone();
  bench.bias();
  bench.guesses();
  bench.rest();
  bench.joint();
  bench.cost();
  if (asJson) {
    printJson(bench.rows(), seeds, first);
  } else {
    print(bench.rows());
    print(bench.biasTable());
  }
  const auto& rows = bench.rows();
  return std::all_of(rows.begin(), rows.end(), [](const Row& r) { return r.isMet(); }) ? 0 : 1;
}
