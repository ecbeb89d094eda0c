#include "depthservo/report/RunRecorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "depthservo/motion/MotionBuffer.h"
#include "depthservo/text/InputError.h"
#include "report/EmbeddedSchemas.h"
#include "report/McapWriter.h"
#include "report/foxglove.h"

namespace depthservo {
namespace {

/// Where the camera has gone by its odometry, image by image. While that is not known it stands.
class Trajectory {
 public:
  const Eigen::Isometry3d& pose() const { return wMc_; }  ///< of the camera in the world

  /// Whether the motion since the image before is known; of the first one there is none.
  bool isMotionKnown() const { return isKnown_; }
  bool hasBegun() const { return hasBegun_; }  ///< there was an image before

  void add(const RecordedFrame& frame) {
    const FrameRecord& record = frame.record;
    takeRows(frame);
    hasBegun_ = !std::isnan(last_s_);
    if (!hasBegun_ && frame.exposure.wMc) wMc_ = *frame.exposure.wMc;
    isKnown_ = hasBegun_ && isKnown(frame);
    if (isKnown_) {
      const Motion step = Motion::fromTwist(record.twist, record.time_s - last_s_);
      Eigen::Isometry3d nowFromBefore = Eigen::Isometry3d::Identity();
      nowFromBefore.linear() = step.R;
      nowFromBefore.translation() = step.t;
      wMc_ = wMc_ * nowFromBefore.inverse();
      wMc_.linear() = Eigen::Quaterniond(wMc_.linear()).normalized().toRotationMatrix();
    }
    last_s_ = record.time_s;
  }

 private:
  void takeRows(const RecordedFrame& frame) {
    if (rows_.size() == 0) rows_.setMeaning(frame.rows);
    const auto& rows = frame.odometry;
    auto row = std::upper_bound(rows.begin(), rows.end(), lastRow_s_,
                                [](double t, const OdometryRow& r) { return t < r.time_s; });
    for (; row != rows.end(); ++row) {
      rows_.push(row->time_s, row->twist);
      lastRow_s_ = row->time_s;
    }
  }

  /// A rig without rows takes the motion from its target: a twist of zero is none.
  bool isKnown(const RecordedFrame& frame) const {
    const double now_s = frame.record.time_s;
    if (rows_.size() > 0) return rows_.coverage(last_s_, now_s) == Coverage::complete;
    const Twist& twist = frame.record.twist;
    return !twist.linear.isZero(0) || !twist.angular.isZero(0);
  }

  static constexpr std::size_t kRows = 16384;
  MotionBuffer rows_{kRows};
  double lastRow_s_ = -std::numeric_limits<double>::infinity();
  Eigen::Isometry3d wMc_ = Eigen::Isometry3d::Identity();
  double last_s_ = kUnknown;
  bool isKnown_ = false, hasBegun_ = false;
};

std::string tumRow(double time_s, const Eigen::Isometry3d& wMc) {
  const Eigen::Vector3d t = wMc.translation();
  const Eigen::Quaterniond q(wMc.linear());
  return fmt::format("{:.9f} {} {} {} {} {} {} {}\n", time_s, t.x(), t.y(), t.z(), q.x(), q.y(),
                     q.z(), q.w());
}

/// The channels of a run in an MCAP file.
class McapRun {
 public:
  explicit McapRun(const std::string& file) : place_(file), writer_(file) {}

  void add(const RecordedFrame& frame, const Trajectory& trajectory) {
    const FrameRecord& record = frame.record;
    const double time_s = record.time_s;
    const PinholeCamera& camera = frame.log.camera;
    last_s_ = time_s;
    write(calibration_, time_s, foxglove::cameraCalibration(time_s, camera));
    if (frame.exposure.hasImage()) {
      write(image_, time_s, foxglove::compressedImage(time_s, frame.exposure.image));
    }
    write(transforms_, time_s,
          foxglove::frameTransform(time_s, foxglove::kWorld, foxglove::kCamera, trajectory.pose()));
    if (const auto& truth = frame.exposure.wMc) {
      write(transforms_, time_s,
            foxglove::frameTransform(time_s, foxglove::kWorld, "camera_true", *truth));
    }
    write(depths_, time_s, foxglove::depths(record));
    write(cloud_, time_s, foxglove::pointCloud(record));
    write(scene_, time_s, foxglove::sceneUpdate(record));
    write(annotations_, time_s, foxglove::imageAnnotations(record, frame.log.goals));
    write(robot_, time_s,
          foxglove::robot(record, frame.log.commandNames, trajectory.isMotionKnown()));
    addEvents(frame.log);
  }

