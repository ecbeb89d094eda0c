#pragma once

#include <visp3/core/vpImage.h>

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/motion/OdometryRow.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/tracking/PointTracker.h"
#include "depthservo/tracking/TargetPose.h"
#include "depthservo/visp/visp.h"
#include "observation/FrameRateMonitor.h"
#include "observation/SelfDiagnosis.h"
#include "observation/TagSizeMonitor.h"
#include "observation/makeEstimator.h"

namespace depthservo {

/// What replay and live have in common: image by image, points are found and their depths observed
/// with the odometry at hand.
class ImageObserver {
 public:
  struct Parts {
    PinholeCamera camera;
    double pixelNoise_px = 0.5;       ///< 1 sigma per axis told to the estimator
    bool takesTrackersNoise = false;  ///< the tracker's sigma of each point instead
    std::vector<int> ids;             ///< every id that may be found, ascending
    /// Greatest number of points at once where the tracker chooses them and their ids come and go;
    /// 0: as many as ids.
    std::size_t capacity = 0;
    std::optional<AprilTagTarget> tags;  ///< whose sizes are compared with the observed depths
    DepthPrior prior;                    ///< of every point
    EstimatorSetup estimator;
    OdometryNoise declaredNoise;            ///< of the odometry, for the diagnosis
    std::unique_ptr<PointTracker> tracker;  ///< none: points come with the input
    std::optional<DotTarget> followed;      ///< its pose tells how the camera moves; none: rows do
    std::size_t odometryCapacity = 1024;    ///< rows kept
  };

  /// One instant; pointers may be null where there is nothing.
  struct Input {
    double time_s = 0;
    const DEPTHSERVO_VISP vpImage<unsigned char>* image = nullptr;
    const std::vector<PixelPoint>* tracks = nullptr;
    const std::vector<TrueDepth>* truth = nullptr;
    const DepthMap* depth = nullptr;
    bool isMotionKnown = true;  ///< false: nothing is learnt from this image
  };

  explicit ImageObserver(Parts parts);

  /// A row that is known now. Rows are used in this order, once an image needs them.
  void offer(const OdometryRow& row) { waiting_.push_back(row); }

  /// Whether more rows would not change what is known of the motion up to this time [s].
  bool isCoveredBeyond(double time_s) const {
    return !waiting_.empty() && waiting_.back().time_s >= time_s;
  }
  /// Whether the rows at hand hold until this time [s].
  bool isCovered(double time_s);

  FrameRecord observe(const Input& input);

  /// What happened since the last call.
  std::vector<Event> takeEvents() { return std::exchange(events_, {}); }

  /// Adds what is known at the end: odometry used, diagnosis, states of the joint filter, frame
  /// rate.
  void finish(RunLog& log);

 private:
  void readOdometry(double time_s);
  std::vector<TrackedPoint> track(const Input& input);
  std::optional<TargetPose::Result> followTarget(double time_s,
                                                 const std::vector<TrackedPoint>& points);
  void addOdometry(const OdometryRow& row);
  void correct(double time_s, const std::vector<TrackedPoint>& points);
  double trueDepth(const Input& input, const FeatureRecord& feature,
                   const std::optional<TargetPose::Result>& pose) const;
  void renewPoints(const std::vector<TrackedPoint>& points);
  void giveUpMovingPoints();
  void noteCoverage(double time_s, Coverage coverage);

  Parts parts_;
  std::unique_ptr<PointSetEstimator> estimator_;
  FrameRateMonitor frameRate_;
  std::optional<SelfDiagnosis> diagnosis_;  // none where images would be judged by themselves,
                                            // nor of a known target, which may move
  std::optional<TagSizeMonitor> tags_;
  std::map<int, int> rejections_;                        // by id, weighted, less those accepted
  std::vector<double> trackingTimes_, estimationTimes_;  // by image [s]
  std::optional<TargetPose> targetPose_;
  std::optional<CameraPose> lastPose_;
  std::deque<OdometryRow> waiting_;
  MotionBuffer odometry_;
  std::vector<OdometryRow> used_;  // all rows so far
  std::vector<PointObservation> observations_;
  Coverage coverage_ = Coverage::complete;
  double lastTime_s_ = kUnknown;
  std::vector<Event> events_;
};

}  // namespace depthservo
