#include "depthservo/report/Report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "depthservo/observation/RunLog.h"
#include "report/EmbeddedReport.h"
#include "report/Html.h"
#include "report/Plots.h"
#include "report/RunFiles.h"
#include "text/TextFile.h"
#include "text/TextTable.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

using detail::TextTable;

/// Largest file that is read [bytes].
constexpr std::size_t kLargestFile = std::size_t{1} << 28;

/// A column that may be empty: unknown (NaN).
double numberOrUnknown(const TextTable& table, std::size_t column) {
  constexpr detail::Range kAny{-1e300, 1e300};
  return table.text(column).empty() ? kUnknown : table.number(column, kAny, "");
}

/// frames.csv, by column.
struct Frames {
  std::vector<double> times;                 ///< increasing [s]
  std::vector<std::vector<double>> columns;  ///< as frameColumns(), timestamp included
};

Frames readFrames(const fs::path& file, const std::vector<std::string>& columns) {
  Frames frames;
  frames.columns.resize(columns.size());
  TextTable table(file.string(), TextTable::Style::csv, columns);
  while (table.next()) {
    frames.times.push_back(table.time());
    for (std::size_t i = 0; i < columns.size(); ++i) {
      frames.columns[i].push_back(numberOrUnknown(table, i));
    }
  }
  return frames;
}

/// features.csv of one point, aligned with the frames: unknown where a frame does not know the
/// point.
struct Point {
  std::vector<std::vector<double>> columns;  ///< as featureColumns()
  const std::vector<double>& operator[](std::string_view column) const {
    return columns[indexOf(column)];
  }
  static std::size_t indexOf(std::string_view column) {
    const auto& all = featureColumns();
    return static_cast<std::size_t>(std::find(all.begin(), all.end(), column) - all.begin());
  }
};

/// Every depth status by name; features.csv has the name, the page its index here.
const std::vector<std::string>& statusNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (int i = 0; i <= static_cast<int>(DepthStatus::lost); ++i) {
      all.emplace_back(toString(static_cast<DepthStatus>(i)));
    }
    return all;
  }();
  return names;
}

double statusIndex(const TextTable& table, std::size_t column) {
  const auto found = std::find(statusNames().begin(), statusNames().end(), table.text(column));
  if (found != statusNames().end()) return static_cast<double>(found - statusNames().begin());
  table.fail(column, "expected a depth status, got " + detail::quoted(table.text(column)));
}

std::map<int, Point> readFeatures(const fs::path& file, const std::vector<double>& times) {
  constexpr detail::Range kDepths = detail::Range::above(0, 1e300);
  const std::size_t id = Point::indexOf("id"), Z = Point::indexOf("Z"),
                    status = Point::indexOf("status");
  std::map<int, Point> points;
  const std::string noPointWasSeen = headerLine(featureColumns());
  if (detail::readFile(file.string(), kLargestFile) == noPointWasSeen) return points;
  TextTable table(file.string(), TextTable::Style::csv, featureColumns(),
                  TextTable::Order::notDecreasing);
  while (table.next()) {
    const auto frame = std::lower_bound(times.begin(), times.end(), table.time());
    if (frame == times.end() || *frame != table.time()) {
      table.fail(0, "frames.csv has no such frame");
    }
    const auto row = static_cast<std::size_t>(frame - times.begin());
    Point& point = points[table.id(id)];
    point.columns.resize(featureColumns().size(), std::vector<double>(times.size(), kUnknown));
    for (std::size_t i = 0; i < featureColumns().size(); ++i) {
      if (i == status) {
        point.columns[i][row] = statusIndex(table, i);
      } else if (i == Z) {
        point.columns[i][row] = table.number(i, kDepths, "m");
      } else {
        point.columns[i][row] = numberOrUnknown(table, i);
      }
    }
  }
  return points;
}

/// As many digits as a screen can show; unknown is null.
std::string jsonNumbers(const std::vector<double>& values, int digits = 6) {
  std::string json = "[";
  for (const double value : values) {
    if (json.size() > 1) json += ',';
    json += std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : "null";
  }
  return json + ']';
}

/// An object of the columns with these names.
template <class Column>
std::string jsonColumns(const std::vector<std::string>& names, const Column& column) {
  std::string json;
  for (std::size_t i = 0; i < names.size(); ++i) {
    json += fmt::format("{}\"{}\":{}", i == 0 ? "" : ",", names[i], jsonNumbers(column(i)));
  }
  return '{' + json + '}';
}

