#include "sequence/bag/BagRoles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "depthservo/text/InputError.h"
#include "sequence/bag/rosImage.h"
#include "text/Names.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

bool isImageTopic(const SurveyedTopic& t) {
  return (t.topic.type == "sensor_msgs/Image" || t.topic.type == "sensor_msgs/CompressedImage") &&
         !isDepthEncoding(t.content);
}
bool isInfoTopic(const SurveyedTopic& t) { return t.topic.type == "sensor_msgs/CameraInfo"; }
bool isTwistTopic(const SurveyedTopic& t) { return isTwistType(t.topic.type); }
bool isPoseTopic(const SurveyedTopic& t) { return isPoseType(t.topic.type); }

struct BagRole {
  const char *name, *types;
  bool (*fits)(const SurveyedTopic&);
};

constexpr BagRole kImageRole{"image", "sensor_msgs Image or CompressedImage (no depths)",
                             isImageTopic};
constexpr BagRole kInfoRole{"camera_info", "sensor_msgs CameraInfo", isInfoTopic};
constexpr BagRole kOdometryRole{
    "odometry",
    "nav_msgs Odometry or geometry_msgs Twist, TwistStamped or TwistWithCovarianceStamped",
    isTwistTopic};
constexpr BagRole kPosesRole{
    "poses", "nav_msgs Odometry or geometry_msgs PoseStamped or PoseWithCovarianceStamped",
    isPoseTopic};

/// A short list of topics for a message.
std::string listOf(const std::vector<const SurveyedTopic*>& topics) {
  std::vector<std::string> names;
  for (const SurveyedTopic* t : topics) {
    if (names.size() == 12) {
      names.push_back(fmt::format("{} more", topics.size() - 12));
      break;
    }
    names.push_back(fmt::format("{} ({}, {})", t->topic.name.substr(0, 60),
                                t->topic.type.substr(0, 60), t->messages.size()));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::vector<const SurveyedTopic*> candidatesFor(const BagRole& role, const BagSurvey& survey) {
  std::vector<const SurveyedTopic*> found;
  for (const SurveyedTopic& t : survey.topics) {
    if (t.topic.fault.empty() && !t.messages.empty() && role.fits(t)) found.push_back(&t);
  }
  return found;
}

[[noreturn]] void refuseTopic(const BagSurvey& survey, const std::string& role,
                              const std::string& message) {
  throw InputError({survey.path, 0, "--topics " + role}, message);
}

const SurveyedTopic* namedTopic(const BagRole& role, const std::string& name,
                                const BagSurvey& survey) {
  const auto isNamed = [&](const SurveyedTopic& t) {
    return t.topic.name == name || t.topic.name == "/" + name;
  };
  const auto found = std::find_if(survey.topics.begin(), survey.topics.end(), isNamed);
  if (found == survey.topics.end()) {
    std::vector<const SurveyedTopic*> all;
    for (const SurveyedTopic& t : survey.topics) all.push_back(&t);
    refuseTopic(survey, role.name,
                all.empty() ? "the bag has no topics"
                            : fmt::format("there is no topic {}; the bag has {}", detail::quoted(name),
                                          listOf(all)));
  }
  if (!found->topic.fault.empty()) {
    refuseTopic(survey, role.name, found->topic.name + " " + found->topic.fault);
  }
  if (!role.fits(*found)) {
    refuseTopic(survey, role.name,
                fmt::format("{} is of type {}{}, expected {}", found->topic.name, found->topic.type,
                            found->content.empty() ? "" : " (" + found->content + ")", role.types));
  }
  if (found->messages.empty()) {
    refuseTopic(survey, role.name,
                fmt::format("{} has no message that can be used{}", found->topic.name,
                            found->why.empty() ? "" : ": " + found->why));
  }
  return &*found;
}

/// Whether a role was given up: odometry=none.
bool isNone(const TopicWishes& wishes, const BagRole& role) {
  return wishes.topicOf(role.name) == "none";
}

ChosenTopic choose(const BagRole& role, const BagSurvey& survey, const TopicWishes& wishes,
                   std::vector<const SurveyedTopic*> candidates) {
  ChosenTopic chosen;
  const TopicWishes::Wish* wish = wishes.of(role.name);
  if (isNone(wishes, role)) return chosen;
  if (wish) {
    chosen.topic = namedTopic(role, wish->topic, survey);
  } else if (candidates.size() > 1) {
    refuseTopic(
        survey, role.name,
        fmt::format("{} topics may be meant; say which, --topics {}={}: {}", candidates.size(),
                    role.name, candidates.front()->topic.name, listOf(candidates)));
  } else if (candidates.size() == 1) {
    chosen.topic = candidates.front();
  }
  if (!chosen.topic) return chosen;
  if (wish && !wish->frame.empty()) {
    chosen.frame = wish->frame;
  } else if (chosen.topic->frames.size() == 1) {
    chosen.frame = *chosen.topic->frames.begin();
  } else if (chosen.topic->frames.size() > 1) {
    refuseTopic(
        survey, role.name,
        fmt::format("the messages of {} name several frames: {}; say which is right: {}={}@FRAME",
                    chosen.topic->topic.name, fmt::join(chosen.topic->frames, ", "), role.name,
                    chosen.topic->topic.name));
  }
  return chosen;
}

/// The topics beside the image's, as drivers name them; else all.
std::vector<const SurveyedTopic*> infosFor(const ChosenTopic& image, const BagSurvey& survey) {
  const std::vector<const SurveyedTopic*> all = candidatesFor(kInfoRole, survey);
  if (!image.topic) return all;
  std::string space = image.topic->topic.name;
  while (space.find('/') != std::string::npos) {
    space.resize(space.rfind('/'));
    for (const SurveyedTopic* t : all) {
      if (t->topic.name == space + "/camera_info") return {t};
    }
  }
  return all;
}

}  // namespace

TopicWishes::TopicWishes(const std::vector<std::string>& words, const std::string& file) {
  static const std::vector<std::string> roles = {"image", "camera_info", "odometry", "poses"};
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string role = word.substr(0, equals);
    if (equals == std::string::npos || equals + 1 == word.size()) {
      throw InputError({file, 0, "--topics"},
                       fmt::format("expected ROLE=TOPIC, such as image=/camera/image_raw, got {}",
                                   detail::quoted(word)));
    }
    if (std::find(roles.begin(), roles.end(), role) == roles.end()) {
      throw InputError({file, 0, "--topics"}, unknownWord(role, roles));
    }
    const std::string topic = word.substr(equals + 1);
    const std::size_t at = topic.find('@');
    const bool isNew = wishes_
                           .emplace(role, Wish{topic.substr(0, at),
                                               at == std::string::npos ? "" : topic.substr(at + 1)})
                           .second;
    if (!isNew) throw InputError({file, 0, "--topics"}, role + " is there twice");
  }
}

