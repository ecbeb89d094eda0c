#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "depthservo/experiments/FocalReplay.h"
#include "depthservo/report/Figure.h"
#include "depthservo/text/NewFolder.h"
#include "report/Html.h"
#include "report/RunFiles.h"

namespace depthservo {
namespace {

using Json = nlohmann::ordered_json;

Json estimateJson(const FocalEstimate& e) {
  return {{"focal", e.focal_px},
          {"sigma_focal", e.sigma_focal_px},
          {"inverse_focal", e.inverseFocal},
          {"eta1", e.eta1},
          {"eta2", e.eta2},
          {"sigma_min", e.sigma_min},
          {"status", toString(e.status)}};
}

std::string focalCsv(const FocalReplay& replay) {
  std::string csv = headerLine({"timestamp", "id", "measured", "focal", "sigma_focal",
                                "inverse_focal", "eta1", "eta2", "sigma_min", "status"});
  for (const FocalRecord& r : replay.records) {
    const FocalEstimate& e = r.estimate;
    csv += fmt::format("{:.9f},{},{:d},{},{},{},{},{},{},{}\n", r.time_s, r.id, r.measured,
                       e.focal_px, e.sigma_focal_px, e.inverseFocal, e.eta1, e.eta2, e.sigma_min,
                       toString(e.status));
  }
  return csv;
}

Figure figureOf(const FocalReplay& replay) {
  Figure figure;
  figure.name = "focal";
  figure.title = fmt::format("Focal length in {}", replay.name);
  figure.caption =
      "Focal length as each point tells it (the first six), against that of the camera file "
      "(dashed), and how much the motion tells.";
  const int first = replay.points.front().id;
  Panel focal = Panel::labelled("focal length", "time [s]", "lambda [px]");
  Panel eta = Panel::labelled(
      fmt::format("eta1 and eta2 of point {}: nothing is learnt while one stays 0", first),
      "time [s]", "eta [px rad/s]");
  Panel sigma = Panel::labelled(fmt::format("least singular value, point {}, last second", first),
                                "time [s]", "sigma_min [rad^2/s]");
  constexpr std::size_t kMostCurves = 6;
  const double start_s = replay.records.front().time_s;
  Curve eta1 = Curve::named("eta1"), eta2 = Curve::named("eta2"), sigma_min;
  double highest_px = std::abs(replay.camera.fx);
  for (std::size_t i = 0; i < std::min(replay.points.size(), kMostCurves); ++i) {
    Curve lambda = Curve::named(fmt::format("point {}", replay.points[i].id));
    for (const FocalRecord& r : replay.records) {
      if (r.id != replay.points[i].id) continue;
      const double t = r.time_s - start_s;
      lambda.add(t, r.estimate.focal_px);
      highest_px = std::max(highest_px, r.estimate.focal_px);
      if (i > 0) continue;
      eta1.add(t, r.estimate.eta1);
      eta2.add(t, r.estimate.eta2);
      sigma_min.add(t, r.estimate.sigma_min);
    }
    focal.curves.push_back(std::move(lambda));
  }
  eta.curves = {eta1, eta2};
  sigma.curves = {sigma_min};
  const double nominal_px = std::abs(replay.camera.fx);
  focal.yRange = {0, 1.35 * std::min(highest_px, 3 * nominal_px)};
  focal.curves.push_back(Curve::level(nominal_px, 0, replay.duration_s, "camera file"));
  figure.panels = {focal, eta, sigma};
  return figure;
}

std::string reportPage(const FocalReplay& replay, const std::filesystem::path& plot) {
  html::Sheet sheet;
  sheet.command = "replay --observe focal";
  sheet.name = replay.name;
  const FocalPoint* contradiction = contradicted(replay);
  sheet.mood = replay.status == DepthStatus::valid && !contradiction ? "good" : "middling";
  sheet.verdict =
      fmt::format("focal length {:.5g} px, {}", replay.focal_px, toString(replay.status));
  if (contradiction) {
    sheet.verdict += fmt::format("; contradicted by {:.2g} %: lambda against 1/lambda",
                                 100 * std::abs(contradiction->estimate.consistency() - 1));
  }
  sheet.reason =
      fmt::format("The camera file says {:.6g} px. {}", replay.camera.fx, remark(replay));
  const Figure figure = figureOf(replay);
  if (std::filesystem::exists(plot)) {
    sheet.body += fmt::format(
        "<div class=\"figures\"><figure class=\"wide\"><img alt=\"{0}\" src=\"{1}\">"
        "<figcaption><span class=\"title\">{0}</span> {2}</figcaption></figure></div>\n",
        html::escaped(figure.title), html::pngSource(plot), html::escaped(figure.caption));
  }
  sheet.body +=
      "<div class=\"scroll\"><table class=\"rows\"><tr><th>point</th><th>focal length [px]</th>"
      "<th>1 sigma [px]</th><th>measured frames</th><th>status</th></tr>\n";
  for (const FocalPoint& point : replay.points) {
    sheet.body += fmt::format(
        "<tr><td>{}</td><td>{:.5g}</td><td>{:.3g}</td><td>{}</td><td class=\"words\">{}{}{}</td>"
        "</tr>\n",
        point.id, point.estimate.focal_px, point.estimate.sigma_focal_px, point.measured_frames,
        toString(point.estimate.status), point.unexcited_because.empty() ? "" : ": ",
        html::escaped(point.unexcited_because));
  }
  sheet.body += "</table></div>\n";
  return sheet.page();
}

}  // namespace

std::string toJson(const FocalReplay& replay) {
  Json points = Json::array();
  for (const FocalPoint& point : replay.points) {
    Json json = {{"id", point.id}, {"measured_frames", point.measured_frames}};
    json.update(estimateJson(point.estimate));
    json["unexcited_because"] = nullptr;
    if (!point.unexcited_because.empty()) json["unexcited_because"] = point.unexcited_because;
    points.push_back(std::move(json));
  }
  const Json json = {
      {"command", "replay"},
      {"observe", "focal"},
      {"name", replay.name},
      {"frames", replay.frames},
      {"duration_s", replay.duration_s},
      {"focal", replay.focal_px},
      {"sigma_focal", replay.sigma_focal_px},
      {"status", toString(replay.status)},
      {"camera_focal", replay.camera.fx},
      {"lever", replay.lever_m},
      {"Z", replay.Z ? Json(*replay.Z) : Json()},
      {"compensated_focal", replay.compensated_px},
      {"gains", {{"k", replay.gains.k}, {"k_3", replay.gains.k_3}, {"k_4", replay.gains.k_4}}},
      {"points", std::move(points)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

bool writeFocalFolder(const FocalReplay& replay, const std::filesystem::path& folder) {
  bool isDrawn = false;
  makeFolder(folder, [&](const std::filesystem::path& place) {
    isDrawn = drawFigure(figureOf(replay), place / "focal.png");
    writeFile(place / "run.json", toJson(replay) + '\n');
    writeFile(place / "focal.csv", focalCsv(replay));
    writeFile(place / "report.html", reportPage(replay, place / "focal.png"));
  });
  return isDrawn;
}

}  // namespace depthservo
