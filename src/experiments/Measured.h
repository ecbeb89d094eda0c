#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/depth/CramerRaoBound.h"
#include "depthservo/motion/OdometryNoise.h"
#include "depthservo/observation/RunLog.h"
#include "observation/makeEstimator.h"

namespace depthservo {

/// An image of a run as every estimator is given it, and the truth.
struct MeasuredFrame {
  double time_s = 0;
  std::vector<PointObservation> observations;
  std::vector<std::size_t> points;       ///< those known in it, as indices of Measured::ids
  std::vector<PointState> truth;         ///< of each of these; chi is NaN when unknown
  std::optional<Eigen::Isometry3d> wMc;  ///< true pose of the camera, if known

  /// The measurement of a point; null: it is hidden.
  const PointMeasurement* measurementOf(int id) const;
  /// Place of a point in `points`, or none.
  std::optional<std::size_t> placeOf(std::size_t point) const;
};

/// What estimators are compared on.
struct Measured {
  std::string name;
  double pixelNoise_px = kUnknown;       ///< if it is the same for all points
  std::vector<int> ids;                  ///< ascending
  std::vector<std::size_t> first, last;  ///< frames that know each point
  bool pointsComeAndGo = false;          ///< some are not known in the last frame any more
  std::vector<MeasuredFrame> frames;
  std::vector<OdometryRow> rows;
  RowMeaning meaning = RowMeaning::hold;  ///< of the rows
  double nominalPeriod_s = 0;
  DepthPrior prior;
  OdometryNoise odometryNoise;
  double odometryScaleSigma = 0;
  std::optional<ErrorProfile> errors;  ///< that the estimators are told
  double focal_px = 600;
  bool isTargetStill = true;
  std::function<EstimatorSetup(EstimatorKind)> setup;

  /// Takes the measurements of a log; true poses are left to the caller.
  void read(const RunLog& log);

  MotionBuffer odometry() const;
  bool hasTruth() const;
  /// Whether a point has been known for a second.
  bool isOld(std::size_t point, std::size_t frame) const;
};

/// By frame, and by point as in MeasuredFrame::points; unknown is NaN.
using PointTable = std::vector<std::vector<double>>;
PointTable unknownTable(const Measured& measured);

/// An estimator that is taken over the frames in turn.
class MeasuredRun {
 public:
  /// \param measured outlives it
  MeasuredRun(const Measured& measured, EstimatorKind kind);

  void advance();  ///< to the next frame, the first at first
  DepthEstimate estimate(std::size_t point) const;

 private:
  void renewPoints(const MeasuredFrame& frame);

  const Measured& measured_;
  MotionBuffer odometry_;
  std::unique_ptr<PointSetEstimator> estimator_;
  std::size_t next_ = 0;
};

}  // namespace depthservo
