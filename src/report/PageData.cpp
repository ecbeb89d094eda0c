#include "report/PageData.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "depth/statusNames.h"
#include "report/Plots.h"
#include "report/RunFiles.h"
#include "report/TimeRows.h"
#include "report/interest.h"
#include "report/joinedEvents.h"
#include "text/TextTable.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

using detail::TextTable;

constexpr std::size_t kMostRows = 1200;  // of time: two per pixel of a chart
constexpr std::size_t kMostPoints = 32;  // in the table, and with curves
constexpr std::size_t kEventsApart = 4;  // of one kind that have lines of their own
constexpr int kDigits = 6;               // more than a screen can show

/// A column that may be empty: unknown (NaN).
double numberOrUnknown(const TextTable& table, std::size_t column) {
  constexpr detail::Range kAny{-1e300, 1e300};
  return table.text(column).empty() ? kUnknown : table.number(column, kAny, "");
}

std::string jsonNumbers(const std::vector<double>& values, int digits = kDigits) {
  std::string json = "[";
  for (const double value : values) {
    if (json.size() > 1) json += ',';
    json += std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : "null";
  }
  return json + ']';
}

/// Named columns as one object.
class Columns {
 public:
  Columns(const TimeRows& rows, const std::vector<std::pair<std::string, Shown>>& columns) {
    for (const auto& [name, shown] : columns) {
      names_.push_back(name);
      columns_.emplace_back(rows, shown);
    }
  }
  void add(std::size_t column, std::size_t frame, double value) {
    columns_[column].add(frame, value);
  }
  const std::vector<double>& operator[](std::string_view name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    return columns_[static_cast<std::size_t>(found - names_.begin())].values();
  }
  std::string json() const {
    std::string json;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      json += fmt::format("{}\"{}\":{}", i == 0 ? "" : ",", names_[i],
                          jsonNumbers(columns_[i].values()));
    }
    return '{' + json + '}';
  }

 private:
  std::vector<std::string> names_;
  std::vector<ThinnedColumn> columns_;
};

std::vector<double> readTimes(const fs::path& file, const std::vector<std::string>& columns) {
  std::vector<double> times;
  TextTable table(file.string(), TextTable::Style::csv, columns);
  while (table.next()) times.push_back(table.time());
  return times;
}

Columns readFrames(const fs::path& file, const std::vector<std::string>& names,
                   const TimeRows& rows) {
  std::vector<std::pair<std::string, Shown>> kinds;
  for (const std::string& name : names) {
    const bool isPlace = name.rfind("robot_", 0) == 0;
    kinds.emplace_back(name, isPlace              ? Shown::sample
                             : name == "measured" ? Shown::lowest
                                                  : Shown::extremes);
  }
  Columns columns(rows, kinds);
  TextTable table(file.string(), TextTable::Style::csv, names);
  for (std::size_t frame = 0; table.next(); ++frame) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      columns.add(i, frame, numberOrUnknown(table, i));
    }
  }
  return columns;
}

/// By the name in features.csv; the page has its number. unset when it has no such name.
DepthStatus statusNamed(std::string_view name) {
  const auto found = std::find(statusNames().begin(), statusNames().end(), name);
  return found == statusNames().end() ? DepthStatus::unset
                                      : static_cast<DepthStatus>(found - statusNames().begin());
}

/// Where the columns of features.csv are.
std::size_t featureColumn(std::string_view name) {
  const auto& all = featureColumns();
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), name) - all.begin());
}

/// One row of features.csv as the page takes it.
struct FeatureRow {
  int id;
  double u, v, measured, Z, sigma_Z, status, Z_true, Z_low, Z_high, excitation, sigma_uv;

  double error() const { return std::abs(Z - Z_true) / Z_true; }

