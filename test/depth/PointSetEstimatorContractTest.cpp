// What every PointSetEstimator promises, whatever its method; a new one is added to the list below.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "depthservo/depth/InverseDepthFilter.h"
#include "depthservo/depth/JointDepthFilter.h"
#include "depthservo/depth/NonlinearDepthObserver.h"
#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/depth/PointwiseEstimator.h"
#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "support/Garbage.h"

namespace depthservo {
namespace {

using test::garbage;
using test::garbageMeasurement;
using test::garbagePrior;
using test::garbageTwist;
using test::isSane;
using test::Random;

constexpr std::size_t kCapacity = 10;

struct Method {
  std::string name;
  std::function<std::unique_ptr<PointSetEstimator>(const DepthRange&)> make;
};

JointDepthFilterOptions everything() {
  JointDepthFilterOptions options;
  options.estimateGyroBias = options.estimateFocal = true;
  options.filter.odometryScaleSigma = 0.02;
  return options;
}

const std::vector<Method> kMethods{
    {"JointDepthFilter",
     [](const DepthRange& range) {
       return std::make_unique<JointDepthFilter>(kCapacity, JointDepthFilterOptions{}, DepthPrior{},
                                                 range);
     }},
    {"JointDepthFilterOfEverything",
     [](const DepthRange& range) {
       return std::make_unique<JointDepthFilter>(kCapacity, everything(), DepthPrior{}, range);
     }},
    {"SharedErrorFilter",
     [](const DepthRange& range) {
       return std::make_unique<SharedErrorFilter>(kCapacity, SharedErrorFilterOptions{},
                                                  DepthPrior{}, range);
     }},
    {"SharedErrorFilterOfFewPlaces",
     [](const DepthRange& range) {
       SharedErrorFilterOptions options;
       options.places = 3;
       return std::make_unique<SharedErrorFilter>(kCapacity, options, DepthPrior{}, range);
     }},
    {"SharedErrorFilterOfEachPoint",
     [](const DepthRange& range) {
       SharedErrorFilterOptions options;
       options.errors = ErrorProfile::poses();
       return std::make_unique<SeparatePoints>(SharedErrorFilter(1, options, DepthPrior{}, range),
                                               kCapacity, DepthPrior{});
     }},
    {"InverseDepthFilterOfEachPoint",
     [](const DepthRange& range) {
       return std::make_unique<PointwiseEstimator>(InverseDepthFilter({}, range), kCapacity,
                                                   DepthPrior{}, range);
     }},
    {"NonlinearDepthObserverOfEachPoint",
     [](const DepthRange& range) {
       return std::make_unique<PointwiseEstimator>(NonlinearDepthObserver({}, range), kCapacity,
                                                   DepthPrior{}, range);
     }},
    {"ObjectDepthObserver", [](const DepthRange& range) {
       return std::make_unique<ObjectDepthObserver>(kCapacity, NonlinearDepthObserver::Options{},
                                                    DepthPrior{}, range);
     }}};

class PointSetEstimatorContract : public ::testing::TestWithParam<Method> {};

INSTANTIATE_TEST_SUITE_P(Methods, PointSetEstimatorContract, ::testing::ValuesIn(kMethods),
                         [](const auto& method) { return method.param.name; });

TEST_P(PointSetEstimatorContract, estimatesAreFiniteAndInRangeWhateverComesIn) {
  const DepthRange range{.1, 50};
  Random random(1);
  std::vector<PointObservation> seen;
  for (int inputs = 0; inputs < test::kRandomInputs;) {
    const auto points = GetParam().make(range);
    MotionBuffer odometry(64);
    double time_s = 0;
    for (int image = 0; image < 200; ++image) {
      time_s += random.uniform(.01, .1);
      odometry.push(time_s, garbageTwist(random));
      points->advance(odometry, random.integer(0, 30) == 0 ? garbage(random) : time_s);
      seen.clear();
      for (int id = 0; id < static_cast<int>(kCapacity) + 2; ++id) {
        if (random.integer(0, 2) > 0) seen.push_back({id, garbageMeasurement(random)});
      }
      points->correct(seen);
      inputs += 1 + static_cast<int>(seen.size());
      if (random.integer(0, 5) == 0) {
        points->correctDepth(random.integer(0, 11), garbagePrior(random));
      }
      if (random.integer(0, 20) == 0) points->setPrior(random.integer(0, 9), garbagePrior(random));
      if (random.integer(0, 50) == 0) points->retire(random.integer(0, 11));
      for (int id = 0; id < static_cast<int>(kCapacity); ++id) {
        ASSERT_TRUE(isSane(points->estimate(id), range)) << "image " << image << ", point " << id;
      }
    }
  }
}

}  // namespace
}  // namespace depthservo
