#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <filesystem>
#include <mutex>

#include "depthservo/motion/Motion.h"
#include "depthservo/sequence/Sequence.h"
#include "sequence/ImageStore.h"
#include "sequence/bag/BagRoles.h"
#include "sequence/bag/rosImage.h"
#include "sequence/cameraFiles.h"

namespace depthservo {
namespace {

using namespace detail;

/// The images of a topic, read from the bag one by one.
class BagImages : public ImageStore {
 public:
  BagImages(std::shared_ptr<Bag> bag, const BagTopic& topic, std::vector<MessagePlace> places)
      : bag_(std::move(bag)), topic_(topic), places_(std::move(places)) {}

  ImageFile image(std::size_t frame, const std::string& name) const override {
    try {
      const std::lock_guard<std::mutex> lock(mutex_);
      std::string message = bag_->read(places_[frame]);
      if (topic_.type == "sensor_msgs/Image") {
        return {name, std::move(message), rosImageFormat(topic_.encoding)};
      }
      const auto image = readCompressedImage(MessageReader(message, topic_.encoding));
      if (image.size > message.size() - image.data) throw BagFault("it ends too early");
      return {name, message.substr(image.data, image.size)};
    } catch (const BagFault& fault) {
      throw InputError({name, 0, ""}, std::string("cannot be read: ") + fault.what());
    }
  }

 private:
  mutable std::mutex mutex_;  // a bag holds one chunk
  std::shared_ptr<Bag> bag_;
  BagTopic topic_;
  std::vector<MessagePlace> places_;
};

/// Whether the images of a topic are rectified, as ROS names them.
bool isRectified(const std::string& topic) { return topic.find("image_rect") != std::string::npos; }

/// The message as a camera_info file says it. Rectified images are those of a camera P without a
/// lens.
std::string yamlOf(const CameraInfoMessage& info, bool rectified) {
  std::vector<double> K(info.K, info.K + 9);
  if (rectified) {
    K = {info.P[0], info.P[1], info.P[2], info.P[4], info.P[5],
         info.P[6], info.P[8], info.P[9], info.P[10]};
  }
  std::string text = fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_matrix: {{rows: 3, cols: 3, data: [{}]}}\n",
      info.width, info.height, fmt::join(K, ", "));
  if (rectified) return text;
  std::string model = info.model.substr(0, 40);
  for (char& c : model) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '?';
  }
  if (!model.empty()) text += fmt::format("distortion_model: '{}'\n", model);
  if (!info.D.empty()) {
    text += fmt::format("distortion_coefficients: {{rows: 1, cols: {}, data: [{}]}}\n",
                        info.D.size(), fmt::join(info.D, ", "));
  }
  return text;
}

/// The camera that the bag tells.
PinholeCamera cameraIn(const BagRoles& roles, const std::string& bag,
                       std::vector<std::string>& warnings) {
  const SurveyedTopic* topic = roles.cameraInfo.topic;
  if (!topic || !topic->info) {
    throw InputError({bag, 0, "--topics camera_info"},
                     "the bag has no sensor_msgs CameraInfo; give --camera FILE");
  }
  const bool rectified = isRectified(roles.image.topic->topic.name);
  if (rectified) {
    warnings.push_back(bag +
                       ": the images are rectified by their name: P of camera_info, no distortion");
  }
  if (topic->infoChanges) {
    warnings.push_back(bag + ": camera_info changes; its first message is used");
  }
  try {
    return parseCamera(yamlOf(*topic->info, rectified), bag).camera;
  } catch (const InputError& error) {
    throw InputError({bag, 0, topic->topic.name + " " + error.key()}, error.message());
  }
}

