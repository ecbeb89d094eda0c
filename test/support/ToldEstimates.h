#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo::test {

/// Of the points 0..n-1, as a test says they are.
class ToldEstimates : public PointSetEstimator {
 public:
  explicit ToldEstimates(std::vector<DepthEstimate> all) : estimates(std::move(all)) {}

  std::unique_ptr<PointSetEstimator> clone() const override {
    return std::make_unique<ToldEstimates>(*this);
  }
  void reset() override {}
  bool setPrior(int, const DepthPrior&) override { return true; }
  Coverage advance(const MotionBuffer&, double) override { return Coverage::complete; }
  void correct(const std::vector<PointObservation>&) override {}
  void correctDepth(int, const DepthPrior&) override {}
  using PointSetEstimator::estimate;
  DepthEstimate estimate(int id) const override { return estimates[static_cast<std::size_t>(id)]; }
  double time() const override { return 0; }
  const DepthRange& range() const override { return range_; }

  std::vector<DepthEstimate> estimates;

 private:
  DepthRange range_;
};

}  // namespace depthservo::test
