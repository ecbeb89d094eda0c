#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/target/GrayPatch.h"

namespace depthservo {

/// OpenCV's predefined dictionaries of ArUco markers, as users name them: 4x4_50, 5x5_100, ...
DEPTHSERVO_API std::vector<std::string> arucoDictionaries();

/// How many markers a dictionary has. \throws std::invalid_argument no such dictionary
DEPTHSERVO_API int arucoMarkerCount(const std::string& dictionary);

/// ArUco markers in the white squares of a board.
struct BoardMarkers {
  std::string dictionary = "4x4_50";
  double size = 0;  ///< side of a marker with its black border, > 0, below that of a square [m]
};

/// A printed chessboard; a ChArUco board is one with ArUco markers in its white squares (OpenCV's
/// pattern since 4.6: the upper left square is black, markers 0, 1, ... row by row).
///
/// Points are the inner corners, where four squares meet, row by row from the upper left: that of
/// row r and column c has the id r columns + c. Board frame: origin in the middle of the corners,
/// x right along the rows, y down, z away from the viewer who sees its front.
///
/// Only where one of columns and rows is odd and the other even do the colours tell a plain
/// chessboard from itself turned by half a turn.
struct DEPTHSERVO_API BoardTarget {
  using Markers = BoardMarkers;
  static constexpr int kLeast = 3, kMost = 24;  ///< corners in a row or a column

  int columns = 0, rows = 0;       ///< inner corners: one less than there are squares
  std::optional<double> square;    ///< side [m], > 0; empty: unknown; known where there are markers
  std::optional<Markers> markers;  ///< empty: a plain chessboard

  int count() const { return columns * rows; }
  int markerCount() const { return (columns + 1) * (rows + 1) / 2; }  ///< of a ChArUco board

  /// What is wrong with it, in words; empty: nothing. \throws std::invalid_argument no such
  /// dictionary
  std::string objection() const;

  /// Index by id [m]. \throws std::logic_error the square is not known
  std::vector<Eigen::Vector3d> corners() const;

  /// Black squares and markers as they are printed on white paper. There must be no objection.
  /// \param ink, paper gray levels \throws std::logic_error the square is not known
  std::vector<GrayPatch> patches(unsigned char ink = 20, unsigned char paper = 220) const;
};

}  // namespace depthservo
