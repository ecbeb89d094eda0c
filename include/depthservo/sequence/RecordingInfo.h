#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/sequence/ClockCheck.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// What a recording has of one topic, or in one of its files.
struct RecordedTopic {
  std::string name, type;
  std::string use;           ///< image, camera_info, odometry, poses; empty: none
  std::string content;       ///< encoding of images, names of joints; may be empty
  std::size_t messages = 0;  ///< that can be read
  std::size_t unreadable = 0;
  double rate_hz = 0;          ///< by the median interval; 0: not known
  TimeSpan span;               ///< by stamps, or of reception [s]
  std::vector<TimeSpan> gaps;  ///< longer than four median intervals and 0.04 s
  /// How much later than stamped messages were received; none: no stamps.
  struct Age {
    double median_s = 0, least_s = 0, most_s = 0;
  };
  std::optional<Age> age;
  std::vector<std::string> frames;  ///< that they name
};

/// Where a coordinate frame stands.
struct FrameInfo {
  std::string name, parent;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< in the parent, at first
  bool isStill = true;
};

/// What is in a recording, and what it lacks to be replayed.
struct RecordingInfo {
  std::string path, kind;
  std::uint64_t bytes = 0;  ///< of a bag
  std::vector<RecordedTopic> topics;
  std::vector<FrameInfo> frames;
  std::optional<PinholeCamera> camera;
  std::vector<std::string> notes;  ///< what was left out or assumed, one sentence each
  std::string missing;             ///< why it cannot be replayed; empty: it can
};

/// \param path a bag, or any folder that Sequence opens \throw InputError it is neither
DEPTHSERVO_API RecordingInfo describeRecording(const std::string& path,
                                               const SequenceOptions& options);

}  // namespace depthservo
