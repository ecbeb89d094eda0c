#include "sequence/bag/BagSurvey.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "depthservo/text/InputError.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kHeadOfImage = 512;                     // bytes
constexpr std::size_t kWholeMessage = std::size_t{16} << 20;  // bytes
constexpr std::size_t kMostFrameNames = 8;

bool isInfoType(const std::string& type) { return type == "sensor_msgs/CameraInfo"; }
bool isSensorType(const std::string& type) {
  return type == "sensor_msgs/Imu" || type == "sensor_msgs/JointState";
}

class SurveyVisitor : public BagVisitor {
 public:
  SurveyVisitor(BagSurvey& survey, SurveyKind kind, std::string poses)
      : survey_(survey), kind_(kind), poses_(std::move(poses)) {}

  std::size_t wanted(const BagTopic& topic) const override {
    const std::size_t timesOnly = kind_ == SurveyKind::everything ? 1 : 0;
    if (!topic.fault.empty()) return timesOnly;
    const std::string& type = topic.type;
    if (type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage") return kHeadOfImage;
    if (isTwistType(type) || isTransformType(type) || isInfoType(type)) return kWholeMessage;
    if (isPoseType(type) && (timesOnly > 0 || isPoses(topic))) return kWholeMessage;
    return isSensorType(type) && timesOnly > 0 ? kWholeMessage : timesOnly;
  }

  void visit(const BagMessage& message) override {
    auto& topics = survey_.topics;
    while (topics.size() <= message.topic) {
      topics.push_back({survey_.bag->topics()[topics.size()], {}});
    }
    SurveyedTopic& to = topics[message.topic];
    try {
      constexpr std::int64_t kLatest = 4'300'000'000'000'000'000;  // as a stamp of ROS 1
      if (message.received_ns < 0 || message.received_ns > kLatest) {
        throw BagFault("it was received at no time that can be");
      }
      SurveyedTopic::Message seen{message.received_ns, 0, message.place};
      if (to.topic.fault.empty()) seen.stamp_ns = take(to, message);
      to.messages.push_back(seen);
    } catch (const BagFault& fault) {
      if (to.undecoded++ == 0) to.why = fault.what();
    }
  }

 private:
  bool isPoses(const BagTopic& topic) const {
    return !poses_.empty() && (topic.name == poses_ || topic.name == "/" + poses_);
  }

  /// Keeps what is needed of a message. \return its stamp; 0: it has none
  std::int64_t take(SurveyedTopic& to, const BagMessage& message) {
    const MessageReader reader(message.bytes, to.topic.encoding);
    const std::string& type = to.topic.type;
    if (isTransformType(type)) {
      for (const TransformMessage& transform : readTransforms(reader))
        survey_.frames.add(transform);
      return 0;
    }
    const MessageHeader header = headerOf(to, reader, message.place.size);
    if (to.frames.size() < kMostFrameNames) to.frames.insert(header.frame);
    return header.stamp_ns;
  }

  static void requirePixels(std::size_t start, std::uint64_t count, std::uint64_t size) {
    if (start > size || count > size - start) throw BagFault("its pixels are not all there");
  }

  MessageHeader headerOf(SurveyedTopic& to, const MessageReader& reader, std::uint64_t size) {
    const std::string& type = to.topic.type;
    if (type == "sensor_msgs/Image") {
      const ImageMessage image = readImage(reader);
      requirePixels(image.pixels, image.size, size);
      if (to.content.empty()) to.content = printable(image.encoding);
      return image.header;
    }
    if (type == "sensor_msgs/CompressedImage") {
      const CompressedImageMessage image = readCompressedImage(reader);
      requirePixels(image.data, image.size, size);
      if (to.content.empty()) to.content = printable(image.format);
      return image.header;
    }
    if (isInfoType(type)) return takeInfo(to, readCameraInfo(reader));
    std::optional<PoseMessage> pose;
    if (isPoseType(type) && (isPoses(to.topic) || !isTwistType(type))) {
      pose = readPose(reader, type);
    }
    MessageHeader header;
    if (pose) header = {pose->header.stamp_ns, pose->body};
    if (isTwistType(type)) {
      const TwistMessage message = readTwist(reader, type);
      if (message.header) header = *message.header;
      header.frame = message.frame;
      to.twists.push_back(message.twist);
    }
    if (pose && isPoses(to.topic)) to.poses.push_back(pose->pose);
    if (type == "sensor_msgs/Imu") header = readImu(reader);
    if (type == "sensor_msgs/JointState") {
      const auto names = readJointNames(reader, header);
      if (to.content.empty()) to.content = printable(fmt::format("{}", fmt::join(names, ", ")));
    }
    return header;
  }

  static MessageHeader takeInfo(SurveyedTopic& to, CameraInfoMessage info) {
    const MessageHeader header = info.header;
    if (!to.info) {
      to.info = std::move(info);
    } else if (to.info->width != info.width || to.info->height != info.height ||
               !std::equal(info.K, info.K + 9, to.info->K) || info.D != to.info->D) {
      to.infoChanges = true;
    }
    return header;
  }

  BagSurvey& survey_;
  SurveyKind kind_;
  std::string poses_;
};

}  // namespace

