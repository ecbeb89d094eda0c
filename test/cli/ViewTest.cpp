// What the live window shows, without a window.

#include <gtest/gtest.h>

#include <algorithm>

#include "support/exampleLog.h"
#include "view/picture.h"

namespace depthservo {
namespace {

DEPTHSERVO_VISP vpImage<DEPTHSERVO_VISP vpRGBa> pictureOf(const RunLog& log, unsigned char gray) {
  const DEPTHSERVO_VISP vpImage<unsigned char> image(480, 640, gray);
  DEPTHSERVO_VISP vpImage<DEPTHSERVO_VISP vpRGBa> picture;
  draw(image, log.frames.back(), log, "", picture);
  return picture;
}

/// One point, far from all words, that has always been there.
RunLog logOfPoint(double u, double v, bool measured) {
  RunLog log = test::exampleLog(31);
  log.goals.clear();
  for (FrameRecord& frame : log.frames) {
    frame.features.resize(1);
    frame.features[0].u = u;
    frame.features[0].v = v;
    frame.features[0].measured = measured;
  }
  return log;
}

TEST(View, rings_of_points_tell_measured_ones_by_blue_and_predicted_ones_by_orange) {
  const auto blue = pictureOf(logOfPoint(320, 240, true), 128)[240][328];
  EXPECT_GT(blue.B, blue.R + 100);
  const auto orange = pictureOf(logOfPoint(320, 240, false), 128)[240][328];
  EXPECT_GT(orange.R, orange.B + 100);
}

TEST(View, shows_the_image_where_nothing_is_known) {
  const auto picture = pictureOf(logOfPoint(320, 240, true), 77);
  for (const unsigned v : {100u, 240u, 400u}) {
    const auto pixel = picture[v][500];
    EXPECT_TRUE(pixel.R == 77 && pixel.G == 77 && pixel.B == 77) << v;
  }
}

TEST(View, words_are_dark_on_light_whatever_the_image) {
  for (const int gray : {0, 255}) {
    const auto picture = pictureOf(logOfPoint(320, 240, true), static_cast<unsigned char>(gray));
    int darkest = 255, lightest = 0;
    for (unsigned u = 12; u < 60; ++u) {  // "t 1.00 s"
      for (unsigned v = 8; v < 22; ++v) {
        darkest = std::min<int>(darkest, picture[v][u].G);
        lightest = std::max<int>(lightest, picture[v][u].G);
      }
    }
    EXPECT_LT(darkest, 80) << "image of gray " << gray;
    EXPECT_GT(lightest, 200) << "image of gray " << gray;
  }
}

TEST(View, points_without_a_place_are_left_out) {
  const auto nothing = pictureOf(logOfPoint(kUnknown, kUnknown, true), 128);
  const auto far = pictureOf(logOfPoint(1e300, -1e300, true), 128);
  for (unsigned u = 0; u < 640; ++u) {
    ASSERT_EQ(nothing[240][u].B, 128);
    ASSERT_EQ(far[240][u].B, 128);
  }
  EXPECT_GT(nothing[10][8].G, 200) << "the light strip of its words";
}

}  // namespace
}  // namespace depthservo
