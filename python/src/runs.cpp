#include <atomic>
#include <chrono>
#include <cmath>

#include "binding.h"
#include "depth/statusNames.h"
#include "depthservo/experiments/Compare.h"
#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/observation/words.h"
#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/rig/RecordedRig.h"
#include "depthservo/scenario/observationOf.h"
#include "depthservo/scenario/run.h"
#include "report/reportable.h"

namespace depthservo::python {
namespace {

/// Now and then asks the interpreter whether somebody pressed Ctrl-C.
class Signals {
 public:
  /// False: stop.
  bool mayGoOn() {
    constexpr std::chrono::milliseconds kPause{100};
    const auto now = std::chrono::steady_clock::now();
    if (isStopped_ || now < next_) return !isStopped_;
    next_ = now + kPause;
    const py::gil_scoped_acquire interpreter;
    isStopped_ = PyErr_CheckSignals() != 0;
    return !isStopped_;
  }

  /// With the interpreter. \throw error_already_set KeyboardInterrupt, if that was it
  void rethrow() const {
    if (isStopped_) throw py::error_already_set();
  }

 private:
  std::chrono::steady_clock::time_point next_{};
  bool isStopped_ = false;
};

class Watcher : public RunWatcher {
 public:
  bool onFrame(const RunFrame& /*frame*/) override { return signals_.mayGoOn(); }
  void rethrow() const { signals_.rethrow(); }

 private:
  Signals signals_;
};

/// Calls it while other Python threads may run.
template <class F>
auto watched(const F& f) {
  Watcher watcher;
  auto result = [&] {
    const py::gil_scoped_release others;
    return f(&watcher);
  }();
  watcher.rethrow();
  return result;
}

py::object fromJson(const std::string& text) {
  return py::module_::import("json").attr("loads")(text);
}

/// Collects columns by name.
class Table {
 public:
  void add(const char* column, double value) { columns_[find(column)].second.push_back(value); }

  py::dict dict() const {
    py::dict result;
    for (const auto& [name, values] : columns_) result[py::str(name)] = arrayOf(values);
    return result;
  }

 private:
  std::size_t find(const char* column) {
    if (next_ == columns_.size()) next_ = 0;
    if (next_ < columns_.size() && columns_[next_].first == column) return next_++;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (columns_[i].first == column) return next_ = i + 1, i;
    }
    columns_.emplace_back(column, std::vector<double>{});
    return next_ = columns_.size(), columns_.size() - 1;
  }

  std::vector<std::pair<std::string, std::vector<double>>> columns_;
  std::size_t next_ = 0;  // columns come in turn
};

/// A cell of a CSV: what is infinite is empty there.
double cellOf(double value) { return std::isfinite(value) ? value : kUnknown; }

/// As features.csv.
py::dict featuresOf(const RunLog& log) {
  Table table;
  std::vector<int> statuses;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (feature.estimate.status == DepthStatus::unset) continue;
      const DepthEstimate estimate = reportable(feature.estimate);
      const auto [low, high] = estimate.interval();
      table.add("timestamp", frame.time_s);
      table.add("id", feature.id);
      table.add("u", cellOf(feature.u));
      table.add("v", cellOf(feature.v));
      table.add("measured", feature.measured ? 1 : 0);
      table.add("Z", estimate.Z());
      table.add("sigma_Z", estimate.sigma_Z());
      table.add("Z_true", cellOf(feature.Z_true));
      table.add("Z_low", cellOf(low));
      table.add("Z_high", cellOf(high));
      table.add("excitation", cellOf(estimate.excitation));
      table.add("frames_to_5pct", cellOf(feature.frames_to_5pct));
      table.add("sigma_uv", cellOf(estimate.sigma_xy * log.camera.fx));
      statuses.push_back(static_cast<int>(estimate.status));
    }
  }
  py::dict result = table.dict();
  if (statuses.empty()) return result;
  result["id"] = result["id"].attr("astype")("int64");
  result["measured"] = result["measured"].attr("astype")("bool");
  const py::object words = py::module_::import("numpy").attr("array")(py::cast(statusNames()));
  result["status"] =
      words[py::array_t<int>(static_cast<py::ssize_t>(statuses.size()), statuses.data())];
  return result;
}

/// The figures of frames.csv that every run has.
py::dict framesOf(const RunLog& log) {
  Table table;
  for (const FrameRecord& frame : log.frames) {
    table.add("timestamp", frame.time_s);
    table.add("error_px", frame.error_px);
    const Vector6d twist = frame.twist.vector();
    const char* const names[] = {"vx", "vy", "vz", "wx", "wy", "wz"};
    for (int i = 0; i < 6; ++i) table.add(names[i], twist(i));
    const char* const pose[] = {"robot_x", "robot_y", "robot_theta"};
    for (int i = 0; i < 3; ++i) table.add(pose[i], frame.robotPose(i));
  }
  return table.dict();
}

