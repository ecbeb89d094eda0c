#include "depthservo/report/Figure.h"

#include <fmt/format.h>

#include <algorithm>

#include "report/RunFiles.h"
#include "report/gnuplot.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

constexpr int kPanelWidth_px = 720, kPanelHeight_px = 460;

/// A key with more entries than this stands outside its panel.
constexpr int kMostInside = 2;
constexpr int kKeyLine_px = 19;

const char* colourOf(const Curve& curve, std::size_t index) {
  if (curve.colour == Curve::kBlack) return "black";
  return gnuplot::colour(curve.colour < 0 ? index : static_cast<std::size_t>(curve.colour));
}

std::string styleOf(const Curve& curve) {
  switch (curve.style) {
    case Curve::Style::line:
      return "with lines linewidth 1.6";
    case Curve::Style::dashed:
      return "with lines dashtype 2 linewidth 1.6";
    case Curve::Style::points:
      return "with points pointtype 7 pointsize 0.8";
  }
  return "";
}

std::string range(const char* axis, const std::vector<double>& limits, bool reversed) {
  if (limits.size() != 2)
    return fmt::format("set {}range [*:*]{}\n", axis, reversed ? " reverse" : "");
  const double low = limits[0], high = limits[1];
  return fmt::format("set {}range [{}:{}] noreverse\n", axis,
                     gnuplot::number(reversed ? high : low),
                     gnuplot::number(reversed ? low : high));
}

int namedCurves(const Panel& panel) {
  return static_cast<int>(std::count_if(panel.curves.begin(), panel.curves.end(),
                                        [](const Curve& curve) { return !curve.title.empty(); }));
}

/// Pixels by which a panel is higher to make room for a key below it.
int keyHeight_px(const Panel& panel) {
  const bool isBelow = panel.axes == Panel::Axes::free && namedCurves(panel) > kMostInside;
  return isBelow ? kKeyLine_px * (namedCurves(panel) + 1) : 0;
}

/// Where the key hides nothing: beside panels of equal scales, which leave room there, else below.
std::string keyScript(const Panel& panel) {
  if (namedCurves(panel) <= kMostInside) {
    return "set key inside top right vertical maxcols 1 Right noreverse\n";
  }
  if (panel.axes != Panel::Axes::free) {
    return "set key outside right center vertical maxcols 1 Left reverse\n";
  }
  return "set key below left vertical maxcols 1 Left reverse\n";
}

std::string panelScript(const Panel& panel, std::size_t index) {
  const bool isImage = panel.axes == Panel::Axes::image;
  const bool isFree = panel.axes == Panel::Axes::free;
  std::string script = fmt::format(
      "set title {}\nset xlabel {} offset 0,0.3\nset ylabel {}\n{}set logscale x\n{}set logscale "
      "y\n",
      gnuplot::quoted(panel.title), gnuplot::quoted(panel.xLabel), gnuplot::quoted(panel.yLabel),
      panel.logX ? "" : "un", panel.logY ? "" : "un");
  script += fmt::format("set format y '{}'\n", panel.logY ? "%g" : "% h");
  script += isFree ? "set size noratio\nset border 3\n" : "set size ratio -1\nset border 15\n";
  script += keyScript(panel);
  script += range("x", panel.xRange, false) + range("y", panel.yRange, isImage);
  std::string plots;
  for (std::size_t i = 0; i < panel.curves.size(); ++i) {
    const Curve& curve = panel.curves[i];
    const std::string block = fmt::format("data{}x{}", index, i);
    script += gnuplot::dataBlock(block, {curve.x, curve.y});
    plots += fmt::format("{}${} using 1:2 {} linecolor rgb '{}' {}", plots.empty() ? "" : ", ",
                         block, styleOf(curve), colourOf(curve, i),
                         curve.title.empty() ? "notitle" : "title " + gnuplot::quoted(curve.title));
  }
  return plots.empty() ? script + "set multiplot next\n" : script + "plot " + plots + '\n';
}

}  // namespace

bool drawFigure(const Figure& figure, const fs::path& file) {
  const std::size_t columns = static_cast<std::size_t>(std::max(figure.columns, 1));
  const std::size_t rows = (figure.panels.size() + columns - 1) / columns;
  if (rows == 0) return false;
  int key_px = 0;
  for (const Panel& panel : figure.panels) key_px = std::max(key_px, keyHeight_px(panel));
  std::string script =
      "set encoding utf8\nset datafile missing 'NaN'\n" +
      gnuplot::page(file.filename().string(), kPanelWidth_px * static_cast<int>(columns),
                    (kPanelHeight_px + key_px) * static_cast<int>(rows) + 30) +
      fmt::format("set multiplot layout {},{} title {} font 'DejaVu Sans,13'\n", rows, columns,
                  gnuplot::quoted(figure.title));
  for (std::size_t i = 0; i < figure.panels.size(); ++i) script += panelScript(figure.panels[i], i);
  script += "unset multiplot\nunset output\n";

  const fs::path scriptFile = file.parent_path() / (file.stem().string() + ".gnuplot");
  writeFile(scriptFile, script);
  const bool drawn = gnuplot::run(file.parent_path(), scriptFile.filename().string());
  fs::remove(scriptFile);
  if (!drawn) fs::remove(file);
  return drawn;
}

}  // namespace depthservo
