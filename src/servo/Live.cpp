#include "depthservo/servo/Live.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "servo/ImageObserver.h"
#include "servo/ObservationSetup.h"
#include "servo/makeTracker.h"

namespace depthservo {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kOdometryRows = 16384;
constexpr std::size_t kFramesWithoutLog = 600;
constexpr std::size_t kMostFaultsTold = 20;

ObservedSource sourceOf(const LiveOptions& options) {
  return {options.name,   options.targetFile, options.camera,
          options.target, options.rate,       options.rate};
}

/// Hands twists to the observer as they come, and tells what is wrong with them.
class TwistFeed {
 public:
  TwistFeed(TwistStream& stream, double patience_s, bool isLive)
      : stream_(stream), patience_s_(patience_s), isLive_(isLive) {}

  /// Takes what is there; waits for the rest of what an image of this time needs.
  void feed(ImageObserver& observer, double time_s, std::vector<Event>& events) {
    take(observer, 0);
    const auto start = Clock::now();
    while (!stream_.isEnded() && !stream_.wasInterrupted() && !isEnough(observer, time_s)) {
      const double waited_s = std::chrono::duration<double>(Clock::now() - start).count();
      if (isLate_ || waited_s >= patience_s_) break;
      take(observer, patience_s_ - waited_s);
    }
    const bool isLate = !stream_.isEnded() && !isEnough(observer, time_s);
    if (isLate && !isLate_) events.push_back({time_s, "twists are late"});
    if (!isLate && isLate_) events.push_back({time_s, "twists are in time again"});
    isLate_ = isLate;
    tellFaults(time_s, events);
    const bool isEnded = stream_.isEnded() && !observer.isCovered(time_s);
    if (isEnded != wasEnded_) {
      wasEnded_ = isEnded;
      events.push_back(
          {time_s, wasEnded_ ? "the stream of twists has ended" : "the stream of twists goes on"});
    }
  }

 private:
  /// A file's image waits until the next row shows how far the one before it holds; a camera's
  /// cannot: a row holds for one period beyond its time.
  bool isEnough(ImageObserver& observer, double time_s) const {
    return observer.isCoveredBeyond(time_s) || (isLive_ && observer.isCovered(time_s));
  }

  void take(ImageObserver& observer, double wait_s) {
    for (const OdometryRow& row : stream_.read(wait_s)) observer.offer(row);
  }

  void tellFaults(double time_s, std::vector<Event>& events) {
    for (const std::string& fault : stream_.takeFaults()) {
      if (told_++ < kMostFaultsTold) events.push_back({time_s, "twists: " + fault});
    }
  }

  TwistStream& stream_;
  double patience_s_;
  bool isLive_, isLate_ = false, wasEnded_ = false;
  std::size_t told_ = 0;
};

/// Gives the images that can be used, and tells of the others.
class ImageFeed {
 public:
  ImageFeed(ImageSource& source, const LiveOptions& options) : source_(source), options_(options) {}

  /// False when there are no more; `image` then still is the last one. Throws InputError when the
  /// first image is not of the camera's size.
  bool next(TimedImage& image, double last_s, std::vector<Event>& events) {
    for (std::size_t inARow = 0; inARow < kMostSkipped || !source_.isLive(); ++inARow) {
      const ImageStatus status = source_.next(candidate_);
      if (status == ImageStatus::ended) {
        reason_ = source_.reason();
        return false;
      }
      const std::string fault =
          status == ImageStatus::skipped ? source_.reason() : sizeFault(candidate_);
      if (fault.empty()) {
        hasImage_ = true;
        std::swap(image, candidate_);
        return true;
      }
      if (status == ImageStatus::image && !hasImage_)
        throw InputError({options_.name, 0, ""}, fault);
      if (fault != lastFault_) events.push_back({std::isnan(last_s) ? 0 : last_s, fault});
      otherSize_ += status == ImageStatus::image;
      lastFault_ = fault;
    }
    reason_ = "none of the last images can be used: " + lastFault_;
    return false;
  }

  std::string reason() const {
    if (otherSize_ == 0) return reason_;
    return fmt::format("{}; {} images of another size left out: {}", reason_, otherSize_,
                       lastFault_);
  }

