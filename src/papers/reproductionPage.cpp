#include "papers/reproductionPage.h"

#include <fmt/format.h>

#include "report/Html.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// What remains of an id after paper and experiment.
std::string shortId(const JudgedClaim& row) {
  return row.id.substr(row.id.find('/', row.id.find('/') + 1) + 1);
}

/// A cell; the label stands before it where the page is too narrow for columns.
std::string cell(const char* label, const std::string& content, const char* kind = "") {
  return fmt::format(R"(<td class="{}" data-label="{}">{}</td>)", kind, label, content);
}

std::string answer(const char* label, bool isSo) {
  return cell(label, isSo ? "yes" : "<b>no</b>", isSo ? "answer good" : "answer bad");
}

/// A figure as people read it: yes and no for those that are one or the other.
std::string number(const JudgedClaim& row, double value) {
  const bool isTruth = row.unit == "yes = 1" && (value == 0 || value == 1);
  if (isTruth) return value == 1 ? "yes" : "no";
  return html::escaped(fmt::format("{:.5g}{}{}", value,
                                   row.unit.empty() || row.unit == "1" ? "" : " ",
                                   row.unit == "1" ? "" : row.unit));
}

std::string rowElement(const JudgedClaim& row, const std::string& id) {
  const std::string note =
      row.note.empty() ? "" : fmt::format(R"(<p class="note">{}</p>)", html::escaped(row.note));
  return fmt::format("<tr><td class=\"words\">{}<span class=\"id\">{}</span>{}</td>",
                     html::escaped(row.claim), html::escaped(id), note) +
         cell("paper", row.paper.empty() ? "&ndash;" : html::escaped(row.paper), "words") +
         cell("expected", number(row, row.expected)) +
         cell("within", html::escaped(row.tolerance)) + cell("ours", number(row, row.ours)) +
         answer("agrees", row.pass) + answer("reproduces", row.reproduces) + "</tr>\n";
}

std::string table(const std::string& rows) {
  return R"(<div class="scroll"><table class="rows claims"><tr><th>claim</th><th>paper</th>)"
         "<th>expected</th><th>within</th><th>ours</th><th>agrees</th><th>reproduces</th></tr>\n" +
         rows + "</table></div>\n";
}

std::string experimentElement(const Paper& paper, const std::string& id, const std::string& title,
                              const std::vector<JudgedClaim>& all) {
  const std::string prefix = paper.name + "/" + id + "/";
  std::string rows;
  std::size_t count = 0, agree = 0;
  for (const JudgedClaim& row : all) {
    if (row.id.rfind(prefix, 0) != 0) continue;
    rows += rowElement(row, shortId(row));
    ++count;
    agree += row.pass;
  }
  return fmt::format(
      "<details><summary>{} <span class=\"count {}\">{} of {} "
      "agree</span></summary>{}</details>\n",
      html::escaped(title), agree == count ? "" : "bad", agree, count, table(rows));
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
  for (const JudgedClaim& row : result.rows) {
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
  for (const auto& [id, title] : paper.experiments) {
    body += experimentElement(paper, id, title, result.rows);
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
  std::vector<JudgedClaim> all;
  html::Sheet sheet;
  for (const ReproducedPaper& paper : reproduced) {
    all.insert(all.end(), paper.result.rows.begin(), paper.result.rows.end());
    sheet.body += paperElement(paper, folder);
  }
  const ReproductionCount count(all);
  sheet.command = "reproduce";
  sheet.name = name;
  sheet.mood =
      count.agreeing == count.rows ? count.met == count.printed ? "good" : "middling" : "bad";
  sheet.verdict = count.text();
  sheet.reason =
      "\"Expected\" comes from an independent computation of the same experiment, \"ours\" was "
      "measured by this program; they agree when they are equal within the tolerance of the row "
      "(\"within\"). \"Reproduces\" says whether the paper's own claim holds; few rows stand in "
      "a paper at all (\"paper\").";
  return sheet.page();
}

}  // namespace depthservo
