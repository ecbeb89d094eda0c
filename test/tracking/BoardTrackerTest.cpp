#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <random>
#include <stdexcept>

#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/tracking/BoardTracker.h"
#include "depthservo/visp/using.h"
#include "support/Poses.h"

namespace depthservo {
namespace {

using test::poseAt;
using Image = vpImage<unsigned char>;
using Points = std::vector<TrackedPoint>;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};
constexpr double kSquare = 0.03;

BoardTarget chessboard(int columns = 7, int rows = 4) { return {columns, rows, kSquare, {}}; }

BoardTarget charuco(int columns = 7, int rows = 4, const std::string& dictionary = "4x4_50") {
  return {columns, rows, kSquare, BoardTarget::Markers{dictionary, 0.75 * kSquare}};
}

/// A photograph of a board, by ray casting: 9 x 9 rays for a pixel where the light differs, 5 else;
/// nothing of the library takes part. Of a ChArUco board what is printed is OpenCV's own drawing.
class Photographer {
 public:
  explicit Photographer(const BoardTarget& board) : board_(board) {
    if (!board.markers) return;
    const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
    cv::aruco::CharucoBoard::create(board.columns + 1, board.rows + 1, 1, 0.75F, dictionary)
        ->draw({kCell * (board.columns + 1), kCell * (board.rows + 1)}, drawn_, 0, 1);
  }

  Image shoot(const Eigen::Isometry3d& cMo, double noise, unsigned seed = 1) const {
    constexpr int kRays = 9;
    std::mt19937 random(seed);
    std::normal_distribution<double> gaussian;
    Image image(480, 640);
    const Eigen::Isometry3d oMc = cMo.inverse();
    const auto seenAt = [&](double u, double v) {
      const Eigen::Vector3d ray((u - 319.5) / 600, (v - 239.5) / 600, 1);
      const Eigen::Vector3d direction = oMc.linear() * ray;
      const double t = -oMc.translation().z() / direction.z();
      return grayAt((oMc.translation() + t * direction).head<2>());
    };
    for (unsigned v = 0; v < 480; ++v) {
      for (unsigned u = 0; u < 640; ++u) {
        double gray = seenAt(u, v);
        bool isEven = true;
        for (const double du : {-0.5, 0.5}) {
          for (const double dv : {-0.5, 0.5}) isEven = isEven && seenAt(u + du, v + dv) == gray;
        }
        if (!isEven) {
          double sum = 0;
          for (int k = 0; k < kRays * kRays; ++k) {
            sum += seenAt(u + (k % kRays + 0.5) / kRays - 0.5, v + (k / kRays + 0.5) / kRays - 0.5);
          }
          gray = sum / (kRays * kRays);
        }
        if (noise > 0) gray += noise * gaussian(random);
        image[v][u] = static_cast<unsigned char>(std::clamp(std::round(gray), 0.0, 255.0));
      }
    }
    return image;
  }

 private:
  static constexpr int kCell = 64;  // pixels of a square in the drawing: markers have 48

  double grayAt(const Eigen::Vector2d& p) const {
    const double x = p.x() / kSquare + 0.5 * (board_.columns + 1);  // in squares, upper left
    const double y = p.y() / kSquare + 0.5 * (board_.rows + 1);
    if (x < -0.5 || y < -0.5 || x > board_.columns + 1.5 || y > board_.rows + 1.5) return 130;
    if (x < 0 || y < 0 || x >= board_.columns + 1 || y >= board_.rows + 1) return 215;
    const bool isBlack = drawn_.empty()
                             ? (static_cast<int>(x) + static_cast<int>(y)) % 2 == 0
                             : drawn_.at<unsigned char>(static_cast<int>(y * kCell),
                                                        static_cast<int>(x * kCell)) < 128;
    return isBlack ? 25 : 215;
  }

  BoardTarget board_;
  cv::Mat drawn_;
};

/// Where the corner with this id is, by the words of BoardTarget.
Eigen::Vector2d truth(const BoardTarget& board, int id, const Eigen::Isometry3d& cMo) {
  const int row = id / board.columns, column = id % board.columns;
  const Eigen::Vector3d p = cMo * Eigen::Vector3d((column - (board.columns - 1) / 2.0) * kSquare,
                                                  (row - (board.rows - 1) / 2.0) * kSquare, 0);
  return {600 * p.x() / p.z() + 319.5, 600 * p.y() / p.z() + 239.5};
}

struct Errors {
  double worst_px = 0, squared = 0, normalised = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int corners = 0;

