#include "depthservo/experiments/SweepFolder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "depthservo/text/InputError.h"
#include "depthservo/text/NewFolder.h"
#include "experiments/Database.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDatabase = "sweep.sqlite";
constexpr const char* kFormat = "depthservo sweep 1";

std::string quotedName(const std::string& name) { return "\"" + name + "\""; }

/// Cells are kept as numbers where they are some: whoever asks by SQL wants to compare them.
const char* typeOf(const std::string& cell) {
  return detail::toNumber(cell) ? "REAL" : "TEXT";
}

std::string tableOf(const Sweep& sweep) {
  const Sweep::Row first = sweep.row(0);
  std::string sql = "CREATE TABLE runs (\"row\" INTEGER PRIMARY KEY";
  for (std::size_t i = 0; i < sweep.columns().size(); ++i) {
    sql += fmt::format(", {} {}", quotedName(sweep.columns()[i]), typeOf(first.cells[i]));
  }
  sql += ", seed INTEGER NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL";
  for (const std::string& metric : sweep.options().metrics) sql += ", " + metric + " REAL";
  return sql + ")";
}

void put(const Database& database, const std::string& key, const std::string& value) {
  auto statement = database.prepare("INSERT OR REPLACE INTO about VALUES (?, ?)");
  statement.bind(0, key);
  statement.bind(1, value);
  statement.step();
}

std::string get(const Database& database, const std::string& key) {
  auto statement = database.prepare("SELECT value FROM about WHERE key = ?");
  statement.bind(0, key);
  return statement.step() ? statement.text(0) : std::string();
}

/// The texts, which may change as long as the runs stay the same.
void putSource(const Database& database, const Sweep::Source& source) {
  put(database, "sweep_file", source.file);
  put(database, "sweep", source.text);
  put(database, "scenario_file", source.scenarioFile);
  put(database, "scenario", source.scenarioText);
}

void create(const fs::path& folder, const Sweep& sweep, const SweepShard& shard) {
  const Database database(folder / kDatabase, Database::Open::anew);
  database.execute("BEGIN; CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL)");
  put(database, "format", kFormat);
  put(database, "identity", sweep.identity());
  put(database, "shard", fmt::format("{}/{}", shard.index, shard.count));
  putSource(database, sweep.source());
  database.execute(tableOf(sweep));
  database.execute("COMMIT");
}

SweepShard shardOf(const std::string& text) {
  const std::size_t slash = std::min(text.find('/'), text.size());
  const auto index = detail::toInteger(text.substr(0, slash));
  const auto count = detail::toInteger(text.substr(std::min(slash + 1, text.size())));
  return {static_cast<std::size_t>(index.value_or(1)), static_cast<std::size_t>(count.value_or(1))};
}

}  // namespace

bool SweepResult::operator==(const SweepResult& other) const {
  const auto isSame = [](double a, double b) {
    return a == b || (!std::isfinite(a) && !std::isfinite(b));
  };
  return row == other.row && outcome == other.outcome && reason == other.reason &&
         std::equal(metrics.begin(), metrics.end(), other.metrics.begin(), other.metrics.end(),
                    isSame);
}

struct SweepFolder::Parts {
  Parts(const fs::path& folder, Database::Open how)
      : file(folder / kDatabase), database(file, how), shard(shardOf(get("shard"))) {
    if (get("format") != kFormat) refuse("is not a sweep of this version of depthservo");
  }

  std::string get(const std::string& key) const { return depthservo::get(database, key); }
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError({file.parent_path().string(), 0, ""}, why);
  }

  fs::path file;
  Database database;
  SweepShard shard;
  std::optional<Sweep> ownSweep;
  const Sweep* sweep = nullptr;
};

SweepFolder::SweepFolder(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
SweepFolder::~SweepFolder() = default;
SweepFolder::SweepFolder(SweepFolder&&) noexcept = default;

bool SweepFolder::isOne(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / kDatabase, ignored);
}

