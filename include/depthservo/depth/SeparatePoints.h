#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo {

/// Keeps points apart: one estimator of point sets for each, which sees no other.
class DEPTHSERVO_API SeparatePoints : public PointSetEstimator {
 public:
  /// \param prototype copied for every point
  /// \param capacity greatest number of points
  /// \param prior for points without one of their own
  SeparatePoints(const PointSetEstimator& prototype, std::size_t capacity, const DepthPrior& prior);
  SeparatePoints(const SeparatePoints& other);
  SeparatePoints& operator=(const SeparatePoints&) = delete;

  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  bool retire(int id) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  void setNoise(const MeasurementNoise& noise) override;
  using PointSetEstimator::estimate;
  DepthEstimate estimate(int id) const override;
  double time() const override { return time_s_; }
  const DepthRange& range() const override { return slots_.front().estimator->range(); }

 private:
  struct Slot {
    int id = 0;
    bool isSeen = false;  // in this image
    std::unique_ptr<PointSetEstimator> estimator;
  };
  const Slot* find(int id) const;
  Slot* findOrAdd(int id);

  std::vector<Slot> slots_;  // [0, size_) are in use; at least one
  std::size_t size_ = 0;
  DepthPrior prior_;
  MotionBuffer none_{2};
  std::vector<PointObservation> one_;  // room for it
  double time_s_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace depthservo
