// What the loop does and does not do between an image and its command, with the errors of a typical
// robot: the joint filter of 8 points and each on its own, four FeaturePoint, a FeaturePointGroup,
// the safety of a command; ViSP's own control law of four points beside it.
//   bench_realtime [IMAGES]    10^6 by default; prints a table; exit code 1 if anything allocated,
//                              locked, threw, read or wrote
#include <dlfcn.h>
#include <pthread.h>
#include <sys/resource.h>
#include <visp3/vs/vpServo.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "depthservo/depth/SeparatePoints.h"
#include "depthservo/depth/SharedErrorFilter.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/servo/Safety.h"
#include "depthservo/visp/using.h"
#include "support/AllocationCounter.h"

namespace {

std::size_t locks = 0, throws = 0;

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// This program's own come before those of libc and libstdc++, for every library.
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_lock");
  ++locks;
  return real(mutex);
}

extern "C" void __cxa_throw(void* thrown, void* type, void (*destroy)(void*)) {
  using Throw = void (*)(void*, void*, void (*)(void*));
  static const auto real = next<Throw>("__cxa_throw");
  ++throws;
  real(thrown, type, destroy);
  std::abort();  // it does not return
}

namespace depthservo {
namespace {

constexpr double kDt = 1. / 30;
constexpr int kTour = 256;  // images, there and back

/// Reads and writes of this process so far, by the kernel's count.
std::size_t readsAndWrites() {
  std::ifstream file("/proc/self/io");
  std::string name;
  std::size_t value = 0, sum = 0;
  while (file >> name >> value) {
    if (name == "syscr:" || name == "syscw:") sum += value;
  }
  return sum;
}

/// What a part of the loop did besides computing.
struct Counts {
  std::size_t allocations = test::allocations(), locked = locks, thrown = throws;

  Counts since(const Counts& before) const {
    Counts all = *this;
    all.allocations -= before.allocations;
    all.locked -= before.locked;
    all.thrown -= before.thrown;
    return all;
  }
  bool isNone() const { return allocations + locked + thrown == 0; }
};

/// A camera that goes to and fro before eight points; what is seen of it, with some noise.
struct Tour {
  std::vector<Twist> twist;
  std::vector<vpColVector> velocity;
  std::vector<std::array<PointState, 8>> points;

  Tour() {
    std::array<PointState, 8> at;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double side = i < 4 ? .1 : .2, angle = (static_cast<double>(i) + .5) * M_PI / 2;
      at[i] = {side * std::cos(angle), side * std::sin(angle), i < 4 ? 1. : .8};
    }
    for (int k = 0; k < kTour; ++k) {
      const double t = (k < kTour / 2 ? k : kTour - 1 - k) * kDt, sign = k < kTour / 2 ? 1 : -1;
      const Twist u{Eigen::Vector3d(.1 * std::cos(t), .05, .05 * std::sin(t)) * sign,
                    Eigen::Vector3d(.02, -.03, .1 * std::cos(t)) * sign};
      twist.push_back(u);
      vpColVector v(6);
      for (unsigned j = 0; j < 3; ++j) {
        v[j] = u.linear[j];
        v[j + 3] = u.angular[j];
      }
      velocity.push_back(v);
      for (PointState& p : at) p = flow(Motion::fromTwist(u, kDt), p).point;
      points.push_back(at);
    }
  }
  static double noise(long image, std::size_t point) {  // of a sixth of a pixel at 600 px
    return 3e-4 * std::sin(12.9898 * static_cast<double>(image % 9973) +
                           78.233 * static_cast<double>(point));
  }
};

/// How long something took, image by image.
class Times {
 public:
  explicit Times(std::string name) : name_(std::move(name)) { all_.reserve(1 << 20); }

  template <typename Work>
  void take(const Work& work) {
    const Counts before;
    const auto begin = std::chrono::steady_clock::now();
    work();
    const auto end = std::chrono::steady_clock::now();
    const Counts did = Counts().since(before);
    counts_.allocations += did.allocations;
    counts_.locked += did.locked;
    counts_.thrown += did.thrown;
    if (all_.size() == all_.capacity()) return;  // a longer run is counted, not timed
    all_.push_back(std::chrono::duration<float, std::micro>(end - begin).count());
  }
  void print() {
    std::sort(all_.begin(), all_.end());
    const auto at = [&](double share) {
      return all_[static_cast<std::size_t>(share * static_cast<double>(all_.size() - 1))];
    };
    std::printf("%-46s %8.2f %8.2f %8.1f %12zu %6zu %6zu\n", name_.c_str(), at(.5), at(.999), at(1),
                counts_.allocations, counts_.locked, counts_.thrown);
  }
  bool didNothingElse() const { return counts_.isNone(); }

