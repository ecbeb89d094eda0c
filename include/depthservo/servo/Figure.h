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
