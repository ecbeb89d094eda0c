#pragma once

#include <string>

#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// A sheet of paper, upright.
struct Paper {
  double width, height;  ///< [m]

  /// a4 (210 x 297 mm) or letter (8.5 x 11 inch). \throw InputError another name
  static Paper named(const std::string& name);
};

/// A plate of columns x rows dots, a square apart, centred at the object frame's origin; row by row
/// from the top left; four dots go round, as those of the scenarios do. \param width between the
/// centres of the outer columns [m]
DotTarget dotGrid(int columns, int rows, double width, double radius);

/// Draws a target in its true size onto one page of PDF: black on white, in the middle, with a
/// white margin around; below it what it is and a ruler of 100 mm to check the print. The same
/// target gives the same bytes.
///
/// \param seen dots with a radius, one AprilTag with a size, or a board with the side of its
/// squares \throw InputError it does not fit (and how large it may be), or the file exists or
/// cannot be written
void writeTargetSheet(const SequenceTarget& seen, const Paper& paper, const std::string& file);

/// The target as lines of YAML, for a scenario and for sequence.yaml alike.
std::string targetYaml(const SequenceTarget& seen);

}  // namespace depthservo
