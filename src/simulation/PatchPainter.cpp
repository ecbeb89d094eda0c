#include "simulation/PatchPainter.h"

namespace depthservo::detail {
namespace {

/// From the plane of a patch (x, y, 1) [m] to pixels (3x3).
Eigen::Matrix3d homography(const PinholeCamera& camera, const Eigen::Isometry3d& cMp) {
  Eigen::Matrix3d K;
  K << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  Eigen::Matrix3d H;
  H << cMp.linear().leftCols<2>(), cMp.translation();
  return K * H;
}

}  // namespace

PixelBox PatchPainter::paint(const ExposedPatch& exposed) {
  if (!isSeenFromTheFront(exposed.cMp) || !exposed.cMp.matrix().allFinite()) return {};
  const auto [box, path_px] = extent(exposed);
  if (box.isEmpty()) return {};
  const int instants = instantsOver(path_px);
  // A mirrored image (negative fy) turns the outlines round.
  const float weight = (camera_.fx * camera_.fy < 0 ? -1.0f : 1.0f) / static_cast<float>(instants);
  covered_.reset(box.width(), box.height());
  light_.reset(box.width(), box.height());
  for (int k = 0; k < instants; ++k) {
    if (path_px > 0) project(exposed, (k + 0.5) / instants - 0.5);
    addCells(exposed.patch, {box.left - 0.5, box.top - 0.5}, weight);
  }
  return box;
}

/// The corners of the cells at a part of the exposure, -1/2..1/2.
void PatchPainter::project(const ExposedPatch& exposed, double part) {
  const GrayPatch& patch = exposed.patch;
  const Eigen::Isometry3d moved = during(exposed.view, exposed.exposure_s, part) * exposed.cMp;
  const Eigen::Matrix3d H = homography(camera_, moved);
  corners_.clear();
  isBefore_.clear();
  for (int r = 0; r <= patch.rows; ++r) {
    for (int c = 0; c <= patch.columns; ++c) {
      const Eigen::Vector3d plane((static_cast<double>(c) / patch.columns - 0.5) * patch.width,
                                  (static_cast<double>(r) / patch.rows - 0.5) * patch.height, 1);
      const Eigen::Vector3d image = H * plane, warped = exposed.warp * image;
      isBefore_.push_back(image.z() > kNear && warped.z() > 0);
      corners_.push_back(warped.hnormalized());
    }
  }
}

/// Where the corners are in the middle and at either end of the exposure says what is touched, and
/// how finely the motion must be cut.
PatchPainter::Extent PatchPainter::extent(const ExposedPatch& exposed) {
  Extent extent;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(HUGE_VAL), high = -low;
  std::vector<Eigen::Vector2d> first;
  for (const double part : {-0.5, 0.0, 0.5}) {
    if (part != 0.0 && !(exposed.exposure_s > 0)) continue;
    project(exposed, part);
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      if (!isBefore_[k]) continue;
      low = low.cwiseMin(corners_[k]);
      high = high.cwiseMax(corners_[k]);
      if (part > 0) extent.path_px = std::max(extent.path_px, (corners_[k] - first[k]).norm());
    }
    if (part < 0) first = corners_;
  }
  if (low.x() <= high.x()) extent.box = touched(low, high, camera_);
  return extent;
}

void PatchPainter::addCells(const GrayPatch& patch, const Eigen::Vector2d& origin, float weight) {
  const auto columns = static_cast<std::size_t>(patch.columns);
  const auto rows = static_cast<std::size_t>(patch.rows);
  const auto corner = [&](std::size_t r, std::size_t c) { return r * (columns + 1) + c; };
  /// {1, gray level} of a cell; zeros outside and for one that is not drawn.
  const auto cell = [&](std::size_t r, std::size_t c) -> Eigen::Vector2f {
    if (r >= rows || c >= columns) return Eigen::Vector2f::Zero();  // also "-1"
    const bool isDrawn = isBefore_[corner(r, c)] && isBefore_[corner(r, c + 1)] &&
                         isBefore_[corner(r + 1, c)] && isBefore_[corner(r + 1, c + 1)];
    if (!isDrawn) return Eigen::Vector2f::Zero();
    return {1, patch.gray[r * columns + c]};
  };
  const auto addEdge = [&](std::size_t from, std::size_t to, const Eigen::Vector2f& jump) {
    if (jump.isZero(0)) return;
    const Eigen::Vector2d a = corners_[from] - origin, b = corners_[to] - origin;
    if (jump[0] != 0) covered_.addEdge(a, b, weight * jump[0]);
    light_.addEdge(a, b, weight * jump[1]);
  };
  for (std::size_t r = 0; r <= rows; ++r) {
    for (std::size_t c = 0; c <= columns; ++c) {
      const Eigen::Vector2f here = cell(r, c);
      if (r < rows) addEdge(corner(r, c), corner(r + 1, c), here - cell(r, c - 1));
      if (c < columns) addEdge(corner(r, c), corner(r, c + 1), cell(r - 1, c) - here);
    }
  }
}

}  // namespace depthservo::detail
