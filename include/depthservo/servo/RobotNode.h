#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/rig/LiveRig.h"
#include "depthservo/sequence/PushedSources.h"
#include "depthservo/servo/RobotRig.h"
#include "depthservo/servo/ServoOptions.h"
#include "depthservo/servo/TaughtGoal.h"

namespace depthservo {

struct RobotNodeOptions {
  std::string name = "node";
  /// Pose of the camera (x right, y down, z forward) in the base that the odometry is of.
  Eigen::Isometry3d baseFromCamera = Eigen::Isometry3d::Identity();
  PushedImages::Options images;
  SequenceTarget target;           ///< of `observe`; none: natural corners
  ObservationOptions observation;  ///< with the tracker
  double patience_s = 0.1;         ///< an image waits so long for its odometry [s]
};

/// How a robot is driven to a goal.
struct ServoTask {
  RobotOptions robot;
  SafetyOptions safety;
  ControlOptions control;
  double rate = 50, ttl = 0.2;             ///< see RobotRigOptions
  const std::atomic<bool>* arm = nullptr;  ///< once it is true the robot is armed; null: it is
};

/// What a node tells of itself.
struct NodeStatus {
  std::size_t images = 0, leftOut = 0;     ///< observed; left out for newer ones
  std::size_t rows = 0, refused = 0;       ///< of odometry
  double image_s = kUnknown;               ///< time of the newest image observed
  double odometry_s = kUnknown;            ///< time of the newest row
  std::map<DepthStatus, int> points;       ///< how many have each status
  std::string news;                        ///< the newest event
  SafetyReason held = SafetyReason::none;  ///< why the robot is held
};

/// A node of a robot's middleware without the middleware: messages in by `push`, from any thread,
/// results out to a RunWatcher, commands to a CommandSink. The same pipeline as `live` and `servo`.
///
///     RobotNode node(options);                          // thread of the middleware:
///     RunLog log = node.observe(&publisher);            //   node.setCamera(...), node.push(...)
///
/// `observe` and `servo` run in the thread that calls them, one at a time, until the images end or
/// `stop`. What comes while neither runs is left out; of a playback it waits.
class DEPTHSERVO_API RobotNode {
 public:
  explicit RobotNode(const RobotNodeOptions& options);
  ~RobotNode();

  /// The first one counts; `observe` and `servo` wait for it.
  void setCamera(const PinholeCamera& camera);
  void push(TimedImage image);
  void pushBaseTwist(double time_s, const Twist& base);
  void pushCameraTwist(double time_s, const Twist& camera);
  /// Ends what runs, and what would run later.
  void stop(const std::string& reason);

  /// The newest image as a goal, in a folder that must not exist. \throw InputError there is no
  /// image yet, or nothing in it to steer by
  TaughtGoal teach(const TeachOptions& options, const std::string& folder) const;

  NodeStatus status() const;

  /// \param watcher may be null; called in this thread \throw InputError as `live`
  RunLog observe(RunWatcher* watcher = nullptr);

  /// Drives the robot to a goal; zero is commanded last. \throw InputError
  RunLog servo(const TaughtGoal& goal, const ServoTask& task, CommandSink& commands,
               RunWatcher* watcher = nullptr);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
