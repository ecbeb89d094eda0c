#include <fmt/format.h>
#include <fmt/ranges.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/scenario/run.h"
#include "depthservo/text/InputError.h"
#include "experiments/sweepMetrics.h"
#include "observation/Stopwatch.h"

namespace depthservo {
namespace {

/// Results are stored, and progress is told, at least this often.
constexpr std::chrono::milliseconds kStoreEvery{100};

/// Ends a run that nobody waits for any longer, and measures it as it goes.
class Meter : public RunWatcher {
 public:
  Meter(const std::function<bool()>& isStopped, bool needsPoints)
      : isStopped_(isStopped), needsPoints_(needsPoints) {}

  bool onFrame(const RunFrame& frame) override {
    if (!meter_) begin(frame.log.camera);
    meter_->add(frame.record);
    wasStopped_ = wasStopped_ || isStopped_();
    return !wasStopped_;
  }
  bool wasStopped() const { return wasStopped_; }
  Metrics result(const RunLog& log) const {
    if (!meter_) return {};
    Metrics metrics = meter_->result(log);
    const double last_s = log.frames.back().time_s;
    metrics.final_error_px = meanImageError(log, last_s - kImageErrorOver_s, last_s);
    return metrics;
  }

 private:
  void begin(const PinholeCamera& camera) {
    meter_.emplace(camera, std::vector<Eigen::Vector2d>{});  // it keeps no frames of its own
    meter_->omitExcitation();
    if (!needsPoints_) meter_->omitPoints();
  }

  const std::function<bool()>& isStopped_;
  bool needsPoints_;
  std::optional<MetricsMeter> meter_;
  bool wasStopped_ = false;
};

std::vector<double> metricsOf(const Sweep& sweep, const Metrics& metrics) {
  std::vector<double> values;
  for (const std::string& name : sweep.options().metrics) {
    values.push_back((*sweepMetric(name))(metrics));
  }
  return values;
}

bool needsPoints(const Sweep& sweep) {
  static const std::set<std::string> ofFrames{"duration_s",       "frames",
                                              "min_frame_rate",   "final_error_px",
                                              "final_distance_m", "final_angle_rad"};
  const auto& metrics = sweep.options().metrics;
  return std::any_of(metrics.begin(), metrics.end(),
                     [](const std::string& metric) { return ofFrames.count(metric) == 0; });
}

/// Sigma is judged with the diagnosis, which takes a third of the time.
Keep keepFor(const Sweep& sweep) {
  const auto& metrics = sweep.options().metrics;
  const bool needsSigma =
      std::any_of(metrics.begin(), metrics.end(), [](const std::string& metric) {
        return metric == "coverage_2sigma" || metric == "time_to_5pct_s";
      });
  return needsSigma ? Keep::theLastFrames : Keep::theOutcome;
}

SweepResult resultOf(const Sweep& sweep, std::size_t row, const std::vector<std::string>& overrides,
                     const std::function<bool()>& isStopped) {
  SweepResult result;
  result.row = row;
  Meter meter(isStopped, needsPoints(sweep));
  try {
    const Scenario scenario = sweep.scenario(sweep.row(row), overrides);
    const RunLog log = run(scenario, &meter, keepFor(sweep));
    if (meter.wasStopped()) return result;
    result.outcome = toString(log.outcome);
    result.reason = log.reason;
    result.metrics = metricsOf(sweep, meter.result(log));
  } catch (const InputError& error) {
    result.outcome = kRefused;
    result.reason = error.key().empty() ? error.message() : error.key() + ": " + error.message();
    result.metrics.assign(sweep.options().metrics.size(), kUnknown);
  }
  return result;
}

/// Results on their way from many threads to the one that stores them.
class Finished {
 public:
  void add(SweepResult result) {
    const std::lock_guard lock(mutex_);
    results_.push_back(std::move(result));
  }
  void end(std::exception_ptr why) {
    const std::lock_guard lock(mutex_);
    isEnded_ = true;
    why_ = std::move(why);
    ended_.notify_all();
  }
  /// What has come in the meantime. \return whether that was all
  bool take(std::vector<SweepResult>& results) {
    std::unique_lock lock(mutex_);
    ended_.wait_for(lock, kStoreEvery, [&] { return isEnded_; });
    results = std::exchange(results_, {});
    return isEnded_;
  }
  std::exception_ptr why() const { return why_; }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  std::vector<SweepResult> results_;
  bool isEnded_ = false;
  std::exception_ptr why_;
};

/// Does the work for 0..count-1, one at a time to each thread.
void inParallel(std::size_t count, const std::function<void(std::size_t)>& work) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count, 1),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
      },
      tbb::simple_partitioner());
}

void runAll(const Sweep& sweep, const std::vector<std::size_t>& rows, int jobs,
            const std::function<bool()>& isStopped, Finished& finished) {
  std::exception_ptr why;
  try {
    tbb::task_arena arena(jobs > 0 ? jobs : tbb::task_arena::automatic);
    arena.execute([&] {
      inParallel(rows.size(), [&](std::size_t i) {
        if (isStopped()) return;
        SweepResult result = runRow(sweep, rows[i], isStopped);
        if (!result.outcome.empty()) finished.add(std::move(result));
      });
    });
  } catch (...) {
    why = std::current_exception();
  }
  finished.end(why);
}

}  // namespace

SweepResult runRow(const Sweep& sweep, std::size_t row, const std::function<bool()>& isStopped) {
  return resultOf(sweep, row, {}, isStopped);
}

std::vector<SweepResult> runRows(const Sweep& sweep, const std::vector<std::size_t>& rows,
                                 const std::vector<std::string>& overrides) {
  std::vector<SweepResult> results(rows.size());
  inParallel(rows.size(), [&](std::size_t i) {
    results[i] = resultOf(sweep, rows[i], overrides, [] { return false; });
  });
  return results;
}

double SweepProgress::left_s() const {
  if (doneNow == 0) return kUnknown;
  return elapsed_s / static_cast<double>(doneNow) * static_cast<double>(total - done);
}

bool runSweep(SweepFolder& folder, int jobs, const std::function<bool()>& isStopped,
              const std::function<void(const SweepProgress&)>& onProgress) {
  const std::vector<bool> done = folder.done();
  SweepProgress progress;
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < done.size(); ++row) {
    if (!folder.shard().has(row)) continue;
    ++progress.total;
    done[row] ? void(++progress.done) : rows.push_back(row);
  }
  Finished finished;
  std::atomic<bool> isBroken{false};  // what was done cannot be stored
  const std::function<bool()> isOver = [&] { return isBroken || isStopped(); };
  std::thread runner([&] { runAll(folder.sweep(), rows, jobs, isOver, finished); });
  Stopwatch watch;
  try {
    for (bool isEnd = false; !isEnd;) {
      std::vector<SweepResult> results;
      isEnd = finished.take(results);
      folder.add(results);
      progress.done += results.size();
      progress.doneNow += results.size();
      progress.elapsed_s += watch.lap();
      onProgress(progress);
    }
  } catch (...) {
    isBroken = true;
    runner.join();
    throw;
  }
  runner.join();
  if (finished.why()) std::rethrow_exception(finished.why());
  return progress.done == progress.total;
}

}  // namespace depthservo
