#pragma once

#include <Eigen/Core>
#include <vector>

namespace depthservo::detail {

/// Exact area coverage of polygons, summed edge by edge: for each pixel the integral over its
/// square of a piecewise constant function, given by the function's jumps across directed edges.
/// Edges shared by two cells carry the difference of their values; there are no seams.
///
/// Pixel (i, j) covers [i, i + 1) x [j, j + 1). The sum along a row of what the edges leave is the
/// value (M. Abrash's and R. Levien's accumulation buffer).
class PolygonCoverage {
 public:
  /// An empty buffer for so many pixels; keeps its memory.
  void reset(int width, int height);

  /// Adds `jump` times the edge from a to b: an edge that goes down (y grows) adds it to everything
  /// on its right, one that goes up takes it away.
  void addEdge(Eigen::Vector2d a, Eigen::Vector2d b, float jump);

  /// One row, as differences: its running sum is the value. width + 2 entries.
  const float* row(int j) const { return sums_.data() + static_cast<std::size_t>(j) * stride_; }

 private:
  void addWithinRow(float* row, double x0, double x1, double dy, float jump) const;

  int width_ = 0, height_ = 0;
  std::size_t stride_ = 0;
  std::vector<float> sums_;
};

}  // namespace depthservo::detail