  static FeatureRow of(const TextTable& table) {
    const auto number = [&](std::string_view name) {
      const std::size_t column = featureColumn(name);
      return column < table.columns() ? numberOrUnknown(table, column) : kUnknown;
    };
    const std::size_t status = featureColumn("status");
    const DepthStatus named = statusNamed(table.text(status));
    if (named == DepthStatus::unset) {
      table.fail(status, "expected a depth status, got " + detail::quoted(table.text(status)));
    }
    FeatureRow row{};
    row.id = table.id(featureColumn("id"));
    row.u = number("u");
    row.v = number("v");
    row.measured = number("measured");
    row.Z = table.number(featureColumn("Z"), detail::Range::above(0, 1e300), "m");
    row.sigma_Z = number("sigma_Z");
    row.status = static_cast<double>(named);
    row.Z_true = number("Z_true");
    row.Z_low = number("Z_low");
    const double high = number("Z_high");
    row.Z_high = std::isnan(high) ? std::numeric_limits<double>::infinity() : high;
    row.excitation = number("excitation");
    row.sigma_uv = number("sigma_uv");
    return row;
  }
};

const std::vector<std::pair<std::string, Shown>>& curveColumns() {
  static const std::vector<std::pair<std::string, Shown>> columns = {
      {"u", Shown::sample},        {"v", Shown::sample},
      {"measured", Shown::lowest}, {"Z", Shown::extremes},
      {"sigma_Z", Shown::sample},  {"status", Shown::sample},
      {"Z_true", Shown::extremes}, {"Z_low", Shown::lowest},
      {"Z_high", Shown::highest},  {"excitation", Shown::extremes},
      {"error", Shown::extremes},  {"sigma_uv", Shown::highest}};
  return columns;
}

/// features.csv: curves of the chosen points, and all points of the last image.
struct Features {
  std::map<int, Columns> curves;
  std::vector<FeatureRow> last;

  void add(const FeatureRow& row, std::size_t frame) {
    const auto point = curves.find(row.id);
    if (point == curves.end()) return;
    const double values[] = {row.u,       row.v,          row.measured, row.Z,
                             row.sigma_Z, row.status,     row.Z_true,   row.Z_low,
                             row.Z_high,  row.excitation, row.error(),  row.sigma_uv};
    for (std::size_t i = 0; i < std::size(values); ++i) point->second.add(i, frame, values[i]);
  }
};

/// Columns of a features.csv: a folder of an older version lacks the last ones.
std::vector<std::string> columnsOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string header;
  std::getline(stream, header);
  const std::size_t last = featureColumn("sigma_uv");
  std::vector<std::string> columns = featureColumns();
  if (header.find("," + columns[last]) == std::string::npos) columns.resize(last);
  return columns;
}

