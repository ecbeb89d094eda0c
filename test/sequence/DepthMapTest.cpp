#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "depthservo/sequence/DepthMap.h"
#include "sequence/associate.h"
#include "support/InputErrors.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::inputErrorOf;
using test::isRefusal;

constexpr double kScale = 5000;

class DepthMapTest : public testing::Test {
 protected:
  DepthMap mapOf(const cv::Mat& levels) const {
    cv::imwrite(folder_ / "depth.png", levels);
    return DepthMap(folder_ / "depth.png", kScale);
  }
  test::TemporaryFolder folder_;
};

TEST_F(DepthMapTest, is_exact_on_a_plane_seen_at_an_angle) {
  // 1/Z is linear in the pixel: 60 degrees off the axis for f = 500 px.
  const auto chi = [](double u, double v) { return 0.8 + 0.0025 * (u - 30) + 0.001 * v; };
  cv::Mat levels(40, 60, CV_16U);
  for (int v = 0; v < levels.rows; ++v) {
    for (int u = 0; u < levels.cols; ++u) {
      levels.at<unsigned short>(v, u) =
          static_cast<unsigned short>(std::lround(kScale / chi(u, v)));
    }
  }
  const DepthMap map = mapOf(levels);
  EXPECT_EQ(map.width(), 60);
  EXPECT_EQ(map.height(), 40);
  for (double u = 1; u < 57.9; u += 0.37) {
    for (double v = 1; v < 37.9; v += 0.41) {
      const auto Z = map.at(u, v);
      ASSERT_TRUE(Z) << u << ", " << v;
      EXPECT_NEAR(*Z, 1 / chi(u, v), 0.6 / kScale);
    }
  }
}

TEST_F(DepthMapTest, is_unknown_at_an_edge_beside_a_hole_and_at_the_border) {
  cv::Mat levels(40, 60, CV_16U, cv::Scalar(5000));
  levels.colRange(30, 60).setTo(7000);
  levels.at<unsigned short>(20, 10) = 0;
  const DepthMap map = mapOf(levels);
  for (double u = 28; u < 31; u += 0.25) EXPECT_FALSE(map.at(u, 10.5)) << u;
  EXPECT_TRUE(map.at(27.5, 10.5));
  EXPECT_TRUE(map.at(31.5, 10.5));
  for (double v = 18.5; v < 22; v += 0.5) EXPECT_FALSE(map.at(10.2, v)) << v;
  EXPECT_TRUE(map.at(10.2, 17.5));
  EXPECT_FALSE(map.at(0.5, 10));
  EXPECT_FALSE(map.at(58.5, 10));
  EXPECT_FALSE(map.at(-1e9, 1e9));
  EXPECT_FALSE(map.at(std::nan(""), 5));
}

TEST_F(DepthMapTest, of_something_else_is_refused) {
  cv::imwrite(folder_ / "gray.png", cv::Mat(4, 4, CV_8U, cv::Scalar(1)));
  EXPECT_TRUE(
      isRefusal(inputErrorOf([&] { DepthMap(folder_ / "gray.png", 1); }), {"gray.png", "16-bit"}));
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { DepthMap(folder_ / "none.png", 1); }), {"none.png"}));
}

/// As associate.py says it, word for word.
std::vector<std::optional<std::size_t>> byTheBook(const std::vector<double>& first,
                                                  const std::vector<double>& second) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> potential;
  for (std::size_t a = 0; a < first.size(); ++a) {
    for (std::size_t b = 0; b < second.size(); ++b) {
      const double difference = std::abs(first[a] - second[b]);
      if (difference < 0.02) potential.emplace_back(difference, a, b);
    }
  }
  std::sort(potential.begin(), potential.end());
  std::vector<std::optional<std::size_t>> matches(first.size());
  std::vector<std::size_t> used;
  for (const auto& [difference, a, b] : potential) {
    if (matches[a] || std::count(used.begin(), used.end(), b)) continue;
    matches[a] = b;
    used.push_back(b);
  }
  return matches;
}

TEST(Associate, gives_each_time_its_nearest_free_partner) {
  const auto partners = detail::associate({1.00, 1.01, 2.0}, {1.008, 1.03, 2.02});
  EXPECT_EQ(partners[1], 0u);
  EXPECT_FALSE(partners[0]) << "1.008 is taken by 1.01, 1.03 is too far";
  EXPECT_FALSE(partners[2]) << "0.02 s is not closer than 0.02 s";
}

TEST(Associate, agrees_with_associate_py_on_jittered_streams) {
  test::Random random(7);
  for (int run = 0; run < 50; ++run) {
    std::vector<double> first, second;
    for (int i = 0; i < 60; ++i) {
      if (random.uniform(0, 1) < 0.9) first.push_back(1.3e9 + i / 60.0 + random.uniform(0, 0.03));
      if (random.uniform(0, 1) < 0.9) second.push_back(1.3e9 + i / 60.0 + random.uniform(0, 0.03));
    }
    std::sort(first.begin(), first.end());
    std::sort(second.begin(), second.end());
    EXPECT_EQ(detail::associate(first, second), byTheBook(first, second));
  }
}

}  // namespace
}  // namespace depthservo
