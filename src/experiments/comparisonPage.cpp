#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "depthservo/experiments/Compare.h"
#include "depthservo/text/NewFolder.h"
#include "report/Html.h"
#include "report/RunFiles.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json numberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json shownOf(const std::vector<double>& values, const std::vector<std::size_t>& shown) {
  Json json = Json::array();
  for (const std::size_t k : shown) {
    json.push_back(k < values.size() ? numberOrNull(values[k]) : Json());
  }
  return json;
}

std::string csvOf(const Comparison& comparison) {
  std::string csv = "time";
  const auto columns = [&](const char* kind, const std::vector<ComparedEstimator>& all) {
    for (const ComparedEstimator& one : all) csv += fmt::format(",{}_{}", kind, one.name);
  };
  const auto cell = [&](const std::vector<double>& values, std::size_t k) {
    csv += std::isfinite(values[k]) ? fmt::format(",{}", values[k]) : ",";
  };
  columns("error", comparison.estimators);
  columns("error", comparison.limits);
  columns("sigma", comparison.estimators);
  columns("difference", comparison.estimators);
  csv += '\n';
  for (std::size_t k = 0; k < comparison.time_s.size(); ++k) {
    csv += fmt::format("{:.9f}", comparison.time_s[k]);
    for (const auto& one : comparison.estimators) cell(one.error, k);
    for (const auto& one : comparison.limits) cell(one.error, k);
    for (const auto& one : comparison.estimators) cell(one.sigma, k);
    for (const auto& one : comparison.estimators) cell(one.difference, k);
    csv += '\n';
  }
  return csv;
}

constexpr const char* kNoFigure = "&ndash;";

std::string headRow(const Comparison& comparison, const std::string& rest) {
  std::string row = "<tr><th></th>";
  for (const std::size_t k : comparison.shown) {
    row += fmt::format("<th>{:.4g} s</th>", comparison.time_s[k]);
  }
  return row + rest + "</tr>\n";
}

std::string pageRow(const Comparison& comparison, const ComparedEstimator& one, ShownValues values,
                    const std::string& rest) {
  std::string row = fmt::format("<tr><td>{}</td>", html::escaped(one.name));
  for (const std::size_t k : comparison.shown) {
    row += fmt::format("<td>{}</td>", percent((one.*values)[k], kNoFigure));
  }
  return row + rest + "</tr>\n";
}

std::string table(const std::string& heading, const std::string& rows) {
  return fmt::format(
      "<h3>{}</h3><div class=\"scroll\"><table class=\"compared\">{}</table></div>\n",
      html::escaped(heading), rows);
}

/// What is said of an estimator as a whole, beside the times.
std::string honestyCells(const Comparison& comparison, const ComparedEstimator& one) {
  std::string cells;
  if (comparison.pointsComeAndGo) {
    cells += fmt::format("<td>{}</td>", one.within_5pct.empty()
                                            ? kNoFigure
                                            : percent(one.within_5pct.back(), kNoFigure));
  } else {
    cells += std::isfinite(one.frames_to_5pct) ? fmt::format("<td>{:.0f}</td>", one.frames_to_5pct)
                                               : std::string("<td>never</td>");
  }
  cells += fmt::format("<td>{}</td>", percent(one.coverage_2sigma, kNoFigure));
  return cells + (std::isfinite(one.mean_nees) ? fmt::format("<td>{:.3g}</td>", one.mean_nees)
                                               : fmt::format("<td>{}</td>", kNoFigure));
}

std::string errorTable(const Comparison& comparison, const ShownStatistic& shown) {
  std::string rows = headRow(
      comparison,
      fmt::format("<th>{}</th><th>within 2 sigma</th><th>mean NEES</th>",
                  comparison.pointsComeAndGo ? "share within 5 % at the end" : "images to 5 %"));
  for (const auto* all : {&comparison.estimators, &comparison.limits}) {
    for (const ComparedEstimator& one : *all) {
      rows += pageRow(comparison, one, shown.error, honestyCells(comparison, one));
    }
  }
  return table(shown.ofError, rows);
}

std::string plainTable(const Comparison& comparison, const std::string& heading,
                       ShownValues values) {
  std::string rows = headRow(comparison, "");
  for (const ComparedEstimator& one : comparison.estimators) {
    rows += pageRow(comparison, one, values, "");
  }
  return table(heading, rows);
}

