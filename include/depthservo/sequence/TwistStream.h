#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/RpyPose.h"
#include "depthservo/sequence/TwistSource.h"

namespace depthservo {

namespace detail {
class LineStream;
}

/// Twists of the camera, or of the base that carries it, from a pipe, while they come: lines
/// `timestamp,vx,vy,vz,wx,wy,wz` (m/s and rad/s), a header of these names and comments after '#'
/// allowed.
///
/// Nobody can make it wait longer than it is told to: a pipe without a writer, one that is silent,
/// or one that never ends. A line that is not seven finite numbers, one that its writer left
/// without an end, and one that is not later than the row before are counted and left out.
class DEPTHSERVO_API TwistStream : public TwistSource {
 public:
  /// \param path a named pipe, a file, "-" for standard input, or udp:ADDRESS:PORT to listen at
  /// \param cameraInBase pose of the camera (z forward) in the base whose twists the lines are:
  /// they become those of the camera. None: they are the camera's \throw InputError
  explicit TwistStream(const std::string& path, const std::optional<RpyPose>& cameraInBase = {});
  ~TwistStream() override;
  TwistStream(const TwistStream&) = delete;
  TwistStream& operator=(const TwistStream&) = delete;

  /// At most a megabyte at a time.
  std::vector<OdometryRow> read(double wait_s) override;

  /// At the end of a file, or of a pipe that nobody writes to any more. (It may get a new writer.)
  bool isEnded() const override;

  /// Whether it is a file on disk, no pipe and no socket.
  bool isFile() const override;

  bool wasInterrupted() const override;

  const Counts& counts() const override { return counts_; }

  std::vector<std::string> takeFaults() override { return std::exchange(faults_, {}); }

 private:
  void takeLine(std::string_view line, std::vector<OdometryRow>& rows);
  void note(std::string fault);

  std::unique_ptr<detail::LineStream> lines_;
  std::optional<Eigen::Isometry3d> bMc_;
  double last_s_;
  Counts counts_;
  std::vector<std::string> faults_;
};

}  // namespace depthservo
