#include "depthservo/report/RunFolder.h"

#include <fmt/format.h>
#include <visp3/core/vpConfig.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "depthservo/report/Metrics.h"
#include "depthservo/report/Report.h"
#include "depthservo/text/NewFolder.h"
#include "report/Plots.h"
#include "report/RunFiles.h"
#include "report/reportable.h"
#include "sequence/ImageFile.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Shortest text that reads back as the same double; empty when unknown or infinite.
std::string cell(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }

void appendCells(std::string& row, const Velocities& values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    row += ',' + (index < values.size() ? cell(values[index]) : "");
  }
}

void writeFrames(const RunLog& log, const fs::path& file) {
  const std::size_t commands = log.commandNames.size();
  OutputFile csv(file);
  csv.write(headerLine(frameColumns(log.commandNames)));
  for (const FrameRecord& frame : log.frames) {
    const auto measured = std::count_if(frame.features.begin(), frame.features.end(),
                                        [](const FeatureRecord& f) { return f.measured; });
    std::string row = fmt::format("{:.9f},{},{}", frame.time_s, cell(frame.error_px), measured);
    appendCells(row, frame.command, commands);
    appendCells(row, frame.applied, commands);
    appendCells(row, frame.twist.linear, 3);
    appendCells(row, frame.twist.angular, 3);
    appendCells(row, frame.robotPose, 3);
    csv.write(row + '\n');
  }
  csv.close();
}

void writeFeatures(const RunLog& log, const fs::path& file) {
  OutputFile csv(file);
  csv.write(headerLine(featureColumns()));
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (feature.estimate.status == DepthStatus::unset) continue;
      const DepthEstimate estimate = reportable(feature.estimate);
      const auto [Z_low, Z_high] = estimate.interval();
      csv.write(fmt::format("{:.9f},{},{},{},{:d},{},{},{},{},{},{},{},{},{}\n", frame.time_s,
                            feature.id, cell(feature.u), cell(feature.v), feature.measured,
                            cell(estimate.Z()), cell(estimate.sigma_Z()), toString(estimate.status),
                            cell(feature.Z_true), cell(Z_low), cell(Z_high),
                            cell(estimate.excitation), cell(feature.frames_to_5pct),
                            cell(estimate.sigma_xy * log.camera.fx)));
    }
  }
  csv.close();
}

/// The depths side by side, a row per image: for tools that plot columns. Of the first so many
/// points that are seen.
void writeDepths(const RunLog& log, const fs::path& file) {
  constexpr std::size_t kMostPoints = 64;
  std::map<int, std::size_t> places;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (feature.estimate.status == DepthStatus::unset || places.size() == kMostPoints) continue;
      places.try_emplace(feature.id, 0);
    }
  }
  std::vector<std::string> columns{"timestamp"};
  for (auto& [id, place] : places) {
    place = columns.size();
    for (const char* name : {"Z", "sigma_Z", "Z_true"}) {
      columns.push_back(fmt::format("{}_{}", name, id));
    }
  }
  OutputFile csv(file);
  csv.write(headerLine(columns));
  for (const FrameRecord& frame : log.frames) {
    std::vector<std::string> cells(columns.size());
    cells[0] = fmt::format("{:.9f}", frame.time_s);
    for (const FeatureRecord& feature : frame.features) {
      const auto found = places.find(feature.id);
      if (found == places.end() || feature.estimate.status == DepthStatus::unset) continue;
      const DepthEstimate estimate = reportable(feature.estimate);
      cells[found->second] = cell(estimate.Z());
      cells[found->second + 1] = cell(estimate.sigma_Z());
      cells[found->second + 2] = cell(feature.Z_true);
    }
    csv.write(fmt::format("{}\n", fmt::join(cells, ",")));
  }
  csv.close();
}

std::string runJson(const RunLog& log) {
  Json json = Json::parse(toJson(log));
  json["camera"] = {{"width", log.camera.width}, {"height", log.camera.height},
                    {"fx", log.camera.fx},       {"fy", log.camera.fy},
                    {"cx", log.camera.cx},       {"cy", log.camera.cy}};
  if (const LensDistortion& d = log.camera.distortion; !d.isNone()) {
    json["camera"]["distortion"] = {d.k1(), d.k2(), d.p1(), d.p2(), d.k3()};
  }
  json["command_names"] = log.commandNames;
  json["goals"] = Json::array();
  for (const Eigen::Vector2d& goal : log.goals) json["goals"].push_back({goal.x(), goal.y()});
  json["events"] = Json::array();
  for (const Event& event : log.events) {
    json["events"].push_back({{"time", event.time_s}, {"what", event.what}});
  }
  const auto version = [](int major, int minor, int patch) {
    return fmt::format("{}.{}.{}", major, minor, patch);
  };
  json["versions"] = {
      {"depthservo", DEPTHSERVO_VERSION},
      {"visp", version(VISP_VERSION_MAJOR, VISP_VERSION_MINOR, VISP_VERSION_PATCH)},
      {"opencv", version(CV_VERSION_MAJOR, CV_VERSION_MINOR, CV_VERSION_REVISION)},
      {"eigen", version(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)}};
  json["configuration"] =
      log.configuration.empty() ? Json::object() : Json::parse(log.configuration);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

/// Value below which a share of the ascending values lies.
double quantile(const std::vector<double>& ascending, double share) {
  const auto last = static_cast<double>(ascending.size() - 1);
  return ascending[static_cast<std::size_t>(std::lround(share * last))];
}

std::string timingJson(const RunLog& log) {
  Json json = Json::object();
  for (const auto& [stage, seconds] : log.timings) {
    if (seconds.empty()) continue;
    std::vector<double> ascending = seconds;
    std::sort(ascending.begin(), ascending.end());
    json[stage] = {{"frames", ascending.size()},
                   {"total_s", std::accumulate(ascending.begin(), ascending.end(), 0.0)},
                   {"p50_s", quantile(ascending, 0.5)},
                   {"p99_9_s", quantile(ascending, 0.999)},
                   {"max_s", ascending.back()}};
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

void writeImage(const PinholeCamera& camera, const std::vector<unsigned char>& gray,
                const fs::path& file) {
  constexpr int kQuick = -1;
  writeFile(file, detail::pngOf(gray.data(), {camera.width, camera.height}, kQuick));
}

/// Each picture named by its time.
void writeFilm(const Film& film, const fs::path& folder) {
  constexpr int kQuality = 70;
  if (film.pictures().empty()) return;
  fs::create_directory(folder);
  for (const Film::Picture& picture : film.pictures()) {
    writeFile(folder / fmt::format("{:.9f}.jpg", picture.time_s),
              detail::jpegOf(picture.gray.data(), {picture.width, picture.height}, kQuality));
  }
}

}  // namespace

bool writeRunFolder(const RunLog& log, const fs::path& folder) {
  bool plotted = false;
  makeFolder(folder, [&](const fs::path& place) {
    writeFile(place / "run.json", runJson(log));
    writeFrames(log, place / "frames.csv");
    writeFeatures(log, place / "features.csv");
    writeDepths(log, place / "depths.csv");
    writeFile(place / "timing.json", timingJson(log));
    for (const auto& [stem, gray] : log.images) {
      writeImage(log.camera, gray, place / (stem + ".png"));
    }
    writeFilm(log.film, place / "film");
    writeReport(place);
    plotted = drawPlots(log, place);
  });
  return plotted;
}

}  // namespace depthservo
