#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "depthservo/experiments/JudgedClaim.h"
#include "depthservo/experiments/Sweep.h"

namespace depthservo {

/// A part of the runs of a sweep: every `count`-th, from `index` on.
struct SweepShard {
  std::size_t index = 1, count = 1;  ///< 1..count

  bool has(std::size_t row) const { return row % count == index - 1; }
  std::size_t sizeOf(std::size_t runs) const { return (runs + count - index) / count; }
};

/// What is kept of a run.
struct SweepResult {
  std::size_t row = 0;
  std::string outcome, reason;
  std::vector<double> metrics;  ///< as `SweepOptions::metrics`; not finite: not known

  bool operator==(const SweepResult& other) const;  ///< as stored: all that is not known is alike
};

/// The results of a sweep: `sweep.sqlite`, which holds all that is known of them, and what is made
/// from it: `runs.csv`, `sweep.json`, `report.html`, pictures, `worst`.
///
/// Results are added in transactions: a program that is killed leaves those that were committed,
/// and the next one goes on with the others. One program at a time.
class SweepFolder {
 public:
  /// Makes it, or opens the one that is there. \throw InputError it is of another sweep, shard or
  /// version, or something else
  static SweepFolder begin(const std::filesystem::path& folder, const Sweep& sweep,
                           const SweepShard& shard);
  /// \throw InputError it is none
  static SweepFolder open(const std::filesystem::path& folder);
  ~SweepFolder();
  SweepFolder(SweepFolder&&) noexcept;

  static bool isOne(const std::filesystem::path& folder);

  const Sweep& sweep() const;
  const SweepShard& shard() const;
  std::vector<bool> done() const;  ///< by row of the whole sweep
  std::vector<SweepResult> results() const;  ///< by ascending row
  /// \throw InputError not all could be written; nothing was
  void add(const std::vector<SweepResult>& results);

 private:
  struct Parts;
  explicit SweepFolder(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// The run of this row as a result. \param isStopped asked now and then; true: an unfinished one,
/// whose outcome is empty
SweepResult runRow(const Sweep& sweep, std::size_t row, const std::function<bool()>& isStopped);

/// These rows in turn, on all processors. \param overrides "key=value" each, over those of a row
std::vector<SweepResult> runRows(const Sweep& sweep, const std::vector<std::size_t>& rows,
                                 const std::vector<std::string>& overrides = {});

struct SweepProgress {
  std::size_t done = 0, total = 0;  ///< of this shard
  double elapsed_s = 0;
  std::size_t doneNow = 0;  ///< since it was begun or taken up
  double left_s() const;    ///< by the runs done now; NaN: not known yet
};

/// Runs what is missing. \param jobs threads; 0: as many as there are processors \param isStopped
/// asked now and then; true: ends soon, with all finished runs stored \return whether all are done
bool runSweep(SweepFolder& folder, int jobs, const std::function<bool()>& isStopped,
              const std::function<void(const SweepProgress&)>& onProgress);

/// Claims of the sweep, judged by its results.
std::vector<JudgedClaim> judgedClaims(const Sweep& sweep, const std::vector<SweepResult>& results);

/// Results as CSV, sorted by row: equal results are equal bytes.
std::string sweepCsv(const Sweep& sweep, const std::vector<SweepResult>& results);

/// "912 of 1000 runs converged; 51 left-image, 37 stalled".
std::string sweepVerdict(const Sweep& sweep, const std::vector<SweepResult>& results);

/// One JSON object: name, runs, outcomes by number, claims.
std::string sweepJson(const Sweep& sweep, const std::vector<SweepResult>& results);

/// Makes everything in a folder that is made from its results. \param withWorst repeats the worst
/// runs, each a run folder \param named what the folder will be called; empty: as it is \throw
/// InputError
void writeSweepReport(const std::filesystem::path& folder, bool withWorst,
                      const std::filesystem::path& named = {});

/// Joins shards of one sweep into a new folder with its report, whole or not at all; each may come
/// several times.
/// \throw InputError they are of different sweeps, contradict each other, or lack runs
void mergeSweeps(const std::vector<std::filesystem::path>& shards,
                 const std::filesystem::path& folder);

}  // namespace depthservo
