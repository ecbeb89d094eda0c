#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimator.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo {

/// Lifts a DepthEstimator to a set of points: one independent copy for each.
class DEPTHSERVO_API PointwiseEstimator : public PointSetEstimator {
 public:
  /// \param prototype copied for every point
  /// \param capacity greatest number of points
  /// \param prior for points without one of their own
  PointwiseEstimator(const DepthEstimator& prototype, std::size_t capacity,
                     const DepthPrior& prior = {}, const DepthRange& range = {});
  PointwiseEstimator(const PointwiseEstimator& other);
  PointwiseEstimator& operator=(const PointwiseEstimator&) = delete;

  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  bool retire(int id) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  using PointSetEstimator::estimate;
  DepthEstimate estimate(int id) const override;
  double time() const override { return time_s_; }
  const DepthRange& range() const override { return range_; }

  /// Observations ignored because the capacity was used up.
  std::size_t ignored() const { return ignored_; }

 private:
  struct Slot {
    int id = 0;
    bool started = false;  // has been measured since the last (re)start
    DepthPrior prior;
    std::unique_ptr<DepthEstimator> estimator;
  };
  Slot* find(int id);
  const Slot* find(int id) const;
  Slot* findOrAdd(int id);

  std::vector<Slot> slots_;  // [0, size_) are in use
  std::size_t size_ = 0, ignored_ = 0;
  DepthPrior prior_;
  DepthRange range_;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace depthservo