void bindRun(py::module_& module) {
  py::class_<RunLog>(module, "Run", "The whole story of a run or a replay.")
      .def_readonly("name", &RunLog::name)
      .def_property_readonly(
          "outcome",
          [](const RunLog& log) -> py::object {
            if (!log.hasOutcome) return py::none();
            return py::str(toString(log.outcome));
          },
          "converged | stalled | left-image | lost | diverged | collision | timeout; None of a "
          "replay.")
      .def_readonly("reason", &RunLog::reason, "Why it ended like this, a sentence.")
      .def_property_readonly(
          "result", [](const RunLog& log) { return fromJson(toJson(log)); },
          "As `--json` of the tool: outcome, metrics, diagnosis, points.")
      .def_property_readonly(
          "features", &featuresOf,
          "Columns of features.csv, an array each: one row per feature and frame.")
      .def_property_readonly("frames", &framesOf, "Columns of frames.csv, an array each.")
      .def_property_readonly(
          "events",
          [](const RunLog& log) {
            py::list events;
            for (const Event& e : log.events) events.append(py::make_tuple(e.time_s, e.what));
            return events;
          },
          "(time [s], what).")
      .def(
          "write",
          [](const RunLog& log, const std::string& folder) {
            const py::gil_scoped_release others;
            writeRunFolder(log, folder);
          },
          py::arg("folder"), "As a run folder with report.html; it must not exist.");
}

/// What was asked for of a replay, over what the sequence says.
struct Asked {
  std::string estimator, tracker, motion;
  std::optional<double> prior, priorSigma, pixelNoise;
  py::object errors;
  std::optional<OdometryNoise> odometry;
  std::string rows;
};

ObservationOptions optionsOf(const Sequence& sequence, const Asked& asked) {
  ObservationOptions options = observationOf(sequence);
  options.tracker = trackerNamed(asked.tracker, {"tracker", 0, ""});
  options.motion = motionNamed(asked.motion, {"motion", 0, ""});
  if (!asked.estimator.empty()) {
    options.depth.estimator = estimatorNamed(asked.estimator, {"estimator", 0, ""});
  }
  if (!asked.rows.empty()) options.rows = rowMeaningNamed(asked.rows, {"rows", 0, ""});
  if (asked.prior) options.depth.initial = *asked.prior;
  if (asked.priorSigma) options.priorSigma_Z = asked.priorSigma;
  if (asked.pixelNoise) {
    options.pixelNoise_px = *asked.pixelNoise;
    options.isPixelNoiseGiven = true;
  }
  if (asked.odometry) options.odometryNoise = asked.odometry;
  if (asked.errors.is_none()) return options;
  if (py::isinstance<py::str>(asked.errors)) {
    const auto word = asked.errors.cast<std::string>();
    const auto kind = errorKindNamed(word);
    if (!kind) {
      throw InputError({"errors", 0, ""}, "'" + word + "' is not known; the nearest is '" +
                                              nearestWord(word, errorKindNames()) + "'");
    }
    options.depth.errors = *kind;
  } else {
    options.depth.errors = ErrorKind::file;
    options.depth.profile = asked.errors.cast<ErrorProfile>();
  }
  return options;
}

template <class... Extra>
void bindReplay(py::module_& module, Extra&&... extra) {
  module.def(
      "replay",
      [](const Sequence& sequence, const std::string& estimator, const std::string& tracker,
         const std::string& motion, std::optional<double> prior, std::optional<double> priorSigma,
         std::optional<double> pixelNoise, py::object errors, std::optional<OdometryNoise> odometry,
         const std::string& rows) {
        const ObservationOptions options =
            optionsOf(sequence, {estimator, tracker, motion, prior, priorSigma, pixelNoise,
                                 std::move(errors), odometry, rows});
        return watched([&](RunWatcher* watcher) { return replay(sequence, options, watcher); });
      },
      py::arg("sequence"), py::kw_only(), std::forward<Extra>(extra)...,
      "Observes depth on a Sequence, as `depthservo replay` does; other threads may run "
      "meanwhile.\n\n"
      "estimator: constant | two-frame | nonlinear | window | filter | joint | pose; '': as the "
      "sequence\n"
      "says, filter. tracker: dots | apriltag | klt | tracks | auto. motion: twist | groundtruth | "
      "target |\n"
      "auto. prior, prior_sigma [m]. pixel_noise: 1 sigma per axis [px]. errors: typical | poses | "
      "arm |\n"
      "declared | exact, or an ErrorProfile. rows: hold | instant | mean-before.");
}

