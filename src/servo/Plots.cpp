#include "servo/Plots.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <map>
#include <string>

#include "servo/RunFiles.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// Colour-blind safe (Okabe and Ito 2008): blue, orange, green, vermillion, purple.
constexpr const char* kPointColours[] = {"#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7"};
constexpr const char* kEstimateColour = kPointColours[0];
constexpr const char* kBandColour = "#BF0072B2";  // the estimate's, three quarters transparent
constexpr std::size_t kMostPanels = 8;
constexpr int kWidth_px = 1200;

const char* pointColour(std::size_t index) {
  return kPointColours[index % std::size(kPointColours)];
}

/// One point over the frames that know it; times from the first frame of the log.
struct Track {
  std::vector<double> time_s, u, v, Z, low, high, Z_true;
  std::vector<bool> measured;
};

/// Times [s] in which something lasted.
struct Period {
  double begin_s, end_s;
};

std::map<int, Track> tracksOf(const RunLog& log) {
  std::map<int, Track> tracks;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (feature.estimate.status == DepthStatus::unset) continue;
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

/// A number as gnuplot reads it; NaN leaves a gap.
std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "NaN";
}

/// A named block of rows, one column of numbers each.
std::string dataBlock(const std::string& name, const std::vector<std::vector<double>>& columns) {
  std::string block = "$" + name + " << EOD\n";
  for (std::size_t row = 0; row < columns.front().size(); ++row) {
    for (const auto& column : columns) block += number(column[row]) + ' ';
    block += '\n';
  }
  return block + "EOD\n";
}

/// Shades periods and marks events in the plots that follow.
std::string decorations(const std::vector<Period>& hidden, const RunLog& log) {
  std::string script = "unset object\nunset arrow\n";
  for (const Period& period : hidden) {
    script += fmt::format(
        "set object rectangle from {},graph 0 to {},graph 1 behind fillcolor rgb '#E4E4E4' "
        "fillstyle solid noborder\n",
        number(period.begin_s), number(period.end_s));
  }
  for (const Event& event : log.events) {
    const std::string time_s = number(event.time_s - log.frames.front().time_s);
    script += fmt::format(
        "set arrow from {0},graph 0 to {0},graph 1 nohead linewidth 0.6 linecolor rgb '#808080'\n",
        time_s);
  }
  return script;
}

std::string pageOf(const char* file, int height_px) {
  return fmt::format(
      "set terminal pngcairo noenhanced size {},{} font 'DejaVu Sans,11' linewidth 1.4\n"
      "set output '{}'\n"
      "set border 3 linecolor rgb '#606060'\nset tics nomirror out scale 0.5 textcolor rgb "
      "'black'\n"
      "set grid linetype 1 linewidth 0.4 linecolor rgb '#D8D8D8'\n"
      "set key top right noautotitle samplen 2 spacing 1.1\n",
      kWidth_px, height_px, file);
}

