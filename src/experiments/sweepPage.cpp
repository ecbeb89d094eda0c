#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/scenario/run.h"
#include "depthservo/text/InputError.h"
#include "depthservo/text/NewFolder.h"
#include "experiments/SweepTable.h"
#include "experiments/sweepDrawings.h"
#include "experiments/sweepMetrics.h"
#include "report/Html.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kListedWorst = 12;
constexpr double kPictureWidth_px = 1180;

std::string worstFolder(const SweepResult& result) {
  return fmt::format("worst/row-{}", result.row);
}

/// "guess=3 start=2".
std::string coordinatesOf(const SweepTable& table, std::size_t result) {
  std::vector<std::string> words;
  for (std::size_t c = 0; c < table.sweep().columns().size(); ++c) {
    words.push_back(table.sweep().columns()[c] + "=" + table.cell(result, c));
  }
  return fmt::format("{}", fmt::join(words, " "));
}

std::string figure(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string("&ndash;");
}

std::string legendOf(const SweepTable& table) {
  std::string legend = "<p class=\"outcomes\">";
  const auto counts = table.outcomes();
  for (const std::string& outcome : outcomeNames()) {
    const auto found = counts.find(outcome);
    if (found == counts.end()) continue;
    legend += fmt::format("<span><i style=\"background:{}\"></i>{} {}</span> ",
                          colourOf(outcome).fill, outcome, found->second);
  }
  return legend + "</p>\n";
}

std::string mapSection(const SweepTable& table) {
  const auto maps = table.maps();
  if (maps.empty()) return "";
  std::string section = "<section><h2>Success maps</h2>\n" + legendOf(table) +
                        "<p class=\"hint\">Each place is filled by the shares of its runs' outcomes; "
                        "the number is the share of success in per cent.</p>\n";
  for (const SweepMap& map : maps) {
    section += "<div class=\"facets\">\n";
    for (const Drawing& drawing : mapsOf(table, map)) {
      section += drawing.svg(fmt::format("Outcomes by {} and {}", map.x, map.y));
    }
    section += "</div>\n";
  }
  return section + "</section>\n";
}

std::string curveSection(const SweepTable& table) {
  const auto curves = table.curves();
  if (curves.empty()) return "";
  std::string section =
      "<section><h2>Share of success</h2>\n<p class=\"hint\">Over all runs with this value; bars: 95 "
      "%, Wilson's interval, as if the runs were drawn by chance.</p>\n<div class=\"facets\">\n";
  for (const SweepCurve& curve : curves) {
    section += curvesOf(table, curve).svg(fmt::format("Share of success by {}", curve.x));
  }
  return section + "</div></section>\n";
}

std::string claimSection(const SweepTable& table) {
  const auto claims = judgedClaims(table.sweep(), table.results());
  if (claims.empty()) return "";
  std::string rows =
      "<tr><th>claim</th><th>expected</th><th>ours</th><th>within</th><th>agrees</th></tr>\n";
  for (const JudgedClaim& claim : claims) {
    rows += fmt::format(
        "<tr><td class=\"words\">{}{}</td><td>{:.4g} {}</td><td>{:.4g}</td><td>{}</td>"
        "<td class=\"answer {}\">{}</td></tr>\n",
        html::escaped(claim.claim),
        claim.note.empty() ? "" : "<p class=\"note\">" + html::escaped(claim.note) + "</p>",
        claim.expected, html::escaped(claim.unit), claim.ours, html::escaped(claim.tolerance),
        claim.pass ? "good" : "bad", claim.pass ? "yes" : "no");
  }
  return "<section><h2>Claims</h2>\n<div class=\"scroll\"><table class=\"rows\">" + rows +
         "</table></div></section>\n";
}

std::string worstRow(const SweepTable& table, std::size_t i, const fs::path& folder) {
  const SweepResult& result = table.results()[i];
  std::error_code ignored;
  const bool isThere = fs::exists(folder / worstFolder(result) / "report.html", ignored);
  const std::string name =
      isThere ? fmt::format("<a href=\"{}/report.html\">row {}</a>", worstFolder(result), result.row)
              : fmt::format("row {}", result.row);
  return fmt::format(
      "<tr><td>{}</td><td><i class=\"chip\" style=\"background:{}\"></i>{}</td><td class=\"words\">{}"
      "<span class=\"id\">{}</span></td><td>{}</td><td>{}</td></tr>\n",
      name, colourOf(result.outcome).fill, result.outcome,
      html::escaped(coordinatesOf(table, i)), html::escaped(result.reason),
      figure(table.metric(i, "final_error_px")),
      figure(100 * table.metric(i, "final_depth_error_max")));
}

std::string worstSection(const SweepTable& table, const fs::path& folder,
                         const std::string& shownFolder) {
  const auto worst = table.worst(kListedWorst);
  if (worst.empty()) return "";
  std::string rows =
      "<tr><th>run</th><th>outcome</th><th>where, and why it ended</th><th>image error [px]</th>"
      "<th>depth error [%]</th></tr>\n";
  for (const std::size_t i : worst) rows += worstRow(table, i, folder);
  return fmt::format(
      "<section><h2>Worst runs</h2>\n<p class=\"hint\">The worst of each kind of failure first. Any "
      "run again, with its report: <code>depthservo run --of {} --row N --out DIR</code></p>\n"
      "<div class=\"scroll\"><table class=\"rows worst\">{}</table></div></section>\n",
      html::escaped(shownFolder), rows);
}

