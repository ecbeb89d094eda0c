#include "depthservo/tracking/BoardTracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>

#include "depthservo/visp/using.h"
#include "motion/median.h"
#include "target/arucoDictionary.h"
#include "text/require.h"
#include "tracking/saddle.h"

namespace depthservo {
namespace {

using Image = vpImage<unsigned char>;

constexpr double kReach = 0.25;                           // of a window, in squares
constexpr double kLeastReach_px = 3, kMostReach_px = 11;  // of a window
constexpr double kLeastSide_px = 6;                       // of a square
constexpr int kNoiseBox = 4;  // pixels either way in the middle of a square

/// Corners as they were found, by id; not finite: not found.
using Grid = std::vector<Eigen::Vector2d>;

bool isFound(const Eigen::Vector2d& p) { return p.allFinite(); }
Eigen::Vector2d notFound() {
  return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

class BoardTracker::Impl {
 public:
  explicit Impl(const BoardTarget& board) : board_(board) {
    const std::string why = board.objection();
    detail::require("BoardTracker", why.empty(), why);
    if (!board.markers) return;
    dictionary_ = detail::arucoDictionary(board.markers->dictionary);
    charuco_ = cv::aruco::CharucoBoard::create(
        board.columns + 1, board.rows + 1, static_cast<float>(*board.square),
        static_cast<float>(board.markers->size), dictionary_);
  }

  const std::vector<TrackedPoint>& track(const Image& image,
                                         const std::vector<ExpectedPoint>& expected) {
    points_.clear();
    if (image.getSize() == 0 || image.bitmap == nullptr) return points_;
    const cv::Mat view(static_cast<int>(image.getHeight()), static_cast<int>(image.getWidth()),
                       CV_8UC1, image.bitmap);
    try {
      refine(image, board_.markers ? charuco(view) : upright(image, chessboard(view), expected));
    } catch (const cv::Exception&) {
      points_.clear();  // an image that it does not take, of a pixel
    }
    return points_;
  }

 private:
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row * board_.columns + column);
  }

  /// All or none, in some order.
  Grid chessboard(const cv::Mat& image) const {
    std::vector<cv::Point2f> found;
    if (!cv::findChessboardCorners(image, {board_.columns, board_.rows}, found,
                                   cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE |
                                       cv::CALIB_CB_FAST_CHECK) ||
        found.size() != static_cast<std::size_t>(board_.count())) {
      return {};
    }
    Grid grid;
    for (const cv::Point2f& p : found) grid.emplace_back(p.x, p.y);
    return grid;
  }

  Grid charuco(const cv::Mat& image) const {
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> ids, cornerIds;
    std::vector<cv::Point2f> corners;
    cv::aruco::detectMarkers(image, dictionary_, markers, ids);
    if (ids.empty()) return {};
    cv::aruco::interpolateCornersCharuco(markers, ids, image, charuco_, corners, cornerIds);
    Grid grid(static_cast<std::size_t>(board_.count()), notFound());
    for (std::size_t i = 0; i < cornerIds.size(); ++i) {
      grid[static_cast<std::size_t>(cornerIds[i])] = {corners[i].x, corners[i].y};
    }
    return grid;
  }

