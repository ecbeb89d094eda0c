#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/rig/DurationHistogram.h"
#include "depthservo/rig/LiveRig.h"
#include "depthservo/robots/RobotOptions.h"
#include "depthservo/sequence/CommandStream.h"
#include "depthservo/servo/Safety.h"

namespace depthservo {

struct RobotRigOptions {
  std::string command;          ///< where commands go: see CommandWriter
  CommandSink* sink = nullptr;  ///< where they go instead; outlives the rig
  RobotOptions robot;
  SafetyOptions safety;
  double rate = 50;    ///< commands per second between images [Hz]
  double ttl = 0.2;    ///< time to live of a command [s]
  double find_s = 10;  ///< an armed robot waits so long for all points of its goal
  /// One command per image, by the images' clock: deterministic. Else a thread of its own commands
  /// in real time.
  bool isLockstep = false;
  const std::atomic<bool>* arm = nullptr;   ///< once it is true the robot is armed; null: it is
  const std::atomic<bool>* stop = nullptr;  ///< once it is true the run ends; may be null
};

/// How long things took, and what happened to images.
struct RobotRigCounts {
  std::size_t images = 0;
  std::size_t empty = 0, frozen = 0;  ///< left out: black, or of one shade; the one before again
  std::size_t commands = 0, unwritten = 0;
  /// From the time of an image to its command, where images carry the system's clock.
  DurationHistogram latency;
};

/// A real robot: a LiveRig whose commands go through Safety to a CommandWriter.
///
/// A thread of its own steps Safety `rate` times per second, whatever the loop waits for. It writes
/// the command at once when the loop has one. Images that show nothing, or the one before again
/// while the robot has moved, are no images. When the run is over the robot brakes, and zero is
/// commanded last.
class DEPTHSERVO_API RobotRig : public Rig {
 public:
  /// What a camera on this robot can do at most, with a margin: beyond it odometry is wrong.
  struct CameraSpeed {
    double v, w;  ///< [m/s, rad/s]
  };
  static CameraSpeed greatestCameraSpeed(const RobotOptions& robot);

  /// \param camera outlives the rig \throw InputError nothing can be written to `command`
  RobotRig(LiveRig& camera, const RobotRigOptions& options);
  ~RobotRig() override;

  const ObservedSource& source() const override;
  std::optional<Exposure> next(Listener* listener) override;
  void readOdometry(MotionBuffer& odometry, double time_s) override;
  const std::vector<OdometryRow>& odometry() const override;
  void command(const Velocities& velocities) override;
  const RobotModel* robot() const override;
  void describe(FrameRecord& frame) const override;
  void onObserved(const FrameRecord& frame) override;
  bool isHeld() const override;
  double time() const override;
  std::string whyEnded() const override;

  /// Brakes, commands zero and ends the thread. \rtsafe not: it waits until the robot should stand
  void finish();

  /// Why safety ended the run; none: it did not.
  SafetyReason endedBy() const;
  /// Why the robot is held now.
  SafetyReason reason() const;
  /// What the law asks for, within the limits of velocity, whatever is done about it.
  Velocities wanted() const;
  const RobotRigCounts& counts() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
