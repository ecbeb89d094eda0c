#pragma once

#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/motion/MotionBuffer.h"

namespace depthservo {

struct MeasurementNoise;

/// A measurement of the point with this id.
struct PointObservation {
  int id = 0;
  PointMeasurement measurement;
};

/// Observes the depths of a set of points seen by one camera.
///
/// Points are known by an id of the caller's choice and appear with their first measurement, up to
/// the capacity chosen at construction; further points are ignored and counted. For each image:
/// `advance` to its exposure time, then `correct` with what was measured in it; a known id that is
/// missing is hidden.
///
/// Contract as for DepthEstimator: after construction nothing allocates, locks, prints or throws,
/// and every estimate is finite.
class DEPTHSERVO_API PointSetEstimator {
 public:
  virtual ~PointSetEstimator() = default;
  virtual std::unique_ptr<PointSetEstimator> clone() const = 0;

  /// Forgets every point and the time.
  virtual void reset() = 0;

  /// Prior for a point, instead of the default given at construction. A point that was measured
  /// before starts anew with its next measurement. False when the capacity is used up.
  virtual bool setPrior(int id, const DepthPrior& prior) = 0;

  /// Forgets a point whose id will not come again; its place is free for another. False for an
  /// unknown id, and where the points are fixed.
  virtual bool retire(int /*id*/) { return false; }

  /// Moves every point to the time of an image [s]. When the odometry does not cover the interval
  /// the answer says why: `hole`, `ended` and `refused` move the time with a motion that is unknown
  /// in part (points coast, sigma grows as MotionBuffer::bounds allow, see `widened`); `afterEnd`
  /// and `reversed` leave everything as it was (this image cannot be used, a later one can);
  /// `beforeStart` and `empty` move the time and start all points anew, keeping their depth as a
  /// guess: how the camera moved will never be known.
  virtual Coverage advance(const MotionBuffer& odometry, double time_s) = 0;

  /// Corrects with the points measured in the image at the time of the last `advance`.
  virtual void correct(const std::vector<PointObservation>& observations) = 0;

  /// Fuses a direct measurement of one depth at the time of the last `advance`. Ignored for an
  /// unknown id.
  virtual void correctDepth(int id, const DepthPrior& measured) = 0;

  /// How large the errors of the next measurements are, as far as the method reckons with other
  /// than white ones. The white noise of a point is told with each of its measurements.
  virtual void setNoise(const MeasurementNoise& /*noise*/) {}

  /// The point at the time of the last `advance`; status `unset` for an unknown id.
  virtual DepthEstimate estimate(int id) const = 0;

  /// The point predicted to a later time, as far as the odometry reaches: it stands still, unless
  /// the method knows better.
  virtual DepthEstimate estimate(int id, const MotionBuffer& odometry, double time_s) const;

  /// Time of the last `advance` [s]; NaN before the first.
  virtual double time() const = 0;

  virtual const DepthRange& range() const = 0;

 protected:
  PointSetEstimator() = default;
  PointSetEstimator(const PointSetEstimator&) = default;
  PointSetEstimator& operator=(const PointSetEstimator&) = default;
};

}  // namespace depthservo
