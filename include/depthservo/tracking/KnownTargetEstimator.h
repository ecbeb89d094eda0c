#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/pose/VisualMotionObserver.h"

namespace depthservo {

/// Depths of a known target, still or moving: a VisualMotionObserver that finds its own start, and
/// the target again after a loss, from one image (OpenCV's solvePnPGeneric: IPPE for a flat target,
/// SQPNP for any other).
///
/// One image of a flat target often shows two poses equally well, tilted the one way and the other.
/// Both are then followed until the images tell them apart; meanwhile the likelier one is given,
/// and sigma covers the other.
///
///     KnownTargetEstimator estimator(points);
///     FeaturePointGroup s(estimator, points.size());
///
/// Real-time: as PointSetEstimator, except that an image from which the pose is searched anew costs
/// some 25 us and allocates. Nothing throws.
class DEPTHSERVO_API KnownTargetEstimator : public PointSetEstimator {
 public:
  using Options = VisualMotionObserverOptions;

  /// \param points of the target, in its own frame [m]; their indices are the ids
  /// \throws std::invalid_argument fewer than four points, points on one line or not finite
  explicit KnownTargetEstimator(const std::vector<Eigen::Vector3d>& points,
                                const Options& options = {}, const DepthRange& range = {});

  KnownTargetEstimator(const KnownTargetEstimator&) = default;  // no move: nothing is left without its memory
  KnownTargetEstimator& operator=(const KnownTargetEstimator&) = default;

  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  DepthEstimate estimate(int id) const override;
  DepthEstimate estimate(int id, const MotionBuffer& odometry, double time_s) const override;
  double time() const override { return observer_.time(); }
  const DepthRange& range() const override { return observer_.range(); }

  /// The likelier of the two, if there are two.
  const VisualMotionObserver& observer() const { return observer_; }

  /// Whether another pose explains the images as well so far.
  bool isAmbiguous() const { return rival_.has_value(); }

  /// How often a pose was found in one image: 1 after the start.
  int starts() const { return starts_; }

 private:
  void start(const std::vector<PointObservation>& observations);
  void compare(const std::vector<PointObservation>& observations);
  DepthEstimate covering(DepthEstimate likelier, const DepthEstimate& other) const;

  std::vector<Eigen::Vector3d> points_;
  bool isFlat_ = false;
  VisualMotionObserver observer_;
  std::optional<VisualMotionObserver> rival_;
  double evidence_ = 0;  // twice the log likelihood ratio in favour of the observer
  int starts_ = 0;
};

/// Why these points cannot be a known target; empty when they can.
DEPTHSERVO_API std::optional<const char*> whyNoTarget(const std::vector<Eigen::Vector3d>& points);

}  // namespace depthservo