/// Everything the page shows, as JSON that is safe within a script element.
std::string pageData(const Json& run, const fs::path& folder) {
  const auto frameNames = frameColumns(run.at("command_names").get<std::vector<std::string>>());
  const Frames frames = readFrames(folder / "frames.csv", frameNames);
  std::string points;
  for (const auto& [id, point] : readFeatures(folder / "features.csv", frames.times)) {
    points +=
        fmt::format(R"({}{{"id":{},"limit":{:.6g},"columns":{}}})", points.empty() ? "" : ",", id,
                    depthAxisLimit(point["Z"], point["Z_true"]),
                    jsonColumns(featureColumns(), [&](std::size_t i) { return point.columns[i]; }));
  }
  std::vector<double> time_s = frames.times;
  for (double& t : time_s) t -= frames.times.front();
  const std::string json = fmt::format(
      R"({{"run":{},"start":{:.9f},"time":{},"statuses":{},"frames":{},"points":[{}]}})",
      run.dump(-1, ' ', false, Json::error_handler_t::replace), frames.times.front(),
      jsonNumbers(time_s, 9), Json(statusNames()).dump(),
      jsonColumns(frameNames, [&](std::size_t i) { return frames.columns[i]; }), points);
  // "<" occurs in strings only; escaped, no "</script" or "<!--" can end the element.
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

std::string capitalised(std::string sentence) {
  if (!sentence.empty() && sentence[0] >= 'a' && sentence[0] <= 'z') sentence[0] -= 'a' - 'A';
  return sentence;
}

std::string imageElements(const fs::path& folder) {
  std::string elements;
  for (const char* stem : {"first", "last"}) {
    const fs::path file = folder / fmt::format("{}.png", stem);
    if (!fs::exists(file)) continue;
    elements += fmt::format(R"(<img id="image-{0}" alt="{0} camera image" src="{1}">)", stem,
                            html::pngSource(file));
  }
  return elements;
}

struct Verdict {
  std::string mood;  ///< CSS class
  std::string sentence;
};

/// A figure of run.json; unknown when null.
double figure(const Json& object, const char* key) {
  const Json& value = object.at(key);
  return value.is_null() ? kUnknown : value.get<double>();
}

/// "Converged after 14.2 s: image error 0.31 px rms, worst depth error 0.8 %"
Verdict verdictOf(const Json& run) {
  const Json& metrics = run.at("metrics");
  const double duration_s = figure(metrics, "duration_s");
  Verdict verdict;
  if (!run.contains("outcome")) {
    verdict = {"neutral", fmt::format("Replayed {} frames, {:.1f} s",
                                      metrics.at("frames").get<std::size_t>(), duration_s)};
  } else {
    struct Wording {
      const char *outcome, *mood, *words;
    };
    static constexpr Wording kWordings[] = {
        {"converged", "good", "Converged after"},
        {"stalled", "middling", "Stalled: the command faded short of the goal, after"},
        {"timeout", "middling", "Not yet at the goal when the time was up, after"},
        {"left-image", "bad", "The target left the image after"},
        {"lost", "bad", "The target was lost after"},
        {"diverged", "bad", "Diverged after"},
        {"collision", "bad", "Too close to the target after"}};
    const auto outcome = run.at("outcome").get<std::string>();
    const auto wording = std::find_if(std::begin(kWordings), std::end(kWordings),
                                      [&](const Wording& w) { return w.outcome == outcome; });
    const bool isKnown = wording != std::end(kWordings);
    verdict = {isKnown ? wording->mood : "neutral",
               fmt::format("{} {:.1f} s", isKnown ? wording->words : (outcome + " after").c_str(),
                           duration_s)};
  }

  std::vector<std::string> details;
  const double error_px = figure(metrics, "final_error_px");
  if (std::isfinite(error_px))
    details.push_back(fmt::format("image error {:.2f} px rms", error_px));
  const double depthError = figure(metrics, "final_depth_error_max");
  if (std::isfinite(depthError)) {
    details.push_back(fmt::format("worst depth error {:.2g} %", 100 * depthError));
  } else {
    double uncertainty = kUnknown;
    for (const Json& point : run.at("points")) {
      uncertainty = std::fmax(uncertainty, 2 * figure(point, "sigma_Z") / figure(point, "Z"));
    }
    if (std::isfinite(uncertainty)) {
      details.push_back(
          fmt::format("depths known to within {:.1f} % (2 sigma)", 100 * uncertainty));
    }
  }
  for (std::size_t i = 0; i < details.size(); ++i) {
    verdict.sentence += (i == 0 ? ": " : ", ") + details[i];
  }
  return verdict;
}

/// What images and odometry disagree about, if anything.
std::string diagnosisElement(const Json& run) {
  if (!run.contains("diagnosis")) return "";
  const Json& diagnosis = run.at("diagnosis");
  if (diagnosis.at("cause") == "none") return "";
  return fmt::format(R"(<p class="diagnosis"><b>Self-diagnosis</b> {}</p>)",
                     html::escaped(diagnosis.at("message").get<std::string>()));
}

std::string reportPage(const fs::path& folder, const Json& run) {
  const auto text = [&](const char* key) { return html::escaped(run.at(key).get<std::string>()); };
  const Verdict verdict = verdictOf(run);
  std::string reason = text("reason");
  if (run.contains("frame_rate")) {
    reason += (reason.empty() ? "" : ". ") +
              html::escaped(capitalised(run.at("frame_rate").at("sentence").get<std::string>()));
  }
  const std::string command = text("command"), name = text("name"),
                    sentence = html::escaped(verdict.sentence), diagnosis = diagnosisElement(run),
                    images = imageElements(folder), data = pageData(run, folder);
  const EmbeddedReport& report = embeddedReport();
  return html::filled(report.page, {{"command", command},
                                    {"name", name},
                                    {"reason", reason},
                                    {"mood", verdict.mood},
                                    {"verdict", sentence},
                                    {"diagnosis", diagnosis},
                                    {"images", images},
                                    {"data", data},
                                    {"style", report.style},
                                    {"script", report.script}});
}

}  // namespace

void writeReport(const fs::path& runFolder) {
  const fs::path runFile = runFolder / "run.json", partial = runFolder / ".report.html";
  try {
    const Json run = Json::parse(detail::readFile(runFile.string(), kLargestFile));
    writeFile(partial, reportPage(runFolder, run));
    fs::rename(partial, runFolder / "report.html");
  } catch (const Json::exception& error) {
    throw InputError({runFile.string(), 0, ""}, error.what());
  } catch (const fs::filesystem_error& error) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw InputError({(runFolder / "report.html").string(), 0, ""},
                     "cannot be written: " + error.code().message());
  }
}

}  // namespace depthservo