SweepFolder SweepFolder::begin(const fs::path& folder, const Sweep& sweep,
                               const SweepShard& shard) {
  if (!isOne(folder)) {
    makeFolder(folder, [&](const fs::path& place) { create(place, sweep, shard); });
  }
  auto parts = std::make_unique<Parts>(folder, Database::Open::write);
  if (parts->get("identity") != sweep.identity()) {
    parts->refuse("was begun with another sweep, scenario or version; name a new folder");
  }
  if (parts->shard.index != shard.index || parts->shard.count != shard.count) {
    parts->refuse(fmt::format("is shard {} of the sweep; name a new folder", parts->get("shard")));
  }
  parts->sweep = &sweep;
  parts->database.execute("BEGIN");
  putSource(parts->database, sweep.source());
  parts->database.execute("COMMIT");
  return SweepFolder(std::move(parts));
}

SweepFolder SweepFolder::open(const fs::path& folder) {
  if (!isOne(folder)) {
    throw InputError({folder.string(), 0, ""}, "is not the folder of a sweep: no sweep.sqlite");
  }
  auto parts = std::make_unique<Parts>(folder, Database::Open::read);
  parts->ownSweep.emplace(Sweep::Source{parts->get("sweep_file"), parts->get("sweep"),
                                        parts->get("scenario_file"), parts->get("scenario")});
  parts->sweep = &*parts->ownSweep;
  if (parts->get("identity") != parts->sweep->identity()) {
    parts->refuse("is of another version of depthservo");
  }
  return SweepFolder(std::move(parts));
}

const Sweep& SweepFolder::sweep() const { return *parts_->sweep; }
const SweepShard& SweepFolder::shard() const { return parts_->shard; }

std::vector<bool> SweepFolder::done() const {
  std::vector<bool> done(sweep().size(), false);
  auto statement = parts_->database.prepare("SELECT \"row\" FROM runs");
  while (statement.step()) done.at(static_cast<std::size_t>(statement.integer(0))) = true;
  return done;
}

std::vector<SweepResult> SweepFolder::results() const {
  const auto& metrics = sweep().options().metrics;
  auto statement = parts_->database.prepare(
      fmt::format("SELECT \"row\", outcome, reason{}{} FROM runs ORDER BY \"row\"",
                  metrics.empty() ? "" : ", ", fmt::join(metrics, ", ")));
  std::vector<SweepResult> all;
  while (statement.step()) {
    SweepResult result;
    result.row = static_cast<std::size_t>(statement.integer(0));
    result.outcome = statement.text(1);
    result.reason = statement.text(2);
    for (std::size_t i = 0; i < metrics.size(); ++i) {
      result.metrics.push_back(statement.number(3 + static_cast<int>(i)).value_or(kUnknown));
    }
    all.push_back(std::move(result));
  }
  return all;
}

void SweepFolder::add(const std::vector<SweepResult>& results) {
  if (results.empty()) return;
  const std::size_t cells = sweep().columns().size();
  const std::size_t values = 1 + cells + 3 + sweep().options().metrics.size();
  auto insert = parts_->database.prepare(fmt::format(
      "INSERT INTO runs VALUES ({})", fmt::join(std::vector<const char*>(values, "?"), ",")));
  parts_->database.execute("BEGIN");
  for (const SweepResult& result : results) {
    const Sweep::Row row = sweep().row(result.row);
    int at = 0;
    insert.bind(at++, static_cast<std::int64_t>(result.row));
    for (const std::string& cell : row.cells) {
      const auto number = detail::toNumber(cell);
      number ? insert.bind(at++, *number) : insert.bind(at++, cell);
    }
    insert.bind(at++, static_cast<std::int64_t>(row.seed));
    insert.bind(at++, result.outcome);
    insert.bind(at++, result.reason);
    for (const double metric : result.metrics) insert.bind(at++, metric);
    insert.step();
  }
  parts_->database.execute("COMMIT");
}

}  // namespace depthservo