  /// The same corners, in every order of a board that is seen from its front.
  std::vector<Grid> turned(const Grid& found) const {
    const int columns = board_.columns, rows = board_.rows;
    std::vector<Grid> all;
    for (int way = 0; way < (columns == rows ? 8 : 4); ++way) {
      Grid grid(found.size());
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
          const int row = way & 1 ? rows - 1 - r : r, column = way & 2 ? columns - 1 - c : c;
          grid[index(r, c)] = found[way & 4 ? index(column, row) : index(row, column)];
        }
      }
      const Eigen::Vector2d x = grid[index(0, columns - 1)] - grid[0];
      const Eigen::Vector2d y = grid[index(rows - 1, 0)] - grid[0];
      if (x.x() * y.y() - x.y() * y.x() > 0) all.push_back(std::move(grid));
    }
    return all;
  }

  /// How much brighter the squares are that should be white [gray levels].
  double contrastOf(const Image& image, const Grid& grid) const {
    std::array<double, 2> sum{};
    std::array<int, 2> count{};
    forSquares(grid, [&](int row, int column, const Eigen::Vector2d& middle) {
      const auto white = static_cast<std::size_t>((row + column) % 2);
      const auto u = static_cast<unsigned>(middle.x()), v = static_cast<unsigned>(middle.y());
      if (!(middle.array() >= 0).all() || u >= image.getWidth() || v >= image.getHeight()) return;
      sum[white] += image[v][u];
      ++count[white];
    });
    return count[0] && count[1] ? sum[1] / count[1] - sum[0] / count[0] : 0;
  }

  /// \param use (row, column, middle): inner squares of which all corners are found, counted like
  /// all squares, so that an even sum is black
  template <class Use>
  void forSquares(const Grid& grid, const Use& use) const {
    for (int r = 0; r + 1 < board_.rows; ++r) {
      for (int c = 0; c + 1 < board_.columns; ++c) {
        const Eigen::Vector2d middle = 0.25 * (grid[index(r, c)] + grid[index(r, c + 1)] +
                                               grid[index(r + 1, c)] + grid[index(r + 1, c + 1)]);
        if (isFound(middle)) use(r, c, middle);
      }
    }
  }

  /// In the order of the ids: by the colours, then as expected, else corner 0 upper left.
  Grid upright(const Image& image, const Grid& found,
               const std::vector<ExpectedPoint>& expected) const {
    Grid best;
    double least = std::numeric_limits<double>::infinity();
    if (found.empty()) return best;
    for (Grid& grid : turned(found)) {
      if (!(contrastOf(image, grid) > 0)) continue;
      double away = 0;
      for (const ExpectedPoint& point : expected) {
        if (point.id < 0 || point.id >= board_.count()) continue;
        away +=
            (grid[static_cast<std::size_t>(point.id)] - Eigen::Vector2d(point.u, point.v)).norm();
      }
      if (away == 0) away = grid[0].sum();
      if (!(away < least)) continue;
      least = away;
      best = std::move(grid);
    }
    return best;
  }

  /// Side of the squares about a corner, the least [px]; infinite: no neighbour is found.
  double sideAt(const Grid& grid, int row, int column) const {
    double side = std::numeric_limits<double>::infinity();
    const Eigen::Vector2d& corner = grid[index(row, column)];
    const std::array<std::array<int, 2>, 4> neighbours{
        {{row, column - 1}, {row, column + 1}, {row - 1, column}, {row + 1, column}}};
    for (const auto& [r, c] : neighbours) {
      if (r < 0 || r >= board_.rows || c < 0 || c >= board_.columns) continue;
      if (isFound(grid[index(r, c)])) side = std::min(side, (grid[index(r, c)] - corner).norm());
    }
    return side;
  }

  /// 1 sigma of a pixel, by its neighbours in black squares [gray levels].
  double noiseOf(const Image& image, const Grid& grid) const {
    std::vector<double> variances;
    forSquares(grid, [&](int row, int column, const Eigen::Vector2d& middle) {
      const int box = std::min(kNoiseBox, static_cast<int>(0.2 * sideAt(grid, row, column)));
      const int u = static_cast<int>(middle.x()), v = static_cast<int>(middle.y());
      if ((row + column) % 2 != 0 || box < 1 || u < box || v < box ||
          u + box + 1 >= static_cast<int>(image.getWidth()) ||
          v + box >= static_cast<int>(image.getHeight())) {
        return;
      }
      double sum = 0;
      int count = 0;
      for (int y = v - box; y <= v + box; ++y) {
        for (int x = u - box; x <= u + box; ++x, ++count) {
          const double step =
              image[static_cast<unsigned>(y)][x + 1] - image[static_cast<unsigned>(y)][x];
          sum += 0.5 * step * step;
        }
      }
      variances.push_back(sum / count);
    });
    constexpr double kRounding = 1.0 / 12;  // variance of a level
    return std::sqrt(variances.empty() ? kRounding
                                       : std::max(kRounding, detail::medianOf(variances)));
  }

  void refine(const Image& image, const Grid& grid) {
    if (grid.empty()) return;
    const double noise = noiseOf(image, grid);
    // Up to the markers, whose edges do not lead to the corner.
    const double paper = board_.markers ? 0.5 * (1 - board_.markers->size / *board_.square) : 1;
    for (int r = 0; r < board_.rows; ++r) {
      for (int c = 0; c < board_.columns; ++c) {
        const double side = sideAt(grid, r, c);
        if (!isFound(grid[index(r, c)]) || !std::isfinite(side) || side < kLeastSide_px) continue;
        const double reach =
            std::clamp(side * std::min(kReach, paper), kLeastReach_px, kMostReach_px);
        const auto saddle = detail::refineSaddle(image, grid[index(r, c)], reach, noise);
        if (!saddle) continue;
        points_.push_back({static_cast<int>(index(r, c)), saddle->position.x(),
                           saddle->position.y(), saddle->sigma_px});
      }
    }
  }

  BoardTarget board_;
  cv::Ptr<cv::aruco::Dictionary> dictionary_;
  cv::Ptr<cv::aruco::CharucoBoard> charuco_;
  std::vector<TrackedPoint> points_;
};

BoardTracker::BoardTracker(const BoardTarget& board) : impl_(std::make_unique<Impl>(board)) {}

BoardTracker::BoardTracker(BoardTracker&&) noexcept = default;
BoardTracker& BoardTracker::operator=(BoardTracker&&) noexcept = default;
BoardTracker::~BoardTracker() = default;

const std::vector<TrackedPoint>& BoardTracker::track(const vpImage<unsigned char>& image,
                                                     const std::vector<ExpectedPoint>& expected) {
  return impl_->track(image, expected);
}

}  // namespace depthservo
