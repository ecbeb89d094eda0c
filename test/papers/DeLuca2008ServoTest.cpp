// The success tables of sections 7.2 and 7.3 against the specification's, which come from another
// program. Starts are counted; two of 35 may differ, since the noise does.
#include <gtest/gtest.h>

#include "depthservo/rig/SimulatedRig.h"
#include "papers/DeLuca2008Servo.h"

namespace depthservo::deluca2008 {
namespace {

int reached(const Arrangement& arrangement, double Z, const Method& method) {
  int count = 0;
  for (const Course& course : servoFromAll(arrangement, startsOfTables(arrangement, Z), method)) {
    const bool isOfPoints = method.features == FeatureChoice::points;
    count += isOfPoints ? course.reachedPoints() : course.reachedMoments();
  }
  return count;
}

TEST(DeLuca2008Servo, goalOfThePointsIsThatOfThePaper) {
  const Arrangement a = pointArrangement(ImageSize::vga);
  const RobotPose goal = *rigOptions(a, {0, 3.9, 0}).robot.goal;
  EXPECT_NEAR(goal.x, -1.05363, 1e-5);
  EXPECT_NEAR(goal.y, 0.14339, 1e-5);
  const double pixels[4][2] = {{46, 379}, {143, 374}, {139, 201}, {38, 203}};
  for (const ImageSize size : {ImageSize::vga, ImageSize::xga}) {
    const SimulatedRig rig(rigOptions(pointArrangement(size), {0, 3.9, 0}));
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d seen(rig.truthAtGoal()[i].u, rig.truthAtGoal()[i].v);
      // A level camera fits the paper's pixels to 2.4 px rms.
      EXPECT_NEAR(seen.x(), pixels[i][0], 5) << i;
      EXPECT_NEAR(seen.y(), pixels[i][1], 5) << i;
    }
  }
}

TEST(DeLuca2008Servo, pointsReachTheGoalWithOneDepthForThePlateFromEveryGuess) {
  for (const auto& [size, expected] : {std::pair{ImageSize::vga, 31}, {ImageSize::xga, 28}}) {
    const Arrangement a = pointArrangement(size);
    EXPECT_NEAR(reached(a, 3.9, {FeatureChoice::points, DepthSource::truth}), expected, 2);
    for (const double guess : {1.6, 3., 5., 8.}) {
      EXPECT_NEAR(reached(a, 3.9, {FeatureChoice::points, DepthSource::object, guess}), expected, 2)
          << guess;
    }
  }
}

TEST(DeLuca2008Servo, pointsWithAConstantDepthFailTheMoreTheLargerItIs) {
  const Arrangement a = pointArrangement(ImageSize::vga);
  const std::pair<double, int> expected[] = {{1.6, 33}, {3, 25}, {5, 21}, {8, 14}};
  for (const auto& [guess, count] : expected) {
    EXPECT_NEAR(reached(a, 3.9, {FeatureChoice::points, DepthSource::constant, guess}), count, 2);
  }
}

TEST(DeLuca2008Servo, momentsReachTheGoalFromEveryGuess) {
  const Arrangement a = momentArrangement(ImageSize::vga);
  for (const FeatureChoice features : {FeatureChoice::moments, FeatureChoice::momentsInPixels}) {
    for (const double guess : {.9, 3., 5., 8., 16.}) {
      EXPECT_GE(reached(a, 4.1, {features, DepthSource::object, guess}), 33) << guess;
    }
  }
}

TEST(DeLuca2008Servo, momentsFromAnUnderestimatedGuessNeedTheTightClamp) {
  const Arrangement a = momentArrangement(ImageSize::vga);
  const auto withClamp = [&](double Z_min) {
    return reached(a, 4.1, {FeatureChoice::moments, DepthSource::observer, 0.9, 44000, Z_min});
  };
  EXPECT_GE(withClamp(0.5), 33);
  EXPECT_NEAR(withClamp(0.05), 25, 2);
}

TEST(DeLuca2008Servo, imagesEndAsExactGeometryDoes) {
  Circumstances images;
  images.throughImages = true;
  const Arrangement a = pointArrangement(ImageSize::vga);
  const std::vector<Start> starts = startsOfTables(a, 3.9);
  for (const double guess : {1.6, 8.}) {
    const Method method{FeatureChoice::points, DepthSource::object, guess};
    for (const std::size_t i : {3u, 17u, 30u}) {
      const Course exact = servo(a, starts[i], method), seen = servo(a, starts[i], method, images);
      EXPECT_TRUE(seen.stayedInImage);
      EXPECT_NEAR(seen.rms_px, exact.rms_px, 2);
    }
  }
}

TEST(DeLuca2008Servo, resultDoesNotDependOnTheNumberOfProcessors) {
  const Arrangement a = pointArrangement(ImageSize::vga);
  const std::vector<Start> starts = startsOfTables(a, 3.9);
  const Method method{FeatureChoice::points, DepthSource::observer, 3};
  const std::vector<Course> together = servoFromAll(a, starts, method);
  for (const std::size_t i : {0u, 16u, 34u}) {
    Circumstances alone;
    alone.seed += static_cast<unsigned>(i);
    const Course course = servo(a, starts[i], method, alone);
    EXPECT_EQ(course.rms_px, together[i].rms_px);
    EXPECT_EQ(course.end_s, together[i].end_s);
  }
}

}  // namespace
}  // namespace depthservo::deluca2008
