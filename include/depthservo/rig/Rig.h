#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/motion/Velocities.h"
#include "depthservo/observation/Exposure.h"
#include "depthservo/observation/ObservedSource.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/robots/RobotModel.h"

namespace depthservo {

/// A robot with a camera, as the loop sees it: simulated, recorded or real.
class DEPTHSERVO_API Rig {
 public:
  /// Hears what happens between two images.
  class Listener {
   public:
    virtual ~Listener() = default;
    /// A row of odometry begins: a law that commands at this rate does it now.
    virtual void onRow(double /*time_s*/) {}
    /// An image is taken, though it may come late or get lost; what is true then, where it is
    /// known. False: the run is over.
    virtual bool onExposure(double /*time_s*/, const std::vector<TruePoint>& /*truth*/) {
      return true;
    }
  };

  virtual ~Rig() = default;

  /// What images and odometry are of.
  virtual const ObservedSource& source() const = 0;

  /// Waits for the next image that arrives; none: it was the last. \param listener may be null
  virtual std::optional<Exposure> next(Listener* listener = nullptr) = 0;

  /// Takes an exposure that is no longer needed, to use its memory again.
  virtual void giveBack(Exposure /*exposure*/) {}

  /// Adds the rows that are known by now and matter for an image of this time [s].
  virtual void readOdometry(MotionBuffer& odometry, double time_s) = 0;

  /// All rows handed over so far; of a run without end at least those of the last image.
  virtual const std::vector<OdometryRow>& odometry() const = 0;

  /// Velocities that the robot shall have from now on. A recorded one ignores them.
  virtual void command(const Velocities& /*velocities*/) {}

  /// What was observed in an image, before the command that follows from it.
  virtual void onObserved(const FrameRecord& /*frame*/) {}

  /// Whether the robot does not follow the commands now, so that nothing can be said of their
  /// success: it is not armed, or safety stops it.
  virtual bool isHeld() const { return false; }

  /// The robot that is commanded; null where nobody commands.
  virtual const RobotModel* robot() const { return nullptr; }

  /// Whether the target moves, now or later: a goal that is reached may be left again.
  virtual bool isTargetMoving() const { return false; }

  /// Adds to a frame what only the rig knows: where the robot is, its velocities.
  virtual void describe(FrameRecord& /*frame*/) const {}

  /// Time of the rig's clock, which is that of the images [s]: later than the last image where they
  /// arrive late.
  virtual double time() const = 0;

  /// Why there were no more images; a sentence.
  virtual std::string whyEnded() const { return "the images have ended"; }

  /// What happened since the last call.
  [[nodiscard]] std::vector<Event> takeEvents() { return std::exchange(events_, {}); }

 protected:
  void note(double time_s, std::string what) { events_.push_back({time_s, std::move(what)}); }

 private:
  std::vector<Event> events_;
};

}  // namespace depthservo
