#pragma once

#include <vector>

#include "simulation/PolygonCoverage.h"
#include "simulation/drawing.h"

namespace depthservo::detail {

/// Nearer than this [m] nothing is drawn.
constexpr double kNear = 1e-3;

inline bool isSeenFromTheFront(const Eigen::Isometry3d& cMp) {
  return cMp.linear().col(2).dot(cMp.translation()) > 0;
}

/// A patch as one image sees it.
struct ExposedPatch {
  const GrayPatch& patch;
  Eigen::Isometry3d cMp;  // at mid-exposure
  Eigen::Matrix3d warp;   // pixels to pixels, after the projection
  const SyntheticView& view;
  double exposure_s;
};

/// How much of each pixel the cells of a patch cover, and with what light: the integral over the
/// pixel's square and the exposure. Cells that reach behind the camera are left out.
class PatchPainter {
 public:
  explicit PatchPainter(const PinholeCamera& camera) : camera_(camera) {}

  /// \return the pixels that are touched; none where nothing is to be drawn
  PixelBox paint(const ExposedPatch& exposed);

  /// Share of each pixel that is covered, and its gray level times that: rows of the last box, see
  /// PolygonCoverage::row.
  const PolygonCoverage& covered() const { return covered_; }
  const PolygonCoverage& light() const { return light_; }

 private:
  /// What is touched, and how far a corner moves during the exposure [px].
  struct Extent {
    PixelBox box;
    double path_px = 0;
  };
  void project(const ExposedPatch& exposed, double part);
  Extent extent(const ExposedPatch& exposed);
  void addCells(const GrayPatch& patch, const Eigen::Vector2d& origin, float weight);

  PinholeCamera camera_;
  PolygonCoverage covered_, light_;
  std::vector<Eigen::Vector2d> corners_;  // of the cells, (columns + 1) x (rows + 1) [px]
  std::vector<char> isBefore_;            // whether that corner lies in front of the camera
};

}  // namespace depthservo::detail