 private:
  static constexpr std::size_t kMostSkipped = 100;

  /// Empty when the image has the camera's size.
  std::string sizeFault(const TimedImage& image) const {
    const PinholeCamera& camera = options_.camera;
    if (static_cast<int>(image.image.getWidth()) == camera.width &&
        static_cast<int>(image.image.getHeight()) == camera.height) {
      return "";
    }
    return fmt::format("the camera has {}x{} pixels, the image has {}x{}", camera.width,
                       camera.height, image.image.getWidth(), image.image.getHeight());
  }

  ImageSource& source_;
  const LiveOptions& options_;
  TimedImage candidate_;
  bool hasImage_ = false;
  std::size_t otherSize_ = 0;
  std::string lastFault_, reason_;
};

}  // namespace

Live::Live(const LiveOptions& options, ImageSource& images, TwistStream* twists)
    : options_(options), images_(images), twists_(twists) {
  ReplayOptions& observation = options_.observation;
  observation.tracker = chooseTracker(options.target, observation.tracker, options.name);
  observation.motion = twists ? ReplayMotion::twist : ReplayMotion::target;
  if (!twists && options.target.target.points.size() < 4) {
    throw InputError({options.name, 0, ""},
                     "the camera's motion is unknown: needs a stream of twists, or a target of at "
                     "least four points or of AprilTags with their size");
  }
  setupOf(sourceOf(options_), observation);
}

RunLog Live::run(const std::function<bool(const LiveFrame&)>& watch) {
  ImageObserver::Parts parts = partsOf(sourceOf(options_), options_.observation);
  parts.odometryCapacity = kOdometryRows;
  ImageObserver observer(std::move(parts));
  std::optional<TwistFeed> feed;
  if (twists_) feed.emplace(*twists_, options_.patience_s, images_.isLive());

  RunLog log;
  log.command = "live";
  log.name = options_.name;
  log.camera = options_.camera;
  log.configuration = configurationOf(options_.observation);
  TimedImage image;
  double first_s = kUnknown, last_s = kUnknown;
  const auto keep = [&](const char* stem) {
    log.images.emplace_back(
        stem,
        std::vector<unsigned char>(image.image.bitmap, image.image.bitmap + image.image.getSize()));
  };
  ImageFeed usable(images_, options_);
  while (usable.next(image, last_s, log.events)) {
    if (std::isnan(first_s)) {
      first_s = image.time_s;
      if (options_.keepsLog) keep("first");
    }
    if (options_.duration_s > 0 && image.time_s - first_s > options_.duration_s) {
      log.reason = "the duration is over";
      break;
    }
    // The clock of a camera's images may be set back.
    if (image.time_s <= last_s) {
      log.events.push_back({last_s, "an image is not later than the one before: left out"});
      continue;
    }
    last_s = image.time_s;
    if (feed) feed->feed(observer, image.time_s, log.events);
    ImageObserver::Input input;
    input.time_s = image.time_s;
    input.image = &image.image;
    if (!options_.keepsLog && log.frames.size() >= kFramesWithoutLog) {
      log.frames.erase(log.frames.begin(), log.frames.begin() + kFramesWithoutLog / 2);
      log.events.clear();
    }
    log.frames.push_back(observer.observe(input));
    for (Event& event : observer.takeEvents()) log.events.push_back(std::move(event));
    const LiveFrame frame{log.frames.back(), image.image, log,
                          twists_ ? &twists_->counts() : nullptr};
    if (watch && !watch(frame)) {
      log.reason = "stopped by the user";
      break;
    }
  }
  if (log.frames.empty()) {
    throw InputError({options_.name, 0, ""},
                     usable.reason().empty() ? "no image" : "no image: " + usable.reason());
  }
  if (options_.keepsLog) keep("last");
  observer.finish(log);
  if (log.reason.empty()) log.reason = usable.reason();
  if (twists_) {
    const TwistStream::Counts& c = twists_->counts();
    log.reason += fmt::format("; twists: {} rows, refused {} malformed, {} torn, {} not later",
                              c.rows, c.malformed, c.torn, c.notLater);
  }
  log.events.push_back({last_s, log.reason});
  return log;
}

}  // namespace depthservo
