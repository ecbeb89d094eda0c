#include <gtest/gtest.h>

#include <algorithm>

#include "depthservo/motion/Motion.h"
#include "depthservo/visp/using.h"
#include "servo/ImageCheck.h"
#include "support/Random.h"

namespace depthservo::test {
namespace {

using Image = vpImage<unsigned char>;
using Verdict = ImageCheck::Verdict;

/// A dark square on a light wall, with noise.
Image scene(Random& random, double noise = 2) {
  Image image(120, 160);
  for (unsigned v = 0; v < 120; ++v) {
    for (unsigned u = 0; u < 160; ++u) {
      const bool isDark = u > 70 && u < 80 && v > 50 && v < 60;
      image[v][u] = static_cast<unsigned char>((isDark ? 40 : 200) + random.normal(noise));
    }
  }
  return image;
}

Motion step(double forward, double turn = 0) {
  return Motion::fromTwist({{0, 0, forward}, {0, turn, 0}}, 1);
}

TEST(ImageCheck, takes_images_that_differ_be_it_by_noise_alone) {
  Random random(1);
  ImageCheck check;
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(check.look(scene(random)), Verdict::usable);
    check.move(step(0.1));
  }
}

TEST(ImageCheck, the_same_image_is_frozen_once_the_camera_has_moved) {
  Random random(1);
  const Image image = scene(random);
  for (const Motion& motion : {step(0.002), step(0, 0.002)}) {
    ImageCheck check;
    EXPECT_EQ(check.look(image), Verdict::usable);
    check.move(motion);
    EXPECT_EQ(check.look(image), Verdict::usable) << "hardly moved";
    check.move(motion);
    check.move(motion);
    EXPECT_EQ(check.look(image), Verdict::frozen);
    EXPECT_EQ(check.look(image), Verdict::frozen);
    EXPECT_EQ(check.look(scene(random)), Verdict::usable) << "it shows something new";
  }
}

TEST(ImageCheck, a_robot_that_stands_sees_the_same_for_ever) {
  Random random(1);
  ImageCheck check;
  const Image image = scene(random, 0);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(check.look(image), Verdict::usable);
    check.move(step(0));
  }
}

TEST(ImageCheck, black_and_uniform_images_show_nothing) {
  Random random(1);
  for (const int level : {0, 3, 128, 255}) {
    Image image(120, 160);
    for (unsigned i = 0; i < image.getSize(); ++i) {
      image.bitmap[i] =
          static_cast<unsigned char>(std::clamp(level + random.normal(1.5), 0., 255.));
    }
    image[5][5] = 255 - static_cast<unsigned char>(level);  // a hot pixel is nothing
    EXPECT_EQ(ImageCheck().look(image), Verdict::empty) << level;
  }
}

TEST(ImageCheck, a_few_pixels_show_nothing_whatever_they_are) {
  EXPECT_EQ(ImageCheck().look(Image()), Verdict::empty);
  Image image(4, 4);
  for (unsigned i = 0; i < 16; ++i) image.bitmap[i] = static_cast<unsigned char>(17 * i);
  EXPECT_EQ(ImageCheck().look(image), Verdict::empty);
}

TEST(ImageCheck, a_far_dot_is_something) {
  Random random(1);
  Image image = scene(random);
  for (unsigned v = 0; v < 120; ++v) {
    for (unsigned u = 0; u < 160; ++u) image[v][u] = u < 5 && v < 5 ? 30 : 200;
  }
  EXPECT_EQ(ImageCheck().look(image), Verdict::usable);
}

}  // namespace
}  // namespace depthservo::test
