#include "report/Plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "report/RunFiles.h"
#include "report/gnuplot.h"
#include "report/interest.h"
#include "report/joinedEvents.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEstimateColour = gnuplot::kColours[0];
constexpr const char* kBandColour = "#BF0072B2";  // the estimate's, three quarters transparent
constexpr std::size_t kMostPanels = 8, kMostPaths = 32;
constexpr std::size_t kMostMarks = 20;  // of events of one kind
constexpr int kWidth_px = 1200;

/// One point over the frames that know it; times from the first frame of the log.
struct Track {
  std::vector<double> time_s, u, v, Z, low, high, Z_true;
  std::vector<bool> measured;
};

/// Times [s] in which something lasted.
struct Period {
  double begin_s, end_s;
};

/// Of the points that tell most.
std::map<int, Track> tracksOf(const RunLog& log, const std::vector<int>& ids) {
  std::map<int, Track> tracks;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (feature.estimate.status == DepthStatus::unset) continue;
      if (std::find(ids.begin(), ids.end(), feature.id) == ids.end()) continue;
      const auto [low, high] = feature.estimate.interval();
      Track& track = tracks[feature.id];
      track.time_s.push_back(frame.time_s - log.frames.front().time_s);
      track.u.push_back(feature.u);
      track.v.push_back(feature.v);
      track.Z.push_back(feature.estimate.Z());
      track.low.push_back(low);
      track.high.push_back(high);
      track.Z_true.push_back(feature.Z_true);
      track.measured.push_back(feature.measured);
    }
  }
  return tracks;
}

std::vector<Period> hiddenPeriods(const Track& track) {
  std::vector<Period> periods;
  for (std::size_t i = 0; i < track.time_s.size(); ++i) {
    if (track.measured[i]) continue;
    const bool begins = i == 0 || track.measured[i - 1];
    if (begins) periods.push_back({track.time_s[i], 0});
    periods.back().end_s = track.time_s[std::min(i + 1, track.time_s.size() - 1)];
  }
  return periods;
}

/// Shades periods and marks events in the plots that follow.
std::string decorations(const std::vector<Period>& hidden, const RunLog& log) {
  std::string script = "unset object\nunset arrow\n";
  for (const Period& period : hidden) {
    script += fmt::format(
        "set object rectangle from {},graph 0 to {},graph 1 behind fillcolor rgb '#E4E4E4' "
        "fillstyle solid noborder\n",
        gnuplot::number(period.begin_s), gnuplot::number(period.end_s));
  }
  for (const JoinedEvents& event : joined(log.events, kMostMarks)) {
    const std::string time_s = gnuplot::number(event.first_s - log.frames.front().time_s);
    script += fmt::format(
        "set arrow from {0},graph 0 to {0},graph 1 nohead linewidth 0.6 linecolor rgb '#808080'\n",
        time_s);
  }
  return script;
}

std::string depthScript(const std::map<int, Track>& tracks, const RunLog& log) {
  const std::size_t panels = std::min(tracks.size(), kMostPanels);
  const std::size_t columns = panels > 1 ? 2 : 1, rows = (panels + columns - 1) / columns;
  std::string script =
      gnuplot::page("depth.png", kWidth_px, static_cast<int>(rows) * (rows == 1 ? 420 : 330));
  script += fmt::format("set multiplot layout {},{}\nset xrange [0:{}]\n", rows, columns,
                        gnuplot::number(log.frames.back().time_s - log.frames.front().time_s));
  std::size_t panel = 0;
  for (const auto& [id, track] : tracks) {
    if (panel == panels) break;
    const double limit = depthAxisLimit(track.Z, track.Z_true);
    std::vector<double> high = track.high;
    for (double& Z : high) Z = std::min(Z, 2 * limit);
    const std::string block = fmt::format("point{}", panel);
    script += gnuplot::dataBlock(block, {track.time_s, track.Z, track.low, high, track.Z_true});
    script += decorations(hiddenPeriods(track), log);
    const bool isLastRow = panel + columns >= panels;
    script += fmt::format("set xlabel '{}'\nset ylabel 'Z of point {} [m]'\nset yrange [0:{}]\n",
                          isLastRow ? "time [s]" : "", id, gnuplot::number(limit));
    const bool hasKey = panel == 0;
    script += fmt::format(
        "plot ${0} using 1:3:4 with filledcurves fillcolor rgb '{1}' {4}, "
        "${0} using 1:5 with lines linewidth 1.2 linecolor rgb 'black' {5}, "
        "${0} using 1:2 with lines linewidth 1.6 linecolor rgb '{2}' {3}\n",
        block, kBandColour, kEstimateColour, hasKey ? "title 'estimate'" : "",
        hasKey ? "title '2 sigma'" : "", hasKey ? "title 'truth'" : "");
    ++panel;
  }
  return script + "unset multiplot\nunset output\n";
}

