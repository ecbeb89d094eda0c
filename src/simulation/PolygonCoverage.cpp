#include "simulation/PolygonCoverage.h"

#include <algorithm>
#include <cmath>

namespace depthservo::detail {

void PolygonCoverage::reset(int width, int height) {
  width_ = width;
  height_ = height;
  stride_ = static_cast<std::size_t>(width) + 2;
  sums_.assign(stride_ * static_cast<std::size_t>(height), 0.0f);
}

void PolygonCoverage::addEdge(Eigen::Vector2d a, Eigen::Vector2d b, float jump) {
  if (a.y() == b.y()) return;
  if (a.y() > b.y()) {
    std::swap(a, b);
    jump = -jump;
  }
  if (b.y() <= 0 || a.y() >= height_) return;
  const double slope = (b.x() - a.x()) / (b.y() - a.y());
  const int first = std::max(0, static_cast<int>(std::floor(a.y())));
  const int last = b.y() >= height_ ? height_ : static_cast<int>(std::ceil(b.y()));
  for (int j = first; j < last; ++j) {
    const double top = std::max<double>(j, a.y()), bottom = std::min<double>(j + 1, b.y());
    const double x0 = a.x() + (top - a.y()) * slope, x1 = a.x() + (bottom - a.y()) * slope;
    float* row = sums_.data() + static_cast<std::size_t>(j) * stride_;
    // What lies left of the image counts fully, what lies right of it not at all.
    const double low = std::min(x0, x1), high = std::max(x0, x1), dy = bottom - top;
    if (low >= width_) continue;
    if (high <= 0) {
      row[0] += jump * static_cast<float>(dy);
    } else if (low < 0 || high > width_) {
      const double from = std::max(low, 0.0), to = std::min<double>(high, width_);
      const double perX = dy / (high - low);
      row[0] += jump * static_cast<float>((from - low) * perX);
      addWithinRow(row, from, to, (to - from) * perX, jump);
    } else {
      addWithinRow(row, low, high, dy, jump);
    }
  }
}

/// A piece of an edge in one row of pixels, from x0 to x1 >= x0 over a height of dy.
void PolygonCoverage::addWithinRow(float* row, double x0, double x1, double dy, float jump) const {
  const int first = static_cast<int>(x0);
  const int last = std::min(width_, static_cast<int>(x1));  // the pixels that hold the ends
  if (first == last) {
    const double right = 1 - (0.5 * (x0 + x1) - first);  // mean share of the pixel to the right
    row[first] += jump * static_cast<float>(dy * right);
    row[first + 1] += jump * static_cast<float>(dy * (1 - right));
    return;
  }
  // Of pixel i the piece of the edge leaves this much on its right: all where it has passed, and
  // its mean share where it passes.
  const double perX = dy / (x1 - x0);
  double before = 0;
  for (int i = first; i <= last; ++i) {
    const double from = std::max<double>(x0, i), to = std::min<double>(x1, i + 1);
    const double inside = perX * (to - from), passed = perX * (from - x0);
    const double covered = passed + inside * (i + 1 - 0.5 * (from + to));
    row[i] += jump * static_cast<float>(covered - before);
    before = covered;
  }
  row[last + 1] += jump * static_cast<float>(dy - before);
}

}  // namespace depthservo::detail