  void add(const Points& points, const BoardTarget& board, const Eigen::Isometry3d& cMo) {
    for (const TrackedPoint& point : points) {
      const Eigen::Vector2d e = Eigen::Vector2d(point.u, point.v) - truth(board, point.id, cMo);
      worst_px = std::max(worst_px, e.norm());
      sum += e;
      squared += e.squaredNorm();
      normalised += e.squaredNorm() / (point.sigma_px * point.sigma_px);
      ++corners;
    }
  }
  double rms() const { return std::sqrt(squared / (2 * corners)); }
  double nees() const { return normalised / (2 * corners); }  // 1 when sigma is honest
};

/// Tilts up to 30 degrees, any roll.
std::vector<Eigen::Isometry3d> randomPoses(int n, double Z) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < n; ++i) {
    poses.push_back(poseAt({0.1 * Z * unit(random), 0.06 * Z * unit(random), Z},
                           {0.5 * unit(random), 0.5 * unit(random), 3.1 * unit(random)}));
  }
  return poses;
}

std::vector<ExpectedPoint> expectedAt(const BoardTarget& board, const Eigen::Isometry3d& cMo) {
  std::vector<ExpectedPoint> expected;
  for (int id = 0; id < board.count(); ++id) {
    const Eigen::Vector2d p = truth(board, id, cMo);
    expected.push_back({id, p.x(), p.y(), 1});
  }
  return expected;
}

struct Sight {
  const char* name;
  double Z, noise, most_rms_px;
};

class BoardSight : public testing::TestWithParam<Sight> {};