std::vector<std::size_t> orderOf(const SurveyedTopic& topic, const std::string& bag,
                                 std::vector<std::string>& warnings) {
  try {
    std::size_t leftOut = 0;
    const std::vector<std::size_t> order = topic.inOrder(leftOut);
    if (leftOut > 0) {
      warnings.push_back(
          fmt::format("{}: {}: {} messages with a time that another has are left out", bag,
                      topic.topic.name, leftOut));
    }
    return order;
  } catch (const BagFault& fault) {
    throw InputError({bag, 0, topic.topic.name}, fault.what());
  }
}

/// How stamps and times of reception differ, one sentence for the topics that are used.
std::string clockSentence(const std::vector<const SurveyedTopic*>& used) {
  std::vector<std::string> parts;
  for (const SurveyedTopic* topic : used) {
    const auto age = stampAgeOf(*topic);
    parts.push_back(
        age ? fmt::format("{} {:.3g} s ({:.3g} to {:.3g})", topic->topic.name, age->median_s,
                          age->least_s, age->most_s)
            : fmt::format("{} has no stamps, its times of reception are used", topic->topic.name));
  }
  return fmt::format("received later than stamped, median (least to most): {}",
                     fmt::join(parts, "; "));
}

}  // namespace

bool isBag(const std::string& path) { return isBagPath(path); }

void Sequence::readBag(const SequenceOptions& options) {
  if (options.fps > 0) {
    throw InputError({folder_, 0, "--fps"}, "is for numbered images; a bag has times");
  }
  const TopicWishes wishes(options.topics, folder_);
  const BagSurvey survey(folder_, SurveyKind::playable, wishes.topicOf("poses"));
  warnings_ = survey.warnings;
  const BagRoles roles = chooseTopics(survey, wishes);
  if (!roles.image.topic) {
    throw InputError({folder_, 0, "--topics image"},
                     "the bag has no topic of images (sensor_msgs Image or CompressedImage) with a "
                     "message; depthservo info tells what it has");
  }
  name_ = std::filesystem::path(folder_).stem().string();
  std::vector<MessagePlace> places;
  const SurveyedTopic& images = *roles.image.topic;
  for (const std::size_t i : orderOf(images, folder_, warnings_)) {
    const double time_s = images.time(i);
    frames_.push_back(
        {time_s, fmt::format("{} {} {:.6f}", folder_, images.topic.name, time_s), {}, {}});
    places.push_back(images.messages[i].place);
  }
  hasImages_ = true;
  store_ = std::make_shared<BagImages>(survey.bag, images.topic, std::move(places));
  cameraSource_ = options.camera.empty() ? folder_ : options.camera;
  camera_ =
      options.camera.empty() ? cameraIn(roles, folder_, warnings_) : loadCamera(options.camera);

  std::vector<const SurveyedTopic*> used{&images};
  if (const SurveyedTopic* rows = roles.odometry.topic) {
    const auto bMc = cameraIn(roles.odometry, "odometry", roles, survey, options.cameraInBase);
    for (const std::size_t i : orderOf(*rows, folder_, warnings_)) {
      odometry_.push_back({rows->time(i), twistOfCamera(bMc, rows->twists[i])});
    }
    rowMeaning_ = RowMeaning::meanBefore;
    used.push_back(rows);
  }
  if (const SurveyedTopic* poses = roles.poses.topic) {
    const auto bMc = cameraIn(roles.poses, "poses", roles, survey, options.cameraInBase);
    for (const std::size_t i : orderOf(*poses, folder_, warnings_)) {
      poses_.push_back({poses->time(i), poses->poses[i] * bMc});
    }
    if (poses != used.back()) used.push_back(poses);
  }
  warnings_.push_back(folder_ + ": " + clockSentence(used));
  if (!options.target.empty()) useTarget(readTarget(options.target));
  checkImages();
}

std::string Sequence::motionSources() const {
  return store_ ? "a topic of velocities (--topics odometry=) or of poses (poses=)"
                : "twist.csv, ground truth (groundtruth.txt, *.gt.freiburg or "
                  "mav0/state_groundtruth_estimate0/data.csv)";
}

}  // namespace depthservo