double secondsOf(std::int64_t time_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  if (time_ns < 0) return -secondsOf(-time_ns);
  return *toNumber(fmt::format("{}.{:09}", time_ns / kSecond, time_ns % kSecond));
}

bool SurveyedTopic::isStamped() const {
  return !messages.empty() && std::all_of(messages.begin(), messages.end(),
                                          [](const Message& m) { return m.stamp_ns != 0; });
}

double SurveyedTopic::time(std::size_t message) const {
  const Message& m = messages[message];
  return secondsOf(isStamped() ? m.stamp_ns : m.received_ns);
}

std::vector<std::size_t> SurveyedTopic::inOrder(std::size_t& leftOut) const {
  const bool byStamp = isStamped();
  const auto time = [&](std::size_t i) {
    return byStamp ? messages[i].stamp_ns : messages[i].received_ns;
  };
  std::vector<std::size_t> order(messages.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return messages[a].received_ns < messages[b].received_ns;
  });
  constexpr std::int64_t kJump = 1'000'000'000;  // ns
  std::int64_t latest = order.empty() ? 0 : time(order.front());
  for (const std::size_t i : order) {
    if (time(i) < latest - kJump) {
      throw BagFault(
          fmt::format("its stamps jump back by {:.3g} s at {:.3f} s: was the clock set, "
                      "or a simulation started again? Cut the bag there",
                      1e-9 * static_cast<double>(latest - time(i)), secondsOf(latest)));
    }
    latest = std::max(latest, time(i));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return time(a) < time(b); });
  const auto last = std::unique(order.begin(), order.end(),
                                [&](std::size_t a, std::size_t b) { return time(a) == time(b); });
  leftOut = static_cast<std::size_t>(order.end() - last);
  order.erase(last, order.end());
  return order;
}

BagSurvey::BagSurvey(const std::string& file, SurveyKind kind, const std::string& poses)
    : path(file), bag(openBag(file)) {
  SurveyVisitor visitor(*this, kind, poses);
  bag->visit(visitor);
  while (topics.size() < bag->topics().size()) topics.push_back({bag->topics()[topics.size()], {}});
  for (const std::string& warning : bag->warnings()) warnings.push_back(path + ": " + warning);
  for (const SurveyedTopic& t : topics) {
    if (t.undecoded == 0) continue;
    warnings.push_back(fmt::format("{}: {}: {} of {} messages are no {} and are left out: {}", path,
                                   t.topic.name, t.undecoded, t.undecoded + t.messages.size(),
                                   t.topic.type, t.why));
  }
}

}  // namespace depthservo::detail
