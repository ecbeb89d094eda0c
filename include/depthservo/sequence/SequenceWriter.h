#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Geometry>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/motion/Twist.h"
#include "depthservo/motion/Velocities.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/target/DotTarget.h"
#include "depthservo/text/NewFolder.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// The time as a file holds it: rounded to 9 decimals. A run that uses such times is replayed
/// exactly.
DEPTHSERVO_API double fileTime(double time_s);

/// What a sequence says of itself.
struct SequenceSettings {
  std::string name;
  PinholeCamera camera;
  DotTarget target;              ///< no points: unknown
  std::vector<PixelPoint> dots;  ///< start positions, ids 0, 1, ... in this order; may be empty
  std::string replay;            ///< keys of the section `replay`, YAML; may be empty
  std::optional<AprilTagTarget> tags = {};         ///< instead of the target
  RowMeaning rows = RowMeaning::hold;              ///< of the odometry
  std::shared_ptr<const TaughtImage> taught = {};  ///< goes into a folder of its own
  std::vector<PixelPoint> goal = {};               ///< of a law whose commands are kept
  std::vector<double> goalZ = {};                  ///< by point [m]
  std::optional<BoardTarget> board = {};           ///< instead of the target
  std::string robot = {};                          ///< robot.yaml, for the same law; may be empty
};

/// What a law commanded after an image.
struct LawCommand {
  double time_s = 0;      ///< of the image
  double at_s = 0;        ///< by the clock of the images: later where they come late [s]
  std::size_t rows = 0;   ///< of odometry that were known then
  Velocities velocities;  ///< n, finite
};

/// Lines of commands.csv. \param velocityNames "v [m/s]"
DEPTHSERVO_API std::string lawCommandHeader(const std::vector<std::string>& velocityNames);
DEPTHSERVO_API std::string lawCommandLine(const LawCommand& command);
/// \throw InputError it is not there, or not of this many velocities
DEPTHSERVO_API std::vector<LawCommand> readLawCommands(
    const std::string& file, const std::vector<std::string>& velocityNames);

/// Writes a folder that Sequence reads: times with 9 decimals, values with the digits (up to 17)
/// that bring every double back exactly, images as PNG.
///
/// Everything goes to a hidden folder beside the target, which `finish` renames; without `finish`
/// the destructor removes it; so it does after Ctrl-C or a plain kill, when adding an image or a
/// pose throws Interrupted. Files without rows are not written. All members throw InputError when
/// the folder exists or cannot be written.
class DEPTHSERVO_API SequenceWriter {
 public:
  explicit SequenceWriter(const std::string& folder);
  ~SequenceWriter();
  SequenceWriter(const SequenceWriter&) = delete;
  SequenceWriter& operator=(const SequenceWriter&) = delete;

  void addImage(double time_s, const DEPTHSERVO_VISP vpImage<unsigned char>& image);
  void addTrack(double time_s, const PixelPoint& point);
  void addTruth(double time_s, const TrueDepth& depth);
  void addOdometry(double time_s, const Twist& twist);
  void addPose(double time_s, const Eigen::Isometry3d& wMc);
  void addCommand(const LawCommand& command, const std::vector<std::string>& velocityNames);

  /// Writes camera.yaml and sequence.yaml and makes the folder appear.
  void finish(const SequenceSettings& settings);

 private:
  std::ofstream& file(const std::string& name, const std::string& header);
  void check(const std::ofstream& out, const std::string& name) const;
  void writeBelow(const SequenceSettings& settings) const;

  std::string folder_;
  NewFolder made_;
  std::map<std::string, std::ofstream> files_;
  std::size_t images_ = 0;
};

}  // namespace depthservo
