#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sequence/bag/Bag.h"
#include "sequence/bag/FrameTree.h"
#include "sequence/bag/messages.h"

namespace depthservo::detail {

/// What a bag has of one topic; pixels stay in the bag.
struct SurveyedTopic {
  struct Message {
    std::int64_t received_ns = 0;
    std::int64_t stamp_ns = 0;  ///< of its header; 0: it has none
    MessagePlace place;
  };

  BagTopic topic;
  std::vector<Message> messages;  ///< those that could be decoded, in the order of the file
  std::vector<Twist> twists{};    ///< one by one with the messages; of velocities
  std::vector<Eigen::Isometry3d> poses{};  ///< likewise; of the topic that is asked for
  std::set<std::string> frames{};          ///< of headers; of velocities: whose they are
  std::string content{};                   ///< encoding of images, names of joints
  std::optional<CameraInfoMessage> info{};
  bool infoChanges = false;
  std::size_t undecoded = 0;
  std::string why{};  ///< of the first that could not be decoded

  /// Whether all headers have a stamp: else the time of reception must do.
  bool isStamped() const;
  double time(std::size_t message) const;  ///< by its stamp, or of reception [s]

  /// The messages by time, one of each; those of a time that is there are left out. \param leftOut
  /// how many \throw BagFault the clock jumped back
  std::vector<std::size_t> inOrder(std::size_t& leftOut) const;
};

/// How much is looked at.
enum class SurveyKind {
  playable,   ///< what a replay may need
  everything  ///< and the times of all other messages
};

/// A bag after going through it once.
struct BagSurvey {
  /// \param poses topic whose poses are kept; empty: none are \throw InputError
  BagSurvey(const std::string& path, SurveyKind kind, const std::string& poses);

  std::string path;
  std::shared_ptr<Bag> bag;
  std::vector<SurveyedTopic> topics;
  FrameTree frames;
  std::vector<std::string> warnings;  ///< of damage
};

/// Seconds of a time since 1970, as the same decimal number in a text would be read.
double secondsOf(std::int64_t time_ns);

}  // namespace depthservo::detail