 private:
  std::string name_;
  std::vector<float> all_;  // [us]
  Counts counts_{0, 0, 0};
};

/// The estimator of a set of points, image by image.
void observe(PointSetEstimator& estimator, const MotionBuffer& odometry, double time_s,
             const std::vector<PointObservation>& seen, double& sum) {
  estimator.advance(odometry, time_s);
  estimator.correct(seen);
  for (const PointObservation& point : seen) sum += estimator.estimate(point.id).Z();
}

int run(long images) {
  const Tour tour;
  MotionBuffer odometry(256, kDt);
  SharedErrorFilter joint(8, {});
  SeparatePoints separate(SharedErrorFilter(1, {}), 8, {});
  std::vector<FeaturePoint> s(4);
  FeaturePointGroup group(SharedErrorFilter(4, {}), 4);
  for (FeaturePoint& point : s) point.setErrors(ErrorProfile::typical());
  std::vector<vpFeaturePoint> desired(4);
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(0.5);
  for (std::size_t i = 0; i < 4; ++i) {
    desired[i].buildFrom(tour.points[0][i].x, tour.points[0][i].y, 1);
    s[i].buildFrom(tour.points[0][i].x, tour.points[0][i].y, 2);
    task.addFeature(s[i], desired[i]);
  }
  SafetyLimits limits;
  limits.velocity = limits.acceleration = limits.braking = Eigen::Vector3d(0.5, 0.5, 1);
  Safety safety(limits, {});
  safety.arm();
  Velocities wanted = Eigen::Vector3d(0.4, -0.2, 0.3);
  SafetyInput now;
  std::vector<PointObservation> seen(8);

  Times byJoint("joint filter, 8 points"), bySeparate("filter, 8 points"),
      byFeatures("observe of 4 FeaturePoint"), byGroup("observe of a FeaturePointGroup of 4"),
      bySafety("safety of a command"), byLaw("ViSP's computeControlLaw, 4 points");
  double sum = 0;
  const std::size_t ioFirst = readsAndWrites(), ioBefore = readsAndWrites();
  for (long k = 0; k < images; ++k) {
    const auto place = static_cast<std::size_t>(k % kTour);
    const double time_s = static_cast<double>(k) * kDt;
    for (std::size_t i = 0; i < 8; ++i) {
      const PointState& p = tour.points[place][i];
      seen[i] = {static_cast<int>(i), {p.x + Tour::noise(k, i), p.y + Tour::noise(k, i + 8), 3e-4}};
    }
    byJoint.take([&] {
      odometry.push(time_s, tour.twist[place]);
      observe(joint, odometry, time_s, seen, sum);
    });
    bySeparate.take([&] { observe(separate, odometry, time_s, seen, sum); });
    byFeatures.take([&] {
      for (std::size_t i = 0; i < 4; ++i) {
        s[i].set_x(seen[i].measurement.x);
        s[i].set_y(seen[i].measurement.y);
        s[i].observe(tour.velocity[place], kDt);
      }
    });
    byGroup.take([&] {
      for (int i = 0; i < 4; ++i) {
        group[i].set_x(seen[static_cast<std::size_t>(i)].measurement.x);
        group[i].set_y(seen[static_cast<std::size_t>(i)].measurement.y);
      }
      group.observe(tour.velocity[place], kDt);
    });
    byLaw.take([&] { sum += task.computeControlLaw()[0]; });
    bySafety.take([&] {
      now.time_s = time_s;
      now.imageAge_s = k % 100 < 10 ? 1 : 0;
      wanted[0] = 0.4 * std::sin(time_s);
      sum += safety.step(now, wanted)[0];
    });
  }
  const std::size_t ioOfReading = ioBefore - ioFirst;
  const std::size_t io = readsAndWrites() - ioBefore - ioOfReading;
  std::printf("%ld images [us]%32s %8s %8s %8s %12s %6s %6s\n", images, "", "median", "99.9 %",
              "most", "allocations", "locks", "throws");
  bool isClean = true;
  for (Times* part : {&byJoint, &bySeparate, &byFeatures, &byGroup, &bySafety}) {
    part->print();
    isClean &= part->didNothingElse();
  }
  byLaw.print();
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  std::printf("reads and writes of the whole loop: %zu; it waited %ld times; %s\n", io,
              usage.ru_nvcsw, std::isfinite(sum) ? "all finite" : "NOT FINITE");
  return isClean && io == 0 && std::isfinite(sum) ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace depthservo

int main(int argc, char** argv) { return depthservo::run(argc > 1 ? std::atol(argv[1]) : 1000000); }
