#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "depthservo/motion/OdometryRow.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/scenario/Scenario.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// What a run shows to whoever watches it (a window, a recorder, a progress bar), image by image.
struct RunFrame {
  const FrameRecord& record;
  const DEPTHSERVO_VISP vpImage<unsigned char>* image;  ///< none when the scenario has no images
  const RunLog& log;                                    ///< up to and including this frame
  const std::vector<OdometryRow>& odometry;             ///< all rows so far
  Eigen::Isometry3d wMc;                                ///< true pose of the camera at exposure
};

class RunWatcher {
 public:
  virtual ~RunWatcher() = default;
  virtual void onFrame(const RunFrame& frame) = 0;
};

/// Runs a scenario: image in, command out, until the robot is at its goal or the outcome is
/// another.
///
/// Every image: track the points, observe their depths with the odometry since the last one, let
/// the control law compute the command, drive. What can go wrong becomes a safe command and an
/// outcome:
/// - points are hidden, or out of the image: their features are predicted and the servo goes on;
/// when one is predicted too vaguely the robot slows down to a stop and waits for it, at last in
/// vain: `lost`, or `left-image` if it is not in the image;
/// - a feature is lost: the command ramps to zero; after a second the run ends, `lost`;
/// - fewer than three dots are in the image for two seconds: `left-image`;
/// - the command is not finite: the robot stops, `diverged`;
/// - the camera comes closer than Z_min: `collision`;
/// - the robot has all but stopped and the image error, still too large, does not shrink:
/// `stalled`.
class ServoLoop {
 public:
  explicit ServoLoop(const Scenario& scenario);
  ~ServoLoop();

  /// The whole run; call once. Never throws for what happens in the loop. \param watcher may be
  /// null
  RunLog run(RunWatcher* watcher = nullptr);

  /// Where the dots are in the first image; the tracker starts there.
  std::vector<PixelPoint> starts() const;

 private:
  struct Exposure;
  void drive(double until_s);
  void readOdometry();
  void look(double time_s);
  FrameRecord process(const Exposure& exposure);
  void observe(const Exposure& exposure, FrameRecord& record);
  Eigen::VectorXd control(FrameRecord& record);
  void noteState(double time_s);
  double wantedSpeed() const;  // share of the full command that hidden points allow
  void setBasis(double time_s, double wanted);
  double imageError() const;  // [px]
  void keep(const DEPTHSERVO_VISP vpImage<unsigned char>& image);
  void note(double time_s, const std::string& what);

  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace depthservo