std::string pageOf(const Comparison& comparison, const Figure& figure, const fs::path& folder) {
  html::Sheet sheet;
  sheet.command = "compare";
  sheet.name = comparison.name;
  sheet.mood = "neutral";
  sheet.verdict = verdictOf(comparison);
  sheet.reason = fmt::format(
      "{} estimators on the same {} images of {:.4g} s, {} points; image noise told to them {}.{}",
      comparison.estimators.size(), comparison.time_s.size(), comparison.time_s.back(),
      comparison.points,
      std::isfinite(comparison.pixelNoise_px) ? fmt::format("{:g} px", comparison.pixelNoise_px)
                                              : "as the tracker measures it",
      comparison.hasTruth ? ""
                          : " The true depths are not known: only what the estimators claim and "
                            "how far they differ can be compared.");
  const ShownStatistic shown = shownStatistic(comparison);
  if (comparison.hasTruth) sheet.body += errorTable(comparison, shown);
  const fs::path picture = folder / (figure.name + ".png");
  if (fs::exists(picture)) {
    sheet.body += fmt::format(
        R"(<figure><div class="scroll"><img alt="{0}" src="{1}"></div><figcaption>{2}</figcaption></figure>)",
        html::escaped(figure.title), html::pngSource(picture), html::escaped(figure.caption));
  }
  sheet.body += plainTable(comparison, shown.ofSigma, shown.sigma);
  sheet.body += plainTable(comparison, shown.ofDifference, shown.difference);
  return sheet.page();
}

Curve curveOf(const Comparison& comparison, const std::string& title,
              const std::vector<double>& values) {
  Curve curve = Curve::named(title);
  curve.x = comparison.time_s;
  for (const double value : values) curve.y.push_back(100 * value);
  return curve;
}