const TopicWishes::Wish* TopicWishes::of(const std::string& role) const {
  const auto wish = wishes_.find(role);
  return wish == wishes_.end() ? nullptr : &wish->second;
}

std::string TopicWishes::topicOf(const std::string& role) const {
  const Wish* wish = of(role);
  return wish ? wish->topic : "";
}

BagRoles chooseTopics(const BagSurvey& survey, const TopicWishes& wishes) {
  BagRoles roles;
  roles.image = choose(kImageRole, survey, wishes, candidatesFor(kImageRole, survey));
  roles.cameraInfo = choose(kInfoRole, survey, wishes, infosFor(roles.image, survey));
  roles.odometry = choose(kOdometryRole, survey, wishes, candidatesFor(kOdometryRole, survey));
  roles.poses = choose(kPosesRole, survey, wishes, {});
  return roles;
}

Eigen::Isometry3d cameraIn(const ChosenTopic& body, const char* role, const BagRoles& roles,
                           const BagSurvey& survey, const std::optional<RpyPose>& given) {
  if (given) return given->isometry();
  const std::string& name = body.topic->topic.name;
  const auto refuseFrame = [&](const std::string& why) {
    refuseTopic(survey, role,
                fmt::format("{} tells the motion of another frame than the camera's: {}; give the "
                            "camera's place, --camera-in-base X,Y,Z,ROLL,PITCH,YAW",
                            name, why));
  };
  if (body.frame.empty()) {
    refuseFrame(
        fmt::format("its messages do not say of which; name it: {}={}@base_link, or", role, name));
  }
  if (roles.image.frame.empty()) {
    refuseFrame(fmt::format("the images of {} name no frame; name it: image={}@FRAME, or",
                            roles.image.topic->topic.name, roles.image.topic->topic.name));
  }
  try {
    return survey.frames.poseOf(roles.image.frame, body.frame);
  } catch (const BagFault& fault) {
    refuseFrame(fault.what());
    throw;
  }
}

std::optional<StampAge> stampAgeOf(const SurveyedTopic& topic) {
  if (!topic.isStamped()) return std::nullopt;
  std::vector<std::int64_t> ages;
  for (const auto& message : topic.messages) ages.push_back(message.received_ns - message.stamp_ns);
  std::sort(ages.begin(), ages.end());
  const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
  return StampAge{seconds(ages[ages.size() / 2]), seconds(ages.front()), seconds(ages.back())};
}

}  // namespace depthservo::detail