bool hasHeaderOnly(const fs::path& file, const std::vector<std::string>& columns) {
  const std::string header = headerLine(columns);
  std::string begin(header.size() + 1, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return stream.gcount() == static_cast<std::streamsize>(header.size()) &&
         begin.compare(0, header.size(), header) == 0;
}

Features readFeatures(const fs::path& file, const std::vector<double>& times, const TimeRows& rows,
                      const std::vector<int>& chosen) {
  Features features;
  for (const int id : chosen) features.curves.emplace(id, Columns(rows, curveColumns()));
  const std::vector<std::string> columns = columnsOf(file);
  if (hasHeaderOnly(file, columns)) return features;
  TextTable table(file.string(), TextTable::Style::csv, columns, TextTable::Order::notDecreasing);
  while (table.next()) {
    const auto frame = std::lower_bound(times.begin(), times.end(), table.time());
    if (frame == times.end() || *frame != table.time()) {
      table.fail(0, "frames.csv has no such frame");
    }
    const FeatureRow row = FeatureRow::of(table);
    features.add(row, static_cast<std::size_t>(frame - times.begin()));
    if (frame + 1 == times.end()) features.last.push_back(row);
  }
  return features;
}

std::vector<PointMetrics> pointsOf(const Json& run) {
  const auto number = [](const Json& value) {
    return value.is_null() ? kUnknown : value.get<double>();
  };
  std::vector<PointMetrics> points;
  for (const Json& json : run.at("points")) {
    PointMetrics point;
    point.id = json.at("id").get<int>();
    point.Z = number(json.at("Z"));
    point.sigma_Z = number(json.at("sigma_Z"));
    point.Z_true = number(json.at("Z_true"));
    point.relative_error = number(json.at("relative_error"));
    point.status = statusNamed(json.at("status").get<std::string>());
    point.measured_frames = json.at("measured_frames").get<std::size_t>();
    points.push_back(point);
  }
  return points;
}

/// run.json with the chosen points only, and events of a kind joined.
Json shownOf(const Json& run, const std::vector<int>& chosen) {
  Json shown = run;
  std::map<int, const Json*> byId;
  for (const Json& point : run.at("points")) byId[point.at("id").get<int>()] = &point;
  shown["points"] = Json::array();
  for (const int id : chosen) shown["points"].push_back(*byId.at(id));
  std::vector<Event> events;
  for (const Json& event : run.at("events")) {
    events.push_back({event.at("time").get<double>(), event.at("what").get<std::string>()});
  }
  shown["events"] = Json::array();
  for (const JoinedEvents& same : joined(events, kEventsApart)) {
    shown["events"].push_back({{"time", same.first_s},
                               {"last", same.last_s},
                               {"count", same.count},
                               {"what", same.what}});
  }
  return shown;
}

std::string lastJson(const std::vector<FeatureRow>& last) {
  const std::pair<const char*, double FeatureRow::*> kColumns[] = {
      {"u", &FeatureRow::u},
      {"v", &FeatureRow::v},
      {"Z", &FeatureRow::Z},
      {"sigma_Z", &FeatureRow::sigma_Z},
      {"Z_true", &FeatureRow::Z_true},
      {"status", &FeatureRow::status},
      {"measured", &FeatureRow::measured}};
  std::string json;
  for (const auto& [name, member] : kColumns) {
    std::vector<double> values;
    for (const FeatureRow& row : last) values.push_back(row.*member);
    json += fmt::format("{}\"{}\":{}", json.empty() ? "" : ",", name, jsonNumbers(values));
  }
  return '{' + json + '}';
}

/// "<" occurs in strings only; escaped, no "</script" or "<!--" can end the element.
std::string safeInScript(const std::string& json) {
  std::string safe;
  safe.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace

std::string pageData(const Json& run, const fs::path& folder) {
  const auto frameNames = frameColumns(run.at("command_names").get<std::vector<std::string>>());
  const std::vector<double> times = readTimes(folder / "frames.csv", frameNames);
  const TimeRows rows(times.size(), kMostRows);
  const Columns frames = readFrames(folder / "frames.csv", frameNames, rows);
  const std::vector<int> chosen = mostTelling(pointsOf(run), kMostPoints);
  const Features features = readFeatures(folder / "features.csv", times, rows, chosen);
  std::string points;
  for (const int id : chosen) {
    const Columns& curves = features.curves.at(id);
    points += fmt::format(R"({}{{"id":{},"limit":{:.6g},"columns":{}}})", points.empty() ? "" : ",",
                          id, depthAxisLimit(curves["Z"], curves["Z_true"]), curves.json());
  }
  std::vector<double> time_s;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    time_s.push_back(times[rows.frameOf(row)] - times.front());
  }
  constexpr int kTimeDigits = 9;
  return safeInScript(fmt::format(
      R"({{"run":{},"start":{:.9f},"bucket":{},"time":{},"statuses":{},"frames":{},"points":[{}],)"
      R"("all_points":{},"last":{}}})",
      shownOf(run, chosen).dump(-1, ' ', false, Json::error_handler_t::replace), times.front(),
      rows.bucket(), jsonNumbers(time_s, kTimeDigits), Json(statusNames()).dump(), frames.json(),
      points, run.at("points").size(), lastJson(features.last)));
}

}  // namespace depthservo