  void finish(const RunLog& log) {
    addEvents(log);
    addDiagnosis(log);
    writer_.addMetadata("depthservo", {{"command", log.command},
                                       {"name", log.name},
                                       {"seed", std::to_string(log.seed)},
                                       {"profile", log.profile},
                                       {"outcome", log.hasOutcome ? toString(log.outcome) : ""},
                                       {"reason", log.reason},
                                       {"configuration", log.configuration}});
    writer_.finish();
  }

 private:
  std::uint16_t channel(const char* topic, const char* name, std::string_view text) {
    return writer_.addChannel(topic, writer_.addSchema(name, text));
  }

  void write(std::uint16_t channel, double time_s, const foxglove::Json& message) {
    if (!(time_s >= 0)) {
      throw InputError({place_, 0, "timestamp"},
                       fmt::format("an MCAP file has no time before 0, got {} s", time_s));
    }
    constexpr auto kReplace = foxglove::Json::error_handler_t::replace;
    writer_.addMessage(channel, foxglove::Time(time_s).total_ns(),
                       message.dump(-1, ' ', false, kReplace));
  }

  /// Those not written yet: some are found at the end, and a long log forgets.
  void addEvents(const RunLog& log) {
    for (const Event& event : log.events) {
      if (!told_.emplace(event.time_s, event.what).second) continue;
      write(events_, event.time_s,
            foxglove::log(event.time_s, foxglove::Level::info, "depthservo", event.what));
    }
  }

  void tell(foxglove::Level level, const std::string& message) {
    write(diagnosis_, last_s_, foxglove::log(last_s_, level, "diagnosis", message));
  }

  void addDiagnosis(const RunLog& log) {
    using foxglove::Level;
    if (log.diagnosis && log.diagnosis->isFault()) {
      tell(log.diagnosis->isCompensated ? Level::info : Level::warning, log.diagnosis->message());
    } else if (log.diagnosis) {
      tell(Level::info, "images and odometry agree with what was declared of them");
    }
    if (log.joint) {
      for (const std::string& words : log.joint->sentences(log.camera.focal_px())) {
        tell(Level::info, words);
      }
    }
    if (log.noise) tell(Level::info, sentenceOf(*log.noise));
    if (log.frameRate) tell(Level::info, log.frameRate->sentence);
    if (!log.reason.empty()) tell(Level::info, log.reason);
  }

  std::string place_;  // for messages
  McapWriter writer_;
  const EmbeddedSchemas& schemas_ = embeddedSchemas();
  const std::uint16_t calibration_ = channel("/camera/calibration", "foxglove.CameraCalibration",
                                             schemas_.calibration),
                      image_ = channel("/camera/image", "foxglove.CompressedImage", schemas_.image),
                      transforms_ = channel("/tf", "foxglove.FrameTransform", schemas_.transform),
                      depths_ = channel("/depths", "depthservo.Depths", schemas_.depths),
                      cloud_ = channel("/depths/cloud", "foxglove.PointCloud", schemas_.cloud),
                      scene_ = channel("/depths/scene", "foxglove.SceneUpdate", schemas_.scene),
                      annotations_ = channel("/camera/annotations", "foxglove.ImageAnnotations",
                                             schemas_.annotations),
                      robot_ = channel("/robot", "depthservo.Robot", schemas_.robot),
                      log_ = writer_.addSchema("foxglove.Log", schemas_.log),
                      events_ = writer_.addChannel("/events", log_),
                      diagnosis_ = writer_.addChannel("/diagnosis", log_);
  std::set<std::pair<double, std::string>> told_;
  double last_s_ = 0;
};

}  // namespace

struct RunRecorder::Parts {
  explicit Parts(const RecordingFiles& files) {
    if (!files.mcap.empty() && files.mcap == files.tum) {
      throw InputError({files.tum, 0, ""}, "is to be the MCAP file and the trajectory at once");
    }
    if (!files.mcap.empty()) mcap.emplace(files.mcap);
    if (!files.tum.empty()) tum.emplace(files.tum);
  }

  std::optional<McapRun> mcap;
  std::optional<NewFile> tum;
  Trajectory trajectory;
};

RunRecorder::RunRecorder(const RecordingFiles& files) : parts_(std::make_unique<Parts>(files)) {}

RunRecorder::~RunRecorder() = default;

void RunRecorder::add(const RecordedFrame& frame) {
  Parts& p = *parts_;
  p.trajectory.add(frame);
  if (p.tum) {
    if (p.trajectory.hasBegun() && !p.trajectory.isMotionKnown()) {
      p.tum->write("# the motion to the next row is not known\n");
    }
    p.tum->write(tumRow(frame.record.time_s, p.trajectory.pose()));
  }
  if (p.mcap) p.mcap->add(frame, p.trajectory);
}

void RunRecorder::finish(const RunLog& log) {
  if (parts_->mcap) parts_->mcap->finish(log);
  if (parts_->tum) parts_->tum->keep();
}

}  // namespace depthservo
