#include "papers/reproductionPage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/Html.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// The experiment a row belongs to: the word after the paper's name in its id.
std::string experimentOf(const ReproduceRow& row) {
  const std::size_t begin = row.id.find('/') + 1;
  return row.id.substr(begin, row.id.find('/', begin) - begin);
}

/// What remains of an id after paper and experiment.
std::string shortId(const ReproduceRow& row) {
  const std::size_t begin = row.id.find('/', row.id.find('/') + 1);
  return begin == std::string::npos ? row.id : row.id.substr(begin + 1);
}

/// Rows of one experiment, in their order.
struct Experiment {
  std::string id;
  std::vector<const ReproduceRow*> rows;
};

std::vector<Experiment> experimentsOf(const std::vector<ReproduceRow>& rows) {
  std::vector<Experiment> experiments;
  for (const ReproduceRow& row : rows) {
    const std::string id = experimentOf(row);
    auto found = std::find_if(experiments.begin(), experiments.end(),
                              [&](const Experiment& e) { return e.id == id; });
    if (found == experiments.end()) found = experiments.insert(found, {id, {}});
    found->rows.push_back(&row);
  }
  return experiments;
}

std::string answer(bool isSo) {
  return isSo ? R"(<td class="answer good">yes</td>)" : R"(<td class="answer bad"><b>no</b></td>)";
}

/// A figure as people read it: yes and no for those that are one or the other.
std::string number(const ReproduceRow& row, double value) {
  const bool isTruth = row.unit == "yes = 1" && (value == 0 || value == 1);
  if (isTruth) return value == 1 ? "yes" : "no";
  return html::escaped(fmt::format("{:.5g}{}{}", value,
                                   row.unit.empty() || row.unit == "1" ? "" : " ",
                                   row.unit == "1" ? "" : row.unit));
}

std::string rowElement(const ReproduceRow& row, const std::string& id) {
  const std::string note =
      row.note.empty() ? "" : fmt::format(R"(<p class="note">{}</p>)", html::escaped(row.note));
  return fmt::format(
      "<tr><td class=\"words\">{}<span class=\"id\">{}</span>{}</td><td "
      "class=\"words\">{}</td><td>{}</td><td>{}</td>{}{}</tr>\n",
      html::escaped(row.claim), html::escaped(id), note,
      row.paper.empty() ? "&ndash;" : html::escaped(row.paper), number(row, row.expected),
      number(row, row.ours), answer(row.pass), answer(row.reproduces));
}

std::string table(const std::string& rows) {
  return R"(<div class="scroll"><table class="rows"><tr><th>claim</th><th>paper</th><th>expected</th>)"
         "<th>ours</th><th>agrees</th><th>reproduces</th></tr>\n" +
         rows + "</table></div>\n";
}

std::string experimentElement(const Experiment& experiment, const Paper& paper) {
  const auto agree = std::count_if(experiment.rows.begin(), experiment.rows.end(),
                                   [](const ReproduceRow* row) { return row->pass; });
  const auto title = paper.experiments.find(experiment.id);
  std::string rows;
  for (const ReproduceRow* row : experiment.rows) rows += rowElement(*row, shortId(*row));
  return fmt::format(
      "<details><summary>{} <span class=\"count {}\">{} of {} "
      "agree</span></summary>{}</details>\n",
      html::escaped(title == paper.experiments.end() ? experiment.id : title->second),
      agree == static_cast<std::ptrdiff_t>(experiment.rows.size()) ? "" : "bad", agree,
      experiment.rows.size(), table(rows));
}

std::string figureElement(const Figure& figure, const fs::path& file) {
  return fmt::format(
      "<figure{3}><img alt=\"{0}\" src=\"{1}\"><figcaption><span class=\"title\">{0}</span> "
      "{2}</figcaption></figure>\n",
      html::escaped(figure.title), html::pngSource(file), html::escaped(figure.caption),
      figure.columns > 1 ? " class=\"wide\"" : "");
}

std::string paperElement(const ReproducedPaper& reproduced, const fs::path& folder) {
  const auto& [paper, result] = reproduced;
  std::string body = fmt::format("<section id=\"{0}\"><h2>{0}</h2><p class=\"reason\">{1}</p>\n",
                                 paper.name, html::escaped(paper.citation));
  std::string remarkable;
  for (const ReproduceRow& row : result.rows) {
    if (!row.pass || !row.reproduces) remarkable += rowElement(row, row.id);
  }
  if (!remarkable.empty()) {
    body +=
        "<h3>What does not agree, or does not hold as the paper says it</h3>" + table(remarkable);
  }
  std::string figures;
  for (const Figure& figure : result.figures) {
    const fs::path file = folder / figureFile(paper, figure);
    if (fs::exists(file)) figures += figureElement(figure, file);
  }
  if (!figures.empty()) body += "<h3>Figures</h3><div class=\"figures\">" + figures + "</div>\n";
  body += "<h3>All rows</h3>\n";
  for (const Experiment& experiment : experimentsOf(result.rows)) {
    body += experimentElement(experiment, paper);
  }
  return body + "</section>\n";
}

}  // namespace

std::string figureFile(const Paper& paper, const Figure& figure) {
  return fmt::format("{}-{}.png", paper.name, figure.name);
}

std::string reproductionPage(const std::string& name,
                             const std::vector<ReproducedPaper>& reproduced,
                             const fs::path& folder) {
  std::size_t rows = 0, agreeing = 0, notReproduced = 0;
  html::Sheet sheet;
  for (const ReproducedPaper& paper : reproduced) {
    for (const ReproduceRow& row : paper.result.rows) {
      ++rows;
      agreeing += row.pass ? 1 : 0;
      notReproduced += row.reproduces ? 0 : 1;
    }
    sheet.body += paperElement(paper, folder);
  }
  sheet.command = "reproduce";
  sheet.name = name;
  sheet.mood = agreeing == rows ? "good" : "bad";
  sheet.verdict = fmt::format("{} of {} figures agree", agreeing, rows);
  sheet.reason = fmt::format(
      "{} \"Expected\" comes from an independent computation of the same experiment, \"ours\" was "
      "measured by this program; they agree when they are equal within the tolerance of the row. "
      "\"Reproduces\" says whether the paper's own claim holds.",
      notReproduced == 0   ? "Every claim holds."
      : notReproduced == 1 ? "One claim does not hold."
                           : fmt::format("{} claims do not hold.", notReproduced));
  return sheet.page();
}

}  // namespace depthservo
