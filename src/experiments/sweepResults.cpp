#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/text/InputError.h"
#include "depthservo/text/NewFolder.h"
#include "experiments/Claim.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// As a cell of CSV.
std::string csvCell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// Whether a run has all of the cells that a claim asks for.
class Condition {
 public:
  Condition(const Sweep& sweep, const std::vector<std::string>& where) {
    for (const std::string& condition : where) {
      const std::size_t equals = condition.find('=');
      const auto& columns = sweep.columns();
      const auto column = std::find(columns.begin(), columns.end(), condition.substr(0, equals));
      wanted_.emplace_back(column - columns.begin(), condition.substr(equals + 1));
    }
  }
  bool holds(const Sweep::Row& row) const {
    return std::all_of(wanted_.begin(), wanted_.end(), [&](const auto& one) {
      return row.cells[static_cast<std::size_t>(one.first)] == one.second;
    });
  }

 private:
  std::vector<std::pair<std::ptrdiff_t, std::string>> wanted_;
};

/// \param values not empty
double statistic(SweepFigure of, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  switch (of) {
    case SweepFigure::median:
      return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
    case SweepFigure::mean:
      return std::accumulate(values.begin(), values.end(), 0.) /
             static_cast<double>(values.size());
    case SweepFigure::min:
      return values.front();
    default:
      return values.back();
  }
}

/// What a claim is about; NaN: there is no such run, or it is not known of one of them.
double measured(const Sweep& sweep, const SweepClaim& claim,
                const std::vector<SweepResult>& results) {
  const SweepOptions& options = sweep.options();
  const auto metric = std::find(options.metrics.begin(), options.metrics.end(), claim.metric);
  const auto index = static_cast<std::size_t>(metric - options.metrics.begin());
  const Condition condition(sweep, claim.where);
  std::size_t runs = 0, successes = 0;
  std::vector<double> values;
  for (const SweepResult& result : results) {
    if (!condition.holds(sweep.row(result.row))) continue;
    ++runs;
    const auto& success = options.success;
    successes += std::find(success.begin(), success.end(), result.outcome) != success.end() ? 1 : 0;
    if (index < result.metrics.size()) values.push_back(result.metrics[index]);
  }
  if (runs == 0) return kUnknown;
  if (claim.of == SweepFigure::count) return static_cast<double>(successes);
  if (claim.of == SweepFigure::share) {
    return static_cast<double>(successes) / static_cast<double>(runs);
  }
  const bool isKnown = std::all_of(values.begin(), values.end(),
                                   [](double value) { return std::isfinite(value); });
  return isKnown ? statistic(claim.of, std::move(values)) : kUnknown;
}

/// The rows that a shard should have and has not.
std::size_t missingOf(const SweepFolder& folder) {
  const std::vector<bool> done = folder.done();
  std::size_t missing = 0;
  for (std::size_t row = 0; row < done.size(); ++row) {
    missing += folder.shard().has(row) && !done[row] ? 1 : 0;
  }
  return missing;
}

/// Adds what is new. \throw InputError it contradicts what is there
void join(std::vector<SweepResult>& all, const std::vector<SweepResult>& more,
          const fs::path& place) {
  std::vector<SweepResult> joined;
  const auto isBefore = [](const SweepResult& a, const SweepResult& b) { return a.row < b.row; };
  std::merge(all.begin(), all.end(), more.begin(), more.end(), std::back_inserter(joined), isBefore);
  const auto twice = std::adjacent_find(
      joined.begin(), joined.end(), [](const SweepResult& a, const SweepResult& b) {
        return a.row == b.row && !(a == b);
      });
  if (twice != joined.end()) {
    throw InputError({place.string(), 0, fmt::format("row {}", twice->row)},
                     "has another result than in a folder before it: they are not of one program "
                     "on equal machines");
  }
  joined.erase(std::unique(joined.begin(), joined.end()), joined.end());
  all = std::move(joined);
}

}  // namespace

std::vector<JudgedClaim> judgedClaims(const Sweep& sweep, const std::vector<SweepResult>& results) {
  std::vector<JudgedClaim> rows;
  for (const SweepClaim& claim : sweep.options().claims) {
    Claim judged;
    judged.id = claim.id;
    judged.text = claim.claim;
    judged.unit = claim.unit;
    judged.note = claim.note;
    judged.expected = claim.expected;
    judged.within = claim.within;
    Measurements measurements;
    measurements.add(claim.id, measured(sweep, claim, results));
    rows.push_back(judge(judged, measurements));
  }
  return rows;
}

std::string sweepCsv(const Sweep& sweep, const std::vector<SweepResult>& results) {
  std::string csv = "row";
  for (const std::string& column : sweep.columns()) csv += "," + column;
  csv += ",seed,outcome,reason";
  for (const std::string& metric : sweep.options().metrics) csv += "," + metric;
  csv += '\n';
  for (const SweepResult& result : results) {
    const Sweep::Row row = sweep.row(result.row);
    csv += std::to_string(result.row);
    for (const std::string& cell : row.cells) csv += "," + csvCell(cell);
    csv += fmt::format(",{},{},{}", row.seed, result.outcome, csvCell(result.reason));
    for (const double metric : result.metrics) {
      csv += std::isfinite(metric) ? fmt::format(",{}", metric) : ",";
    }
    csv += '\n';
  }
  return csv;
}

void mergeSweeps(const std::vector<fs::path>& shards, const fs::path& folder) {
  requireNewRunFolder(folder);
  std::optional<Sweep::Source> source;
  std::string identity;
  std::vector<SweepResult> all;
  for (const fs::path& place : shards) {
    const SweepFolder shard = SweepFolder::open(place);
    if (!source) {
      source = shard.sweep().source();
      identity = shard.sweep().identity();
    }
    if (shard.sweep().identity() != identity) {
      throw InputError({place.string(), 0, ""},
                       "is of another sweep than " + shards.front().string());
    }
    if (const std::size_t missing = missingOf(shard); missing > 0) {
      throw InputError({place.string(), 0, ""},
                       fmt::format("lacks {} of its runs; finish it by the command that began it",
                                   missing));
    }
    join(all, shard.results(), place);
  }
  const Sweep sweep(*source);
  if (all.size() < sweep.size()) {
    std::size_t first = 0;
    while (first < all.size() && all[first].row == first) ++first;
    throw InputError({folder.string(), 0, ""},
                     fmt::format("would lack {} of {} runs, row {} first: name all shards",
                                 sweep.size() - all.size(), sweep.size(), first));
  }
  makeFolder(folder, [&](const fs::path& place) {
    const fs::path inner = place / "merged";
    {
      SweepFolder merged = SweepFolder::begin(inner, sweep, {});
      merged.add(all);
    }
    for (const auto& entry : fs::directory_iterator(inner)) {
      fs::rename(entry.path(), place / entry.path().filename());
    }
    fs::remove(inner);
    writeSweepReport(place, true, folder);
  });
}

}  // namespace depthservo
