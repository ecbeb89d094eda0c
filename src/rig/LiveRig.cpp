#include "depthservo/rig/LiveRig.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "depthservo/observation/words.h"
#include "observation/MotionSuspects.h"
#include "observation/ObserverSetup.h"
#include "rig/RowQueue.h"

namespace depthservo {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kOdometryRows = 16384;
constexpr std::size_t kMostFaultsTold = 20;

/// Rows of a file hold; what comes while it happens tells what has been.
ObservedSource sourceOf(const LiveOptions& options, const TwistSource* twists) {
  ObservedSource source{options.name, options.targetFile, options.camera, options.target};
  source.frameRate = source.fastestRate = options.rate;
  source.odometryRows = kOdometryRows;
  const bool isFile = twists && twists->isFile();
  source.rows = options.target.rows.value_or(isFile ? RowMeaning::hold : RowMeaning::meanBefore);
  return source;
}

/// Gives the images that can be used, and remembers why others cannot.
class UsableImages {
 public:
  UsableImages(ImageSource& source, const LiveOptions& options)
      : source_(source), camera_(options.camera), name_(options.name) {}

  /// False when there are no more. Throws InputError when the first image is not of the camera's
  /// size.
  bool next(TimedImage& image) {
    for (std::size_t inARow = 0; inARow < kMostSkipped || !source_.isLive(); ++inARow) {
      const ImageStatus status = source_.next(image);
      if (status == ImageStatus::ended) {
        reason_ = source_.reason();
        return false;
      }
      const bool isThere = status == ImageStatus::image;
      const std::string fault = isThere ? sizeFault(image) : source_.reason();
      hasImage_ = hasImage_ || (isThere && fault.empty());
      if (fault.empty()) return true;
      if (isThere && !hasImage_) throw InputError({name_, 0, ""}, fault);
      if (fault != lastFault_) faults_.push_back(fault);
      otherSize_ += isThere;
      lastFault_ = fault;
    }
    reason_ = "none of the last images can be used: " + lastFault_;
    return false;
  }

  /// Why images were left out since the last call, the same reason in a row once.
  std::vector<std::string> takeFaults() { return std::exchange(faults_, {}); }

  std::string whyEnded() const {
    if (otherSize_ == 0) return reason_;
    return fmt::format("{}; {} images of another size left out: {}", reason_, otherSize_,
                       lastFault_);
  }

 private:
  static constexpr std::size_t kMostSkipped = 100;

  /// Empty when the image has the camera's size.
  std::string sizeFault(const TimedImage& image) const {
    const auto width = static_cast<int>(image.image.getWidth());
    const auto height = static_cast<int>(image.image.getHeight());
    if (width == camera_.width && height == camera_.height) return "";
    return fmt::format("the camera has {}x{} pixels, the image has {}x{}", camera_.width,
                       camera_.height, width, height);
  }

  ImageSource& source_;
  PinholeCamera camera_;
  std::string name_;
  bool hasImage_ = false;
  std::size_t otherSize_ = 0;
  std::vector<std::string> faults_;
  std::string lastFault_, reason_;
};

}  // namespace

struct LiveRig::Parts {
  Parts(const LiveOptions& o, ImageSource& i, TwistSource* t)
      : options(o), images(i), usable(i, o), twists(t), source(sourceOf(o, t)) {}

  void take(double wait_s) {
    for (const OdometryRow& row : twists->read(wait_s)) {
      if (!isPossible(row.twist)) {
        ++impossible;
        continue;
      }
      waiting.offer(row);
      newestTwist_s = row.time_s;
    }
  }

  bool isPossible(const Twist& twist) const {
    return (options.most_v == 0 || twist.linear.norm() <= options.most_v) &&
           (options.most_w == 0 || twist.angular.norm() <= options.most_w);
  }

  void readRows(MotionBuffer& odometry, double time_s) { waiting.readInto(odometry, time_s, rows); }

  bool isCovered(MotionBuffer& odometry, double time_s) {
    readRows(odometry, time_s);
    return odometry.coverage(time_s, time_s) == Coverage::complete;
  }

  /// A file's image waits until the next row shows how far the one before it holds; a camera's
  /// cannot: a row holds for one period beyond its time, unless it says nothing of that.
  bool isEnough(MotionBuffer& odometry, double time_s) {
    return waiting.isCoveredBeyond(time_s) ||
           (images.isLive() && isCovered(odometry, time_s) && odometry.saysUntil(time_s));
  }

  LiveOptions options;
  ImageSource& images;
  UsableImages usable;
  TwistSource* twists;
  ObservedSource source;
  RowQueue waiting;
  std::vector<OdometryRow> rows;
  std::string reason;
  double first_s = kUnknown, last_s = kUnknown, newestTwist_s = kUnknown;
  std::size_t impossible = 0;  // twists
  bool isImpossibleTold = false, haveImagesEnded = false;
  bool areTwistsLate = false, haveTwistsEnded = false;
  std::size_t faultsTold = 0;
};

