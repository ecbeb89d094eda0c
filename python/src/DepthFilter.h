#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "binding.h"
#include "depthservo/depth/InverseDepthFilterBatch.h"
#include "depthservo/depth/PointSetEstimator.h"

namespace depthservo::python {

/// A fixed number of points that any estimator observes, in arrays.
class PointEngine {
 public:
  virtual ~PointEngine() = default;
  virtual void setPrior(std::size_t i, const DepthPrior& prior) = 0;
  virtual Coverage advance(const MotionBuffer& odometry, double time_s) = 0;
  /// \param xy size() rows, NaN where a point is hidden
  virtual void correct(const double* xy, double sigma) = 0;
  virtual void correctDepth(std::size_t i, const DepthPrior& measured) = 0;
  virtual DepthEstimate estimate(std::size_t i) const = 0;
  virtual double time() const = 0;
  virtual const PointSetEstimator* estimator() const { return nullptr; }
};

/// By InverseDepthFilterBatch.
class BatchEngine : public PointEngine {
 public:
  BatchEngine(std::size_t size, const InverseDepthFilterOptions& options, const DepthPrior& prior,
              const DepthRange& range);

  void setPrior(std::size_t i, const DepthPrior& prior) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const double* xy, double sigma) override;
  void correctDepth(std::size_t i, const DepthPrior& measured) override;
  DepthEstimate estimate(std::size_t i) const override;
  double time() const override { return time_s_; }

 private:
  void startAnew();

  InverseDepthFilterBatch filter_;
  std::vector<DepthPrior> priors_;
  std::vector<char> isStarted_;
  std::size_t waiting_;  // points that have not started
  std::vector<double> x_, y_, sigma_;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();
};

/// By an estimator of a set of points, whose ids are 0, 1, ...
class SetEngine : public PointEngine {
 public:
  SetEngine(std::size_t size, std::unique_ptr<PointSetEstimator> estimator);

  void setPrior(std::size_t i, const DepthPrior& prior) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const double* xy, double sigma) override;
  void correctDepth(std::size_t i, const DepthPrior& measured) override;
  DepthEstimate estimate(std::size_t i) const override;
  double time() const override { return estimator_->time(); }
  const PointSetEstimator* estimator() const override { return estimator_.get(); }

 private:
  std::size_t size_;
  std::unique_ptr<PointSetEstimator> estimator_;
  std::vector<PointObservation> observations_;
};

/// Estimates as arrays; `shape` is that of z, xy has one more axis.
struct Estimates {
  Array xy, z, sigma_z, z_low, z_high, excitation;
  py::array_t<std::uint8_t> status;

  explicit Estimates(const std::vector<py::ssize_t>& shape);

  /// Where to write, without the interpreter.
  struct Rows {
    double *xy, *z, *sigma_z, *z_low, *z_high, *excitation;
    std::uint8_t* status;

    void set(std::size_t i, const DepthEstimate& estimate) const;
  };
  Rows rows();
};

}  // namespace depthservo::python