TEST_P(BoardSight, corners_are_where_they_project_whatever_the_roll_and_sigma_is_honest) {
  const Sight& sight = GetParam();
  for (const BoardTarget& board : {chessboard(), charuco()}) {
    const Photographer photographer(board);
    BoardTracker tracker(board);
    Errors errors;
    constexpr int kPoses = 6;
    unsigned seed = 0;
    for (const Eigen::Isometry3d& cMo : randomPoses(kPoses, sight.Z)) {
      errors.add(tracker.track(photographer.shoot(cMo, sight.noise, ++seed), {}), board, cMo);
    }
    const char* name = board.markers ? "charuco" : "chessboard";
    std::printf("%s %s: %d corners, rms %.4f px, worst %.3f, mean %.4f %.4f, NEES %.2f\n",
                sight.name, name, errors.corners, errors.rms(), errors.worst_px,
                errors.sum.x() / errors.corners, errors.sum.y() / errors.corners, errors.nees());
    EXPECT_GE(errors.corners, 0.9 * kPoses * board.count()) << name;
    EXPECT_LT(errors.rms(), sight.most_rms_px) << name;
    EXPECT_LT(errors.worst_px, 6 * sight.most_rms_px) << name;
    EXPECT_LT(errors.nees(), 1.5) << name;
    EXPECT_GT(errors.nees(), 0.1) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(BoardTrackerTest, BoardSight,
                         testing::Values(Sight{"near", 0.3, 2, 0.05}, Sight{"middle", 0.6, 2, 0.05},
                                         Sight{"far", 0.9, 1, 0.1}, Sight{"noisy", 0.5, 8, 0.1}),
                         [](const auto& sight) { return std::string(sight.param.name); });

TEST(BoardTrackerTest, a_board_that_looks_the_same_turned_is_followed_as_it_is_expected) {
  for (const BoardTarget& board : {chessboard(6, 4), chessboard(4, 4), chessboard(5, 5)}) {
    const Photographer photographer(board);
    BoardTracker tracker(board);
    Errors errors;
    std::vector<ExpectedPoint> expected;
    constexpr int kTurns = 12;
    for (int k = 0; k < kTurns; ++k) {
      const double roll = 2 * M_PI * k / kTurns;
      const Eigen::Isometry3d cMo = poseAt({0.02, 0, 0.5}, {0.3, 0.1, roll});
      errors.add(tracker.track(photographer.shoot(cMo, 1), expected), board, cMo);
      expected = expectedAt(board, cMo);
    }
    EXPECT_EQ(errors.corners, kTurns * board.count()) << board.columns << "x" << board.rows;
    EXPECT_LT(errors.worst_px, 0.3) << board.columns << "x" << board.rows;
  }
}

TEST(BoardTrackerTest, what_is_not_there_is_not_found) {
  const Photographer photographer(chessboard());
  const Eigen::Isometry3d cMo = poseAt({0, 0, 0.5}, {0.2, 0.1, 0.3});
  Image image = photographer.shoot(cMo, 2);
  EXPECT_EQ(BoardTracker(chessboard()).track(image, {}).size(), 28u);
  EXPECT_TRUE(BoardTracker(chessboard(8, 5)).track(image, {}).empty()) << "a larger board";
  EXPECT_TRUE(BoardTracker(charuco()).track(image, {}).empty()) << "no markers";
  const Eigen::Vector2d corner = truth(chessboard(), 9, cMo);
  for (int v = -30; v < 30; ++v) {
    for (int u = -30; u < 30; ++u) {
      image[static_cast<unsigned>(corner.y() + v)][static_cast<unsigned>(corner.x() + u)] = 120;
    }
  }
  EXPECT_TRUE(BoardTracker(chessboard()).track(image, {}).empty()) << "a corner is covered";
  for (const Image& other : {Image(), Image(1, 1, 200), Image(480, 640, 128)}) {
    EXPECT_TRUE(BoardTracker(chessboard()).track(other, {}).empty());
    EXPECT_TRUE(BoardTracker(charuco()).track(other, {}).empty());
  }
}

TEST(BoardTrackerTest, of_a_charuco_board_that_is_half_covered_the_rest_is_found) {
  const BoardTarget board = charuco();
  const Eigen::Isometry3d cMo = poseAt({0, 0, 0.4}, {0.2, -0.2, 2});
  Image image = Photographer(board).shoot(cMo, 2);
  for (unsigned v = 0; v < 240; ++v) std::fill(image[v], image[v] + 640, 90);
  Errors errors;
  BoardTracker tracker(board);
  const Points& points = tracker.track(image, {});
  errors.add(points, board, cMo);
  EXPECT_GE(errors.corners, 8);
  EXPECT_LT(errors.corners, 20);
  EXPECT_LT(errors.worst_px, 0.3);
  for (const TrackedPoint& point : points) EXPECT_GT(point.v, 240) << point.id;
  EXPECT_TRUE(std::is_sorted(points.begin(), points.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));
}

TEST(BoardTrackerTest, the_synthetic_board_is_that_of_opencv) {
  for (const BoardTarget& board : {chessboard(6, 5), charuco(6, 5), charuco(5, 4)}) {
    const Eigen::Isometry3d cMo = poseAt({0, 0.01, 0.4}, {0.3, 0.2, -0.5});
    SyntheticView view;
    view.cMo = cMo;
    Image image;
    SyntheticCamera(kCamera, board.patches(25, 215), {}).render(view, image);
    const Image expected = Photographer(board).shoot(cMo, 0);
    int differ = 0, board_px = 0;
    for (unsigned v = 0; v < 480; ++v) {
      for (unsigned u = 0; u < 640; ++u) {
        if (expected[v][u] > 100) continue;  // the paper ends where its background begins
        ++board_px;
        differ += std::abs(image[v][u] - expected[v][u]) > 40;
      }
    }
    EXPECT_GT(board_px, 10000);
    EXPECT_LT(differ, 0.01 * board_px);
  }
}

TEST(BoardTargetTest, boards_that_cannot_be_are_refused_in_words) {
  const auto why = [](const BoardTarget& board) { return board.objection(); };
  EXPECT_EQ(why(chessboard()), "");
  EXPECT_EQ(why(charuco()), "");
  EXPECT_NE(why(chessboard(2, 5)), "");
  EXPECT_NE(why(chessboard(5, 25)), "");
  BoardTarget board = charuco();
  board.square.reset();
  EXPECT_NE(why(board), "");
  board.square = 0.02;  // less than a marker
  EXPECT_NE(why(board), "");
  EXPECT_NE(why(charuco(12, 9)).find("65 markers"), std::string::npos);
  EXPECT_THROW(BoardTracker(chessboard(2, 5)), std::invalid_argument);
  EXPECT_THROW(BoardTracker(charuco(7, 4, "4x5_50")), std::invalid_argument);
  for (const std::string& name : arucoDictionaries()) EXPECT_GE(arucoMarkerCount(name), 30);
}

}  // namespace
}  // namespace depthservo