RunLog runScenario(const std::string& file, const std::vector<std::string>& overrides) {
  const Scenario scenario = Scenario::load(file, overrides);
  return watched([&](RunWatcher* watcher) { return run(scenario, watcher); });
}

std::vector<EstimatorKind> estimatorsNamed(const std::vector<std::string>& names) {
  std::vector<EstimatorKind> kinds;
  for (const std::string& name : names)
    kinds.push_back(estimatorNamed(name, {"estimators", 0, ""}));
  return kinds;
}

/// Everything of a comparison, as compare.csv has it.
py::dict comparisonOf(const Comparison& comparison) {
  py::dict result;
  result["name"] = comparison.name;
  result["time"] = arrayOf(comparison.time_s);
  result["verdict"] = verdictOf(comparison);
  const auto add = [](py::dict& to, const ComparedEstimator& e) {
    py::dict curves;
    curves["error"] = arrayOf(e.error);
    curves["sigma"] = arrayOf(e.sigma);
    curves["coverage_2sigma"] = e.coverage_2sigma;
    curves["frames_to_5pct"] = e.frames_to_5pct;
    to[py::str(e.name)] = curves;
  };
  py::dict estimators, limits;
  for (const ComparedEstimator& e : comparison.estimators) add(estimators, e);
  for (const ComparedEstimator& e : comparison.limits) add(limits, e);
  result["estimators"] = estimators;
  result["limits"] = limits;
  return result;
}

void bindCompare(py::module_& module) {
  module.def(
      "_compare_scenario",
      [](const std::string& file, const std::vector<std::string>& overrides,
         const std::vector<std::string>& names) {
        const Scenario scenario = Scenario::load(file, overrides);
        const CompareOptions options{estimatorsNamed(names), {}};
        return comparisonOf(watched([&](RunWatcher* w) { return compare(scenario, options, w); }));
      },
      py::arg("file"), py::arg("overrides"), py::arg("estimators"));
  module.def(
      "_compare_sequence",
      [](const Sequence& sequence, const std::vector<std::string>& names) {
        const CompareOptions options{estimatorsNamed(names), {}};
        const ObservationOptions observation = observationOf(sequence);
        return comparisonOf(
            watched([&](RunWatcher* w) { return compare(sequence, observation, options, w); }));
      },
      py::arg("sequence"), py::arg("estimators"));
}

/// \return whether all runs are done
bool runSweepIn(const std::string& file, const std::string& out, int jobs,
                const py::function& resolve) {
  const Sweep sweep =
      Sweep::load(file, [&](const std::string& name) { return resolve(name).cast<std::string>(); });
  Signals signals;
  bool isComplete = false;
  {
    const py::gil_scoped_release others;
    std::atomic<bool> isStopped{false};
    SweepFolder folder = SweepFolder::begin(out, sweep, {});
    isComplete = runSweep(
        folder, jobs, [&] { return isStopped.load(); },
        [&](const SweepProgress&) { isStopped = !signals.mayGoOn(); });
  }
  signals.rethrow();
  if (isComplete) writeSweepReport(out, false);
  return isComplete;
}

void bindSweeps(py::module_& module) {
  module.def("_sweep", &runSweepIn, py::arg("file"), py::arg("out"), py::arg("jobs"),
             py::arg("resolve"));
  module.def(
      "_sweep_csv",
      [](const std::string& folder) {
        const SweepFolder opened = SweepFolder::open(folder);
        return sweepCsv(opened.sweep(), opened.results());
      },
      py::arg("folder"));
  module.def(
      "_sweep_json",
      [](const std::string& folder) {
        const SweepFolder opened = SweepFolder::open(folder);
        return fromJson(sweepJson(opened.sweep(), opened.results()));
      },
      py::arg("folder"));
}

}  // namespace

void bindRuns(py::module_& module) {
  bindRun(module);
  bindReplay(module, py::arg("estimator") = "", py::arg("tracker") = "auto",
             py::arg("motion") = "auto", py::arg("prior") = py::none(),
             py::arg("prior_sigma") = py::none(), py::arg("pixel_noise") = py::none(),
             py::arg("errors") = py::none(), py::arg("odometry_noise") = py::none(),
             py::arg("rows") = "");
  module.def("_run", &runScenario, py::arg("file"), py::arg("overrides"));
  module.def(
      "_record",
      [](const std::string& file, const std::vector<std::string>& overrides,
         const std::string& folder) {
        const Scenario scenario = Scenario::load(file, overrides);
        return watched([&](RunWatcher* watcher) { return record(scenario, folder, watcher); });
      },
      py::arg("file"), py::arg("overrides"), py::arg("folder"));
  bindCompare(module);
  bindSweeps(module);
}

}  // namespace depthservo::python
