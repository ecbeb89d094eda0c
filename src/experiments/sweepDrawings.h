#pragma once

#include <string>
#include <vector>

#include "experiments/SweepTable.h"

namespace depthservo {

/// A picture as SVG elements.
struct Drawing {
  double width = 0, height = 0;  ///< [px]
  std::string elements;

  std::string svg(const std::string& alternative = "") const;
};

/// Pictures beside and below each other, as many columns as fit into the width [px].
Drawing joined(const std::vector<Drawing>& drawings, double width);

/// Colour of an outcome, and black or white for what is written on it.
struct OutcomeColour {
  const char *fill, *ink;
};
OutcomeColour colourOf(const std::string& outcome);

/// Outcomes over two columns: a picture for each value of the third. Each place is filled by the
/// shares of the outcomes of its runs; the number is the share of success in per cent.
std::vector<Drawing> mapsOf(const SweepTable& table, const SweepMap& map);

/// What the colours mean, for pictures that stand alone.
Drawing outcomeKey(const SweepTable& table);

/// Share of success, with its interval.
Drawing curvesOf(const SweepTable& table, const SweepCurve& curve);

}  // namespace depthservo
