#include <gtest/gtest.h>

#include <type_traits>
#include <vector>

#include "depthservo/visp/GrayImage.h"
#include "depthservo/visp/using.h"

namespace depthservo {
namespace {

static_assert(std::is_nothrow_move_constructible_v<GrayImage> &&
              std::is_nothrow_move_assignable_v<GrayImage>);

GrayImage imageOf(unsigned char value) { return vpImage<unsigned char>(3, 4, value); }

// The sanitizers of a merge tell what is not freed and what is read at null.
TEST(GrayImage, that_was_moved_from_takes_another) {
  std::vector<GrayImage> images;
  for (unsigned char value = 1; value <= 3; ++value) images.push_back(imageOf(value));
  const GrayImage first = std::move(images.front());
  images.erase(images.begin());
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(first[2][3], 1);
  EXPECT_EQ(images[0][2][3], 2);
  EXPECT_EQ(images[1][2][3], 3);
  GrayImage& again = images[0];
  const GrayImage second = std::move(again);
  EXPECT_EQ(again.getSize(), 0u);
  again = first;
  EXPECT_EQ(again[0][0], 1);
  EXPECT_EQ(second[0][0], 2);
}

TEST(GrayImage, that_is_empty_is_copied) {
  const GrayImage empty;
  GrayImage copy = empty;
  EXPECT_EQ(copy.getSize(), 0u);
  copy = imageOf(7);
  EXPECT_EQ(copy.getHeight(), 3u);
  copy = empty;
  EXPECT_EQ(copy.getSize(), 0u);
}

TEST(GrayImage, copies_pixels_that_another_may_own) {
  unsigned char pixels[4] = {1, 2, 3, 4};
  {
    GrayImage image = vpImage<unsigned char>(pixels, 2, 2, false);
    image = vpImage<unsigned char>(pixels, 2, 2, false);
    image[1][1] = 9;
  }
  EXPECT_EQ(pixels[3], 4);
}

}  // namespace
}  // namespace depthservo