LiveRig::LiveRig(const LiveOptions& options, ImageSource& images, TwistSource* twists)
    : parts_(std::make_unique<Parts>(options, images, twists)) {
  ObservationOptions& observation = parts_->options.observation;
  observation = withTracker(parts_->source, observation);
  observation.motion = twists ? MotionSource::twist : MotionSource::target;
  if (!twists && options.target.target.points.size() < 4) {
    throw InputError({options.name, 0, ""},
                     "the camera's motion is unknown: needs a stream of twists (--twist), or a "
                     "target of at least four points or of AprilTags with their size");
  }
}

LiveRig::~LiveRig() = default;

const ObservationOptions& LiveRig::options() const { return parts_->options.observation; }
const ObservedSource& LiveRig::source() const { return parts_->source; }
const std::vector<OdometryRow>& LiveRig::odometry() const { return parts_->rows; }
double LiveRig::time() const { return parts_->last_s; }
bool LiveRig::haveImagesEnded() const { return parts_->haveImagesEnded; }

bool LiveRig::hasOdometry() {
  Parts& p = *parts_;
  if (p.twists) p.take(0);
  return !p.twists || p.twists->counts().rows >= 2;
}

double LiveRig::newestTwist_s() const { return parts_->newestTwist_s; }

const TwistSource::Counts* LiveRig::twists() const {
  return parts_->twists ? &parts_->twists->counts() : nullptr;
}

std::optional<Exposure> LiveRig::next(Listener*) {
  Parts& p = *parts_;
  TimedImage image;
  for (;;) {
    const bool hasImage = p.usable.next(image);
    for (const std::string& fault : p.usable.takeFaults()) {
      note(std::isnan(p.last_s) ? 0 : p.last_s, fault);
    }
    if (!hasImage) break;
    if (std::isnan(p.first_s)) p.first_s = image.time_s;
    if (p.options.duration_s > 0 && image.time_s - p.first_s > p.options.duration_s) {
      p.reason = "the duration is over";
      return std::nullopt;
    }
    if (image.time_s <= p.last_s) {  // the clock of a camera's images may be set back
      note(p.last_s, "an image is not later than the one before: left out");
      continue;
    }
    p.last_s = image.time_s;
    Exposure exposure;
    exposure.time_s = image.time_s;
    exposure.image = std::move(image.image);
    return exposure;
  }
  p.reason = p.usable.whyEnded();
  p.haveImagesEnded = true;
  return std::nullopt;
}

/// Takes what is there; waits for the rest of what an image of this time needs.
void LiveRig::readOdometry(MotionBuffer& odometry, double time_s) {
  Parts& p = *parts_;
  if (!p.twists) return;
  if (p.options.keep != Keep::everything) p.rows.clear();
  p.take(0);
  const auto start = Clock::now();
  while (!p.twists->isEnded() && !p.twists->wasInterrupted() && !p.isEnough(odometry, time_s)) {
    const double waited_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (p.areTwistsLate || waited_s >= p.options.patience_s) break;
    p.take(p.options.patience_s - waited_s);
  }
  const bool areLate = !p.twists->isEnded() && !p.isEnough(odometry, time_s);
  if (areLate && !p.areTwistsLate) note(time_s, "twists are late");
  if (!areLate && p.areTwistsLate) note(time_s, "twists are in time again");
  p.areTwistsLate = areLate;
  for (const std::string& fault : p.twists->takeFaults()) {
    if (p.faultsTold++ < kMostFaultsTold) note(time_s, "twists: " + fault);
  }
  if (p.impossible > 0 && !p.isImpossibleTold) {
    note(time_s, "twists: some are faster than the robot can be: left out");
    p.isImpossibleTold = true;
  }
  const bool haveEnded = p.twists->isEnded() && !p.isCovered(odometry, time_s);
  if (haveEnded != p.haveTwistsEnded) {
    note(time_s, haveEnded ? "the stream of twists has ended" : "the stream of twists goes on");
  }
  p.haveTwistsEnded = haveEnded;
  p.readRows(odometry, time_s);
}

std::string LiveRig::whyEnded() const {
  std::string reason = parts_->reason;
  if (const TwistSource::Counts* c = twists()) {
    reason += fmt::format("; twists: {} rows, refused {} malformed, {} torn, {} not later", c->rows,
                          c->malformed, c->torn, c->notLater);
    if (parts_->impossible > 0) reason += fmt::format(", {} too fast", parts_->impossible);
  }
  return reason;
}

RunLog live(const LiveOptions& options, ImageSource& images, TwistSource* twists,
            RunWatcher* watcher) {
  LiveRig rig(options, images, twists);
  Observer observer(rig.source(), rig.options());
  RunLog log = observe(rig, observer, watcher, options.keep);
  if (log.frames.empty()) {
    throw InputError({options.name, 0, ""},
                     images.reason().empty() ? "no image" : "no image: " + images.reason());
  }
  log.command = "live";
  log.name = options.name;
  log.configuration = configurationOf(rig.options());
  explainMotion(log, rig.options(), log.odometry);
  log.events.push_back({rig.time(), log.reason});
  return log;
}

}  // namespace depthservo
