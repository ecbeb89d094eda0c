#include <gtest/gtest.h>

#include <cmath>

#include "depthservo/observation/Film.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

TEST(Film, keepsEveryImageOfAShortRun) {
  Film film;
  for (int i = 0; i < 5; ++i)
    film.add(i, vpImage<unsigned char>(3, 4, static_cast<unsigned char>(i)));
  ASSERT_EQ(film.pictures().size(), 5u);
  for (int i = 0; i < 5; ++i) {
    const Film::Picture& picture = film.pictures()[static_cast<std::size_t>(i)];
    EXPECT_EQ(picture.time_s, i);
    EXPECT_EQ(picture.width, 4);
    EXPECT_EQ(picture.height, 3);
    EXPECT_EQ(picture.gray, std::vector<unsigned char>(12, static_cast<unsigned char>(i)));
  }
}

TEST(Film, isEvenlySpreadAndBoundedHoweverLongTheRun) {
  Film film;
  for (int i = 0; i < 10000; ++i) {
    film.add(i, vpImage<unsigned char>(2, 2, 0));
    const auto& pictures = film.pictures();
    ASSERT_LE(pictures.size(), Film::kMost);
    ASSERT_GE(pictures.size(),
              std::min<std::size_t>(static_cast<std::size_t>(i) + 1, Film::kMost / 2));
    ASSERT_EQ(pictures.front().time_s, 0);
    if (pictures.size() < 2) continue;
    const double step = pictures[1].time_s - pictures[0].time_s;
    for (std::size_t k = 1; k < pictures.size(); ++k) {
      ASSERT_EQ(pictures[k].time_s - pictures[k - 1].time_s, step) << "image " << i << ", " << k;
    }
    ASSERT_LT(i - pictures.back().time_s, step) << "up to the end";
  }
}

TEST(Film, largeImagesAreShrunkByTheMeansOfBlocks) {
  vpImage<unsigned char> image(900, 1280);
  for (unsigned v = 0; v < 900; ++v) {
    for (unsigned u = 0; u < 1280; ++u) image[v][u] = u % 2 == 0 ? 100 : 200;
  }
  Film film;
  film.add(0, image);
  EXPECT_EQ(film.pictures()[0].width, 640);
  EXPECT_EQ(film.pictures()[0].height, 450);
  for (const unsigned char level : film.pictures()[0].gray) ASSERT_EQ(level, 150);
}

}  // namespace
}  // namespace depthservo