std::string depthScript(const std::map<int, Track>& tracks, const RunLog& log) {
  const std::size_t panels = std::min(tracks.size(), kMostPanels);
  const std::size_t columns = panels > 1 ? 2 : 1, rows = (panels + columns - 1) / columns;
  std::string script = pageOf("depth.png", static_cast<int>(rows) * (rows == 1 ? 420 : 330));
  script += fmt::format("set multiplot layout {},{}\nset xrange [0:{}]\n", rows, columns,
                        number(log.frames.back().time_s - log.frames.front().time_s));
  std::size_t panel = 0;
  for (const auto& [id, track] : tracks) {
    if (panel == panels) break;
    const double limit = depthAxisLimit(track.Z, track.Z_true);
    std::vector<double> high = track.high;
    for (double& Z : high) Z = std::min(Z, 2 * limit);
    const std::string block = fmt::format("point{}", panel);
    script += dataBlock(block, {track.time_s, track.Z, track.low, high, track.Z_true});
    script += decorations(hiddenPeriods(track), log);
    const bool isLastRow = panel + columns >= panels;
    script += fmt::format("set xlabel '{}'\nset ylabel 'Z of point {} [m]'\nset yrange [0:{}]\n",
                          isLastRow ? "time [s]" : "", id, number(limit));
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
  std::string script = pageOf("error.png", hasError && hasTruth ? 660 : 400);
  script += fmt::format("set multiplot layout {},1\nset xrange [0:{}]\nset logscale y\n",
                        hasError && hasTruth ? 2 : 1, number(time_s.back()));
  script += "set yrange [*:*]\nset format y '%g'\nset xlabel 'time [s]'\n";
  script += decorations(hidden, log);
  if (hasError) {
    script += dataBlock("error", {time_s, error_px});
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
      script += dataBlock(block, {track.time_s, percent});
      plots += fmt::format(
          "{}${} using 1:2 with lines linewidth 1.4 linecolor rgb '{}' title 'point {}'",
          plots.empty() ? "" : ", ", block, pointColour(index), id);
      ++index;
    }
    script += "set ylabel 'depth error [%]'\nplot " + plots + '\n';
  }
  return script + "unset multiplot\nunset output\n";
}

std::string imageScript(const std::map<int, Track>& tracks, const RunLog& log) {
  if (tracks.empty() || log.camera.width <= 0 || log.camera.height <= 0) return "";
  const int height_px = kWidth_px * log.camera.height / log.camera.width;
  std::string script = "reset\n" + pageOf("image.png", height_px);
  script += fmt::format(
      "set size ratio -1\nset border 15\nset xrange [-0.5:{}]\nset yrange [{}:-0.5]\n"
      "set xlabel 'u [px]'\nset ylabel 'v [px]'\nset key outside top center horizontal\n",
      log.camera.width - 0.5, log.camera.height - 0.5);
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
    script += dataBlock(block, {uSeen, uHidden, track.v});
    plots += fmt::format(
        "{0}${1} using 1:3 with lines linewidth 1.6 linecolor rgb '{2}' title 'point {3}', "
        "${1} using 2:3 with lines dashtype 3 linewidth 1.6 linecolor rgb '{2}', "
        "${1} using 1:3 every ::0::0 with points pointtype 6 pointsize 1.4 linecolor rgb '{2}'",
        plots.empty() ? "" : ", ", block, pointColour(index), id);
    ++index;
  }
  if (!log.goals.empty()) {
    std::vector<double> u, v;
    for (const Eigen::Vector2d& goal : log.goals) {
      u.push_back(goal.x());
      v.push_back(goal.y());
    }
    script += dataBlock("goals", {u, v});
    plots +=
        ", $goals using 1:2 with points pointtype 1 pointsize 1.6 linewidth 1.4 "
        "linecolor rgb 'black' title 'goal'";
  }
  return script + "plot " + plots + "\nunset output\n";
}

/// Runs gnuplot in a folder on a script of that folder, silently and without the user's settings.
/// \return whether it was found and succeeded
bool runGnuplot(const fs::path& folder, const std::string& script) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
  }
  std::string arguments[] = {"gnuplot", "--default-settings", script};
  char* argv[] = {arguments[0].data(), arguments[1].data(), arguments[2].data(), nullptr};
  pid_t child = 0;
  const int failure = posix_spawnp(&child, argv[0], &actions, nullptr, argv, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) return false;
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return false;
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
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
  const std::map<int, Track> tracks = tracksOf(log);
  if (tracks.empty() || log.frames.back().time_s <= log.frames.front().time_s) return false;
  const std::string name = "plots.gnuplot";
  writeFile(folder / name, "set encoding utf8\nset datafile missing 'NaN'\n" +
                               depthScript(tracks, log) + errorScript(tracks, log) +
                               imageScript(tracks, log));
  const bool drawn = runGnuplot(folder, name);
  fs::remove(folder / name);
  if (!drawn) {
    for (const char* plot : {"depth.png", "error.png", "image.png"}) fs::remove(folder / plot);
  }
  return drawn;
}

}  // namespace depthservo
