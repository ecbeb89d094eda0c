#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/motion/RpyPose.h"
#include "sequence/bag/BagSurvey.h"

namespace depthservo::detail {

/// What `--topics image=/camera/image_raw,odometry=/odom@base_link` says: topic by role, and after
/// '@' the frame where the messages tell none, or another.
class TopicWishes {
 public:
  /// Throws InputError.
  TopicWishes(const std::vector<std::string>& words, const std::string& file);

  struct Wish {
    std::string topic, frame;
  };
  const Wish* of(const std::string& role) const;  ///< null: nothing is said
  std::string topicOf(const std::string& role) const;

 private:
  std::map<std::string, Wish> wishes_;
};

/// A topic for a role.
struct ChosenTopic {
  const SurveyedTopic* topic = nullptr;  ///< null: there is none
  std::string frame;                     ///< of its messages; empty: unknown
};

struct BagRoles {
  ChosenTopic image, cameraInfo, odometry, poses;
};

/// The topics that are named, else the only ones that can be meant. Throws InputError: several can,
/// a name that is not there, or a topic of another type.
BagRoles chooseTopics(const BagSurvey& survey, const TopicWishes& wishes);

/// Pose of the camera in the frame whose velocities or poses a topic tells: as it is given, or by
/// the transforms of the bag. Throws InputError: it is not known.
Eigen::Isometry3d cameraIn(const ChosenTopic& body, const char* role, const BagRoles& roles,
                           const BagSurvey& survey, const std::optional<RpyPose>& given);

/// How much later than its stamps a topic was received, in words; empty: it has no stamps.
struct StampAge {
  double median_s = 0, least_s = 0, most_s = 0;
};
std::optional<StampAge> stampAgeOf(const SurveyedTopic& topic);

}  // namespace depthservo::detail
