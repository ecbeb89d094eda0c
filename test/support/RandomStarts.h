#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <vector>

#include "depthservo/features/FeaturePoint.h"
#include "support/FourPointScene.h"
#include "support/Random.h"

namespace depthservo::test {

/// The four-point task of a free camera from random starts: up to 1.4 m from the goal pose's depth,
/// 70 degrees of roll and 15 of tilt, all points in view.
struct RandomStart {
  static constexpr double kWidth = .5, kHeight = .38;  ///< half of the image, normalised

  vpHomogeneousMatrix cMo;

  static RandomStart draw(Random& random) {
    for (;;) {
      const double deg = M_PI / 180;
      RandomStart start;
      start.cMo =
          vpHomogeneousMatrix(vpTranslationVector(random.uniform(-.3, .3), random.uniform(-.3, .3),
                                                  random.uniform(.7, 1.4)),
                              vpRotationMatrix(vpThetaUVector(random.uniform(-15, 15) * deg,
                                                              random.uniform(-15, 15) * deg,
                                                              random.uniform(-70, 70) * deg)));
      bool isInView = true;
      for (std::size_t i = 0; i < 4; ++i) {
        const vpPoint p = FourPointScene::at(i, start.cMo);
        isInView &= std::abs(p.get_x()) < kWidth && std::abs(p.get_y()) < kHeight;
      }
      if (isInView) return start;
    }
  }
};

/// `goal`: constant, every point's depth at the goal.
enum class UsedDepth { truth, observed, blended, constant, goal };

struct Course {
  double time_s = std::numeric_limits<double>::infinity();  ///< infinite: not at the goal
  double largest =
      0;  ///< image coordinate relative to the border; above 1: a point was out of view
};

/// Time until the rms image error is, and stays, below 2 px; infinite when it is not by the end
/// of 10 s. Image noise 0.25 px, 30 images per second, gain 0.8. \param late images by which the
/// robot follows its commands later
inline Course courseFrom(const RandomStart& start, UsedDepth depth, double guessFactor,
                         unsigned seed, std::size_t late = 0) {
  constexpr int kImages = 300;
  constexpr double kFocal_px = 600, kNoise = .25 / kFocal_px, kDone = 2 / kFocal_px;
  Random random(seed);
  FourPointScene scene(start.cMo.inverse());
  std::vector<FeaturePoint> s(4);
  std::vector<vpFeaturePoint> s_star(4);
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(.8);
  for (std::size_t i = 0; i < 4; ++i) {
    vpPoint p = scene.desired(i);
    vpFeatureBuilder::create(s_star[i], p);
    const bool isAtGoal = depth == UsedDepth::goal;
    s[i].set_Z(isAtGoal ? p.get_Z() : guessFactor * scene.seen(i).get_Z());
    s[i].setNoise(.25, vpCameraParameters(kFocal_px, kFocal_px, 320, 240));
    s[i].setServoDepth(depth == UsedDepth::blended ? ServoDepth::blended : ServoDepth::observed);
    task.addFeature(s[i], s_star[i]);
  }
  std::deque<vpColVector> underway(late, vpColVector(6, 0.));
  vpColVector v(6, 0.);
  Course course;
  int done = 0;
  for (int k = 0; k < kImages; ++k) {
    double squared = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const vpPoint p = scene.seen(i), goal = scene.desired(i);
      if (!(p.get_Z() > .05)) return {course.time_s, HUGE_VAL};
      course.largest = std::max({course.largest, std::abs(p.get_x()) / RandomStart::kWidth,
                                 std::abs(p.get_y()) / RandomStart::kHeight});
      squared += std::pow(p.get_x() - goal.get_x(), 2) + std::pow(p.get_y() - goal.get_y(), 2);
      s[i].set_x(p.get_x() + random.normal(kNoise));
      s[i].set_y(p.get_y() + random.normal(kNoise));
      if (depth == UsedDepth::truth) s[i].set_Z(p.get_Z());
      if (depth == UsedDepth::observed || depth == UsedDepth::blended) s[i].observe(v, kPeriod_s);
    }
    if (std::sqrt(squared / 4) > kDone) done = k + 1;
    underway.push_back(task.computeControlLaw());
    v = scene.apply(underway.front());
    underway.pop_front();
  }
  if (done < kImages) course.time_s = done * kPeriod_s;
  return course;
}

struct StartsOutcome {
  double success = 0;   ///< share of the starts
  double inView = 0;    ///< share that succeeds and has all points in view all the time
  double median_s = 0;  ///< of all starts, those that fail counted as infinite
};

inline StartsOutcome manyStarts(unsigned starts, UsedDepth depth, double guessFactor,
                                std::size_t late = 0) {
  StartsOutcome outcome;
  std::vector<double> times;
  Random random(1);
  for (unsigned i = 0; i < starts; ++i) {
    const Course course = courseFrom(RandomStart::draw(random), depth, guessFactor, i + 1, late);
    times.push_back(course.time_s);
    const bool isThere = std::isfinite(course.time_s);
    outcome.success += isThere;
    outcome.inView += isThere && course.largest <= 1;
  }
  std::sort(times.begin(), times.end());
  outcome.success /= starts;
  outcome.inView /= starts;
  outcome.median_s = times[times.size() / 2];
  return outcome;
}

}  // namespace depthservo::test
