#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace depthservo {

/// A line or a set of points. Unknown values are NaN and leave a gap.
struct Curve {
  enum class Style { line, dashed, points };

  std::string title;  ///< in the key; empty: not there
  std::vector<double> x, y;
  Style style = Style::line;
  int colour = -1;  ///< index into a colour-blind safe palette; -1: the next; kBlack: black
  static constexpr int kBlack = -2;

  /// Without points yet.
  static Curve named(const std::string& title, Style style = Style::line, int colour = -1) {
    return {title, {}, {}, style, colour};
  }
  /// A dashed black line across the panel.
  static Curve level(double y, double from, double to, const std::string& title = "") {
    return {title, {from, to}, {y, y}, Style::dashed, kBlack};
  }
  void add(double abscissa, double ordinate) {
    x.push_back(abscissa);
    y.push_back(ordinate);
  }
};

/// One pair of axes.
struct Panel {
  enum class Axes {
    free,
    image,  ///< equal scales, y down: pixels
    map,    ///< equal scales: metres on the floor
  };

  std::string title, xLabel, yLabel;  ///< labels with units
  std::vector<Curve> curves;
  bool logX = false, logY = false;
  Axes axes = Axes::free;
  std::vector<double> xRange, yRange;  ///< {low, high}; empty: as the curves need

  /// Without curves yet.
  static Panel labelled(const std::string& title, const std::string& xLabel,
                        const std::string& yLabel) {
    Panel panel;
    panel.title = title;
    panel.xLabel = xLabel;
    panel.yLabel = yLabel;
    return panel;
  }
};

/// A picture of one experiment: panels in rows of `columns`, read left to right.
struct Figure {
  std::string name;     ///< of its file, without extension
  std::string title;    ///< one line
  std::string caption;  ///< what a reader should see in it
  std::vector<Panel> panels;
  int columns = 1;
};

/// Draws into a PNG file with gnuplot. \return false, with no file left, when gnuplot is not on the
/// PATH or fails
bool drawFigure(const Figure& figure, const std::filesystem::path& file);

}  // namespace depthservo
