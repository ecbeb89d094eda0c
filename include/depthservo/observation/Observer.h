#pragma once

#include <memory>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/observation/Exposure.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/observation/ObservedSource.h"
#include "depthservo/observation/RunLog.h"

namespace depthservo {

/// The pipeline: image and odometry in, depths of points out. Every subcommand observes with it.
///
///     Observer observer(rig.source(), options);
///     while (auto exposure = rig.next()) {
///       rig.readOdometry(observer.odometry(), exposure->time_s);
///       FrameRecord frame = observer.observe(*exposure);
///     }
///
/// For each image: the tracker finds the points, where they are expected; the estimator moves to
/// the time of the image with the odometry at hand and is corrected; the monitors compare what was
/// measured with what was declared. Never throws after construction.
class DEPTHSERVO_API Observer {
 public:
  /// \throw InputError the source lacks what the options ask for, or its gains are implausible
  Observer(const ObservedSource& source, const ObservationOptions& options);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Images and odometry are not judged: for who asks for the outcome of many runs. Estimates are
  /// the same; sigma in the records is that of the estimator, the camera's twist and times of
  /// the clock are left out. Before the first image.
  void omitDiagnosis();

  /// The odometry so far; rows are added by whoever has them, in time for their image.
  MotionBuffer& odometry();

  /// \param spare a record that is no longer needed, whose memory is used again
  FrameRecord observe(const Exposure& exposure, FrameRecord spare = {});

  /// As of the last image.
  const PointSetEstimator& estimator() const;
  /// Points that the estimator was corrected with in the last image, normalised; none when it could
  /// not be used.
  const std::vector<PointObservation>& measured() const;
  const std::vector<int>& ids() const;  ///< of all points, ascending

  /// What happened since the last call.
  [[nodiscard]] std::vector<Event> takeEvents();

  /// Adds what is known at the end: diagnosis, states of the joint filter, frame rate, tags, times,
  /// and the odometry where the target told it.
  void finish(RunLog& log);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
