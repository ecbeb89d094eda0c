#include "depthservo/sequence/RecordingInfo.h"

#include <algorithm>
#include <filesystem>

#include "motion/median.h"
#include "sequence/bag/BagRoles.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// A topic with these times [s], increasing.
RecordedTopic topicOf(std::string name, std::string type, const std::vector<double>& times) {
  RecordedTopic topic;
  topic.name = std::move(name);
  topic.type = std::move(type);
  topic.messages = times.size();
  if (times.empty()) return topic;
  topic.span = {times.front(), times.back()};
  topic.gaps = holesOf(times);
  const double period_s = detail::medianPeriod(times, [](double t) { return t; });
  if (period_s > 0) topic.rate_hz = 1 / period_s;
  return topic;
}

RecordedTopic topicOf(const detail::SurveyedTopic& t) {
  std::vector<double> times;
  for (std::size_t i = 0; i < t.messages.size(); ++i) times.push_back(t.time(i));
  std::sort(times.begin(), times.end());
  RecordedTopic topic = topicOf(t.topic.name, t.topic.type, times);
  topic.content = t.topic.fault.empty() ? t.content : t.topic.fault;
  topic.unreadable = t.undecoded;
  if (const auto age = detail::stampAgeOf(t))
    topic.age = {age->median_s, age->least_s, age->most_s};
  for (const std::string& frame : t.frames) {
    if (!frame.empty()) topic.frames.push_back(frame);
  }
  return topic;
}

void nameUse(const detail::ChosenTopic& chosen, const char* use, RecordingInfo& info) {
  for (RecordedTopic& topic : info.topics) {
    if (chosen.topic && topic.name == chosen.topic->topic.name) {
      topic.use += (topic.use.empty() ? "" : ", ") + std::string(use);
    }
  }
}

void describeBag(const SequenceOptions& options, RecordingInfo& info) {
  info.kind = "ROS bag";
  std::error_code error;
  if (fs::is_regular_file(info.path, error)) info.bytes = fs::file_size(info.path, error);
  const detail::TopicWishes wishes(options.topics, info.path);
  const detail::BagSurvey survey(info.path, detail::SurveyKind::everything,
                                 wishes.topicOf("poses"));
  for (const detail::SurveyedTopic& topic : survey.topics) info.topics.push_back(topicOf(topic));
  for (const auto& [name, frame] : survey.frames.frames()) {
    info.frames.push_back({name, frame.parent, frame.pose, frame.isStill});
  }
  info.notes = survey.warnings;
  const detail::BagRoles roles = detail::chooseTopics(survey, wishes);
  nameUse(roles.image, "image", info);
  nameUse(roles.cameraInfo, "camera_info", info);
  nameUse(roles.odometry, "odometry", info);
  nameUse(roles.poses, "poses", info);
}

template <class Timed>
void addFile(const char* name, const char* type, const std::vector<Timed>& rows,
             RecordingInfo& info) {
  if (rows.empty()) return;
  std::vector<double> times;
  for (const Timed& row : rows) times.push_back(row.time_s);
  info.topics.push_back(topicOf(name, type, times));
}

void describeFolder(const Sequence& sequence, RecordingInfo& info) {
  std::vector<SequenceFrame> tracks, truth;
  for (const SequenceFrame& frame : sequence.frames()) {
    if (!frame.tracks.empty()) tracks.push_back({frame.time_s, "", {}, {}});
    if (!frame.truth.empty()) truth.push_back({frame.time_s, "", {}, {}});
  }
  if (sequence.hasImages()) {
    addFile("images", "image", sequence.frames(), info);
    info.topics.back().use = "image";
  }
  addFile("tracks.csv", "points", tracks, info);
  addFile("truth.csv", "depths of points", truth, info);
  addFile("depth images", "depth image", sequence.depthImages(), info);
  addFile("twist.csv", "twist of the camera", sequence.odometry(), info);
  if (!sequence.odometry().empty()) info.topics.back().use = "odometry";
  addFile("ground truth", "pose of the camera", sequence.poses(), info);
  if (!sequence.poses().empty()) info.topics.back().use = "poses";
}

}  // namespace

RecordingInfo describeRecording(const std::string& path, const SequenceOptions& options) {
  RecordingInfo info;
  info.path = path;
  info.kind = "folder";
  const bool isFolder = !isBag(path);
  std::error_code error;
  if (isFolder && !fs::is_directory(path, error)) Sequence{path, options};  // says why not
  try {
    if (!isFolder) describeBag(options, info);
    const Sequence sequence(path, options);
    if (isFolder) describeFolder(sequence, info);
    info.camera = sequence.camera();
    info.notes = sequence.warnings();
    if (sequence.odometry().empty() && sequence.poses().size() < 2 &&
        sequence.target().points.size() < 4) {
      info.missing = "the camera's motion: needs " + sequence.motionSources() +
                     " or a target of at least four points (--target FILE)";
    }
  } catch (const InputError& refusal) {
    if (!isFolder && info.topics.empty()) throw;
    info.missing = refusal.what();
  }
  return info;
}

}  // namespace depthservo