/// What was varied, and how often.
std::string planSection(const SweepTable& table) {
  const SweepOptions& options = table.sweep().options();
  std::string items;
  const auto item = [&](const std::string& name, const std::string& what) {
    items += fmt::format("<dt>{}</dt><dd>{}</dd>\n", html::escaped(name), html::escaped(what));
  };
  item("scenario", table.sweep().source().scenarioFile);
  if (!options.set.empty()) item("of every run", fmt::format("{}", fmt::join(options.set, ", ")));
  for (const SweepAxis& axis : options.axes) {
    const SweepScale scale = table.scale(axis.name);
    constexpr std::size_t kMostShown = 20;
    const std::string values = scale.size() <= kMostShown
                                   ? fmt::format("{}", fmt::join(scale.labels, ", "))
                                   : fmt::format("{} values", scale.size());
    const std::string how = axis.cone                       ? " start poses"
                            : axis.key.empty()              ? ""
                            : axis.draw != SweepDraw::none ? " of " + axis.key + ", drawn"
                                                            : " of " + axis.key;
    item(axis.name, axis.cone ? fmt::format("{}{}", axis.count, how) : values + how);
  }
  if (options.repeat > 1) item("repeated", fmt::format("{} times, each with its own seed", options.repeat));
  return "<section><h2>What was run</h2><dl>\n" + items + "</dl></section>\n";
}

/// \param named the folder as it will be called
std::string pageOf(const SweepFolder& folder, const SweepTable& table, const fs::path& place,
                   const fs::path& named) {
  const SweepOptions& options = table.sweep().options();
  const std::size_t due = folder.shard().sizeOf(table.sweep().size());
  html::Sheet sheet;
  sheet.command = "sweep";
  sheet.name = options.name;
  sheet.verdict = sweepVerdict(table.sweep(), table.results());
  sheet.mood = "neutral";
  sheet.reason = options.title;
  if (folder.shard().count > 1) {
    sheet.reason += fmt::format(" Shard {} of {} only.", folder.shard().index, folder.shard().count);
  }
  if (table.results().size() < due) {
    sheet.reason += fmt::format(" {} of {} runs are not done yet.", due - table.results().size(), due);
  }
  const std::string shown = fs::absolute(named).lexically_normal().filename().string();
  sheet.body = claimSection(table) + mapSection(table) + curveSection(table) +
               worstSection(table, place, shown) + planSection(table);
  return sheet.page();
}

void writePictures(const SweepTable& table, const fs::path& folder) {
  std::size_t number = 0;
  for (const SweepMap& map : table.maps()) {
    std::vector<Drawing> drawings = mapsOf(table, map);
    drawings.push_back(outcomeKey(table));
    replaceFile(folder / fmt::format("map-{}.svg", ++number),
                joined(drawings, kPictureWidth_px).svg(fmt::format("Outcomes by {} and {}", map.x, map.y)));
  }
  number = 0;
  for (const SweepCurve& curve : table.curves()) {
    replaceFile(folder / fmt::format("curve-{}.svg", ++number),
                joined({curvesOf(table, curve)}, kPictureWidth_px)
                    .svg(fmt::format("Share of success by {}", curve.x)));
  }
}

void repeatWorst(const SweepTable& table, const fs::path& folder) {
  const auto most = static_cast<std::size_t>(table.sweep().options().worst);
  for (const std::size_t i : table.worst(most)) {
    const fs::path place = folder / worstFolder(table.results()[i]);
    std::error_code error;
    if (fs::exists(place, error)) continue;
    fs::create_directories(place.parent_path(), error);
    if (error) {
      throw InputError({place.string(), 0, ""}, "cannot be written: " + error.message());
    }
    writeRunFolder(run(table.sweep().scenario(table.row(i))), place);
  }
}

}  // namespace

std::string sweepVerdict(const Sweep& sweep, const std::vector<SweepResult>& results) {
  const SweepTable table(sweep, results);
  std::string success, failure;
  const auto counts = table.outcomes();
  for (const std::string& outcome : outcomeNames()) {
    const auto found = counts.find(outcome);
    if (table.isSuccess(outcome)) success += (success.empty() ? "" : " or ") + outcome;
    if (found == counts.end() || table.isSuccess(outcome)) continue;
    failure += fmt::format("{}{} {}", failure.empty() ? "; " : ", ", found->second, outcome);
  }
  return fmt::format("{} of {} runs {}{}", table.all().successes, results.size(), success, failure);
}

std::string sweepJson(const Sweep& sweep, const std::vector<SweepResult>& results) {
  const SweepTable table(sweep, results);
  Json json = {{"command", "sweep"},
               {"name", sweep.options().name},
               {"runs", sweep.size()},
               {"done", results.size()},
               {"successes", table.all().successes}};
  json["outcomes"] = Json::object();
  for (const auto& [outcome, count] : table.outcomes()) json["outcomes"][outcome] = count;
  json["claims"] = Json::array();
  for (const JudgedClaim& claim : judgedClaims(sweep, results)) {
    json["claims"].push_back({{"id", claim.id},
                              {"claim", claim.claim},
                              {"expected", claim.expected},
                              {"ours", claim.ours},
                              {"unit", claim.unit},
                              {"tolerance", claim.tolerance},
                              {"pass", claim.pass},
                              {"note", claim.note}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

void writeSweepReport(const fs::path& place, bool withWorst, const fs::path& named) {
  const SweepFolder folder = SweepFolder::open(place);
  const SweepTable table(folder.sweep(), folder.results());
  replaceFile(place / "runs.csv", sweepCsv(table.sweep(), table.results()));
  replaceFile(place / "sweep.json", sweepJson(table.sweep(), table.results()) + "\n");
  if (table.results().empty()) return;
  writePictures(table, place);
  if (withWorst) repeatWorst(table, place);
  replaceFile(place / "report.html", pageOf(folder, table, place, named.empty() ? place : named));
}

}  // namespace depthservo