Panel panelOf(const Comparison& comparison, const std::string& title, ShownValues values) {
  Panel panel = Panel::labelled(
      title, "time [s]",
      comparison.pointsComeAndGo ? "relative, median [%]" : "relative, rms over the points [%]");
  panel.logY = true;
  double low = 1e9, high = 0;
  for (const ComparedEstimator& one : comparison.estimators) {
    panel.curves.push_back(curveOf(comparison, one.name, one.*values));
  }
  for (const ComparedEstimator& one : comparison.limits) {
    panel.curves.push_back(curveOf(comparison, one.name, one.*shownStatistic(comparison).error));
    panel.curves.back().colour = Curve::kBlack;
    panel.curves.back().style =
        &one == &comparison.limits.front() ? Curve::Style::line : Curve::Style::dashed;
  }
  for (const Curve& curve : panel.curves) {
    for (const double y : curve.y) {
      if (!(y > 0)) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  panel.yRange = {std::max(low, 1e-3), std::min(std::max(high, 2 * low), 1e3)};
  return panel;
}

/// The names of those that a rule holds for, or nothing.
template <class Rule>
std::string namesOf(const std::vector<ComparedEstimator>& all, const Rule& rule) {
  std::vector<std::string> names;
  for (const ComparedEstimator& one : all) {
    if (rule(one)) names.push_back(one.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Whose figures at the end are known, best first.
std::vector<const ComparedEstimator*> ranked(const Comparison& comparison, ShownValues values) {
  std::vector<const ComparedEstimator*> order;
  for (const ComparedEstimator& one : comparison.estimators) {
    if (!(one.*values).empty() && std::isfinite((one.*values).back())) order.push_back(&one);
  }
  std::stable_sort(order.begin(), order.end(), [&](const auto* a, const auto* b) {
    return (a->*values).back() < (b->*values).back();
  });
  return order;
}

}  // namespace

ShownStatistic shownStatistic(const Comparison& comparison) {
  const std::string& reference = comparison.reference;
  if (comparison.pointsComeAndGo) {
    const std::string statistic = ", relative, median over the points known for a second";
    return {
        &ComparedEstimator::median_error,      &ComparedEstimator::median_sigma,
        &ComparedEstimator::median_difference, "error of 1/Z" + statistic,
        "sigma of 1/Z claimed" + statistic,    "difference of 1/Z from " + reference + statistic};
  }
  return {&ComparedEstimator::error,
          &ComparedEstimator::sigma,
          &ComparedEstimator::difference,
          "relative error of Z, rms over the points",
          "sigma of Z claimed, relative, rms over the points",
          "difference of Z from " + reference + ", relative, rms over the points"};
}

std::string verdictOf(const Comparison& comparison) {
  const ShownStatistic shown = shownStatistic(comparison);
  const ShownValues values = comparison.hasTruth ? shown.error : shown.sigma;
  const auto order = ranked(comparison, values);
  if (order.empty()) return "No estimator knows a depth at the end";
  const auto figure = [&](const ComparedEstimator* one) {
    return fmt::format("{} {}", one->name, percent((one->*values).back(), "-"));
  };
  if (!comparison.hasTruth) {
    std::string text = fmt::format("Least sigma at the end: {}", figure(order.front()));
    if (order.size() > 1) text += fmt::format("; most: {}", figure(order.back()));
    return text + "; without the true depths nobody knows who is right";
  }
  std::string text = fmt::format("Nearest to the truth at the end: {}", figure(order.front()));
  if (order.size() > 1) text += fmt::format("; farthest: {}", figure(order.back()));
  constexpr double kHonest = 0.9, kDishonest = 0.8;
  const std::string honest = namesOf(comparison.estimators, [](const ComparedEstimator& one) {
    return one.coverage_2sigma >= kHonest;
  });
  const std::string small = namesOf(comparison.estimators, [](const ComparedEstimator& one) {
    return one.coverage_2sigma < kDishonest;
  });
  if (!honest.empty()) text += fmt::format(". Truth within 2 sigma for 90 % or more: {}", honest);
  if (!small.empty()) text += fmt::format(". Sigma too small: {}", small);
  return text;
}

std::string toJson(const Comparison& comparison) {
  Json json = {{"command", "compare"},
               {"name", comparison.name},
               {"images", comparison.time_s.size()},
               {"points", comparison.points},
               {"pixel_noise", numberOrNull(comparison.pixelNoise_px)},
               {"truth", comparison.hasTruth},
               {"points_come_and_go", comparison.pointsComeAndGo},
               {"reference", comparison.reference}};
  json["times"] = shownOf(comparison.time_s, comparison.shown);
  json["estimators"] = Json::array();
  for (const ComparedEstimator& one : comparison.estimators) {
    json["estimators"].push_back(
        {{"estimator", one.name},
         {"relative_error", shownOf(one.error, comparison.shown)},
         {"relative_sigma", shownOf(one.sigma, comparison.shown)},
         {"difference", shownOf(one.difference, comparison.shown)},
         {"median_error", shownOf(one.median_error, comparison.shown)},
         {"median_sigma", shownOf(one.median_sigma, comparison.shown)},
         {"median_difference", shownOf(one.median_difference, comparison.shown)},
         {"within_5pct", shownOf(one.within_5pct, comparison.shown)},
         {"frames_to_5pct", numberOrNull(one.frames_to_5pct)},
         {"coverage_2sigma", numberOrNull(one.coverage_2sigma)},
         {"mean_nees", numberOrNull(one.mean_nees)}});
  }
  json["limits"] = Json::array();
  for (const ComparedEstimator& one : comparison.limits) {
    json["limits"].push_back({{"limit", one.name},
                              {"relative_sigma", shownOf(one.error, comparison.shown)},
                              {"median_sigma", shownOf(one.median_error, comparison.shown)},
                              {"frames_to_5pct", numberOrNull(one.frames_to_5pct)}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string percent(double share, const std::string& unknown) {
  if (!std::isfinite(share)) return unknown;
  const bool isPlain = 100 * share < 1000 || 100 * share >= 1e6;
  return isPlain ? fmt::format("{:.3g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

const ComparedEstimator& costReference(const Comparison& comparison) {
  for (const EstimatorKind kind : {EstimatorKind::nonlinear, EstimatorKind::constant}) {
    for (const ComparedEstimator& one : comparison.estimators) {
      if (one.name == toString(kind)) return one;
    }
  }
  return comparison.estimators.front();
}

std::string timingJson(const Comparison& comparison) {
  const ComparedEstimator& reference = costReference(comparison);
  Json json = {{"reference", reference.name}, {"points", comparison.points}};
  json["estimators"] = Json::object();
  for (const ComparedEstimator& one : comparison.estimators) {
    json["estimators"][one.name] = {{"per_image_s", one.update_s},
                                    {"ratio", one.update_s / reference.update_s}};
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

Figure figureOf(const Comparison& comparison) {
  const ShownStatistic shown = shownStatistic(comparison);
  Figure figure;
  figure.name = "errors";
  figure.title = fmt::format("{}: estimators on identical measurements", comparison.name);
  figure.columns = 2;
  if (comparison.hasTruth) {
    figure.panels.push_back(panelOf(comparison, "error", shown.error));
    figure.caption =
        "Left: relative errors. Right: what the estimators claim, one sigma. Black: the "
        "Cramer-Rao bound, which no unbiased estimator that starts without knowledge can be below "
        "on "
        "average; dashed for estimators that take all points together.";
  } else {
    figure.panels.push_back(
        panelOf(comparison, "difference from " + comparison.reference, shown.difference));
    figure.caption =
        "The true depths are not known. Left: how far the estimators differ. Right: what they "
        "claim, "
        "one sigma.";
  }
  figure.panels.push_back(panelOf(comparison, "sigma claimed", shown.sigma));
  return figure;
}

bool writeComparison(const Comparison& comparison, const fs::path& folder) {
  bool isDrawn = false;
  makeFolder(folder, [&](const fs::path& place) {
    const Figure figure = figureOf(comparison);
    isDrawn = drawFigure(figure, place / (figure.name + ".png"));
    writeFile(place / "compare.json", toJson(comparison) + '\n');
    writeFile(place / "compare.csv", csvOf(comparison));
    writeFile(place / "timing.json", timingJson(comparison) + '\n');
    writeFile(place / "report.html", pageOf(comparison, figure, place));
  });
  return isDrawn;
}

}  // namespace depthservo
