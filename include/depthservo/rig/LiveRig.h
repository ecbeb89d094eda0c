#pragma once

#include <memory>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/rig/observe.h"
#include "depthservo/sequence/TwistSource.h"
#include "depthservo/sequence/VideoSource.h"

namespace depthservo {

struct LiveOptions {
  std::string name = "live";
  PinholeCamera camera;
  SequenceTarget target;           ///< dots, AprilTags; none: natural corners
  std::string targetFile;          ///< that named it, for messages; may be empty
  ObservationOptions observation;  ///< tracker, estimator, first guess, noise; motion plays no part
  double rate = 0;                 ///< images per second, 0: not known; for the gain of `pose` [Hz]
  double duration_s = 0;           ///< stop after this time of the images' clock; 0: at their end
  Keep keep = Keep::everything;

  /// Twists that the robot cannot have are left out: greater than these, 0: any [m/s, rad/s].
  double most_v = 0, most_w = 0;

  /// How long an image waits for the twists of its time [s]: as long as they are late the first
  /// time, then no more until they come again.
  double patience_s = 0.2;
};

/// A camera or a video, and a stream of twists. Nothing waits for ever: late odometry makes points
/// coast, what is refused is counted and told in events, and the end of the images is the regular
/// end.
///
/// The same images, times and twists give the same estimates as a replay.
class DEPTHSERVO_API LiveRig : public Rig {
 public:
  /// \param twists null: the motion is that of the target, which needs four points. Both outlive
  /// the rig. \throw InputError no motion
  LiveRig(const LiveOptions& options, ImageSource& images, TwistSource* twists);
  ~LiveRig() override;

  /// What to observe with: the motion chosen.
  const ObservationOptions& options() const;

  const ObservedSource& source() const override;
  /// \throw InputError an image of another size than the camera's
  std::optional<Exposure> next(Listener* listener) override;
  void readOdometry(MotionBuffer& odometry, double time_s) override;
  const std::vector<OdometryRow>& odometry() const override;
  double time() const override;
  std::string whyEnded() const override;

  /// Whether the source has no more images, so that the rig ended against its will.
  bool haveImagesEnded() const;

  /// Takes the twists that have come. Whether there are enough to know how long one holds.
  bool hasOdometry();

  /// Time of the newest twist that could be used [s]; NaN: there is none.
  double newestTwist_s() const;

  /// None when the target tells the motion.
  const TwistSource::Counts* twists() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Observes depth while images come. \param watcher may be null \throw InputError there is nothing
/// to track, no motion, not what the estimator needs, no image at all, or one of another size than
/// the camera's
DEPTHSERVO_API RunLog live(const LiveOptions& options, ImageSource& images, TwistSource* twists,
                           RunWatcher* watcher = nullptr);

}  // namespace depthservo