std::string errorScript(const std::map<int, Track>& tracks, const RunLog& log) {
  std::vector<double> time_s, error_px;
  for (const FrameRecord& frame : log.frames) {
    time_s.push_back(frame.time_s - log.frames.front().time_s);
    error_px.push_back(frame.error_px);
  }
  const auto isKnown = [](double value) { return std::isfinite(value); };
  const bool hasError = std::any_of(error_px.begin(), error_px.end(), isKnown);
  const bool hasTruth = std::any_of(tracks.begin(), tracks.end(), [&](const auto& entry) {
    return std::any_of(entry.second.Z_true.begin(), entry.second.Z_true.end(), isKnown);
  });
  if (!hasError && !hasTruth) return "";

  std::vector<Period> hidden;
  for (const auto& [id, track] : tracks) {
    const auto periods = hiddenPeriods(track);
    hidden.insert(hidden.end(), periods.begin(), periods.end());
  }
  std::string script = gnuplot::page("error.png", kWidth_px, hasError && hasTruth ? 660 : 400);
  script += fmt::format("set multiplot layout {},1\nset xrange [0:{}]\nset logscale y\n",
                        hasError && hasTruth ? 2 : 1, gnuplot::number(time_s.back()));
  script +=
      "set yrange [*:*]\nset format y '%g'\nset key outside right top\nset xlabel 'time [s]'\n";
  script += decorations(hidden, log);
  if (hasError) {
    script += gnuplot::dataBlock("error", {time_s, error_px});
    script += fmt::format(
        "set ylabel 'image error [px rms]'\n"
        "plot $error using 1:2 with lines linewidth 1.6 linecolor rgb '{}'\n",
        kEstimateColour);
  }
  if (hasTruth) {
    std::string plots;
    std::size_t index = 0;
    for (const auto& [id, track] : tracks) {
      std::vector<double> percent(track.Z.size());
      for (std::size_t i = 0; i < percent.size(); ++i) {
        percent[i] = 100 * std::abs(track.Z[i] - track.Z_true[i]) / track.Z_true[i];
      }
      const std::string block = fmt::format("relative{}", index);
      script += gnuplot::dataBlock(block, {track.time_s, percent});
      plots += fmt::format(
          "{}${} using 1:2 with lines linewidth 1.4 linecolor rgb '{}' title 'point {}'",
          plots.empty() ? "" : ", ", block, gnuplot::colour(index), id);
      ++index;
    }
    script += "set ylabel 'depth error [%]'\nplot " + plots + '\n';
  }
  return script + "unset multiplot\nunset output\n";
}

std::string imageScript(const std::map<int, Track>& tracks, const RunLog& log) {
  if (tracks.empty() || log.camera.width <= 0 || log.camera.height <= 0) return "";
  const int height_px = kWidth_px * log.camera.height / log.camera.width;
  std::string script = "reset\n" + gnuplot::page("image.png", kWidth_px, height_px);
  script += fmt::format(
      "set size ratio -1\nset border 15\nset xrange [-0.5:{}]\nset yrange [{}:-0.5]\n"
      "set xlabel 'u [px]'\nset ylabel 'v [px]'\n{}\n",
      log.camera.width - 0.5, log.camera.height - 0.5,
      tracks.size() > kMostPanels ? "unset key" : "set key outside top center horizontal");
  std::string plots;
  std::size_t index = 0;
  for (const auto& [id, track] : tracks) {
    std::vector<double> uSeen = track.u, uHidden = track.u;
    for (std::size_t i = 0; i < track.u.size(); ++i) {
      const bool endsGap = track.measured[i] && i > 0 && !track.measured[i - 1];
      if (!track.measured[i]) uSeen[i] = kUnknown;
      if (track.measured[i] && !endsGap) uHidden[i] = kUnknown;
    }
    const std::string block = fmt::format("path{}", index);
    script += gnuplot::dataBlock(block, {uSeen, uHidden, track.v});
    plots += fmt::format(
        "{0}${1} using 1:3 with lines linewidth 1.6 linecolor rgb '{2}' title 'point {3}', "
        "${1} using 2:3 with lines dashtype 3 linewidth 1.6 linecolor rgb '{2}', "
        "${1} using 1:3 every ::0::0 with points pointtype 6 pointsize 1.4 linecolor rgb '{2}'",
        plots.empty() ? "" : ", ", block, gnuplot::colour(index), id);
    ++index;
  }
  if (!log.goals.empty()) {
    std::vector<double> u, v;
    for (const Eigen::Vector2d& goal : log.goals) {
      u.push_back(goal.x());
      v.push_back(goal.y());
    }
    script += gnuplot::dataBlock("goals", {u, v});
    plots +=
        ", $goals using 1:2 with points pointtype 1 pointsize 1.6 linewidth 1.4 "
        "linecolor rgb 'black' title 'goal'";
  }
  return script + "plot " + plots + "\nunset output\n";
}

}  // namespace

double depthAxisLimit(const std::vector<double>& Z, const std::vector<double>& Z_true) {
  constexpr double kHeadroom = 1.15, kFarthestTransient = 2;
  double limit = 0, farthestTrue = 0;
  for (const double value : Z) limit = std::fmax(limit, value);
  for (const double value : Z_true) farthestTrue = std::fmax(farthestTrue, value);
  if (farthestTrue > 0) {
    limit = std::clamp(limit, farthestTrue, kFarthestTransient * farthestTrue);
  }
  return limit > 0 ? kHeadroom * limit : 1;
}

bool drawPlots(const RunLog& log, const fs::path& folder) {
  const std::vector<PointMetrics> points = computeMetrics(log).points;
  const std::map<int, Track> tracks = tracksOf(log, mostTelling(points, kMostPanels)),
                             paths = tracksOf(log, mostTelling(points, kMostPaths));
  if (tracks.empty() || log.frames.back().time_s <= log.frames.front().time_s) return false;
  const std::string name = "plots.gnuplot";
  writeFile(folder / name, "set encoding utf8\nset datafile missing 'NaN'\n" +
                               depthScript(tracks, log) + errorScript(tracks, log) +
                               imageScript(paths, log));
  const bool drawn = gnuplot::run(folder, name);
  fs::remove(folder / name);
  if (!drawn) {
    for (const char* plot : {"depth.png", "error.png", "image.png"}) fs::remove(folder / plot);
  }
  return drawn;
}

}  // namespace depthservo
