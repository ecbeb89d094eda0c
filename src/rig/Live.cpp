#include "depthservo/rig/Live.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "observation/ImageObserver.h"
#include "observation/ObservationSetup.h"
#include "observation/makeTracker.h"

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

}  // namespace

Live::Live(const LiveOptions& options, ImageSource& images, TwistStream* twists)
    : options_(options), images_(images), twists_(twists) {
  ObservationOptions& observation = options_.observation;
  observation.tracker = chooseTracker(options.target, observation.tracker, options.name);
  observation.motion = twists ? MotionSource::twist : MotionSource::target;
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
  while (images_.next(image)) {
    if (static_cast<int>(image.image.getWidth()) != options_.camera.width ||
        static_cast<int>(image.image.getHeight()) != options_.camera.height) {
      throw InputError(
          {options_.name, 0, ""},
          fmt::format("the camera has {}x{} pixels, the image has {}x{}", options_.camera.width,
                      options_.camera.height, image.image.getWidth(), image.image.getHeight()));
    }
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
                     images_.whyEnded().empty() ? "no image" : "no image: " + images_.whyEnded());
  }
  if (options_.keepsLog) keep("last");
  observer.finish(log);
  if (log.reason.empty()) log.reason = images_.whyEnded();
  if (twists_) {
    const TwistStream::Counts& c = twists_->counts();
    log.reason += fmt::format("; twists: {} rows, refused {} malformed, {} torn, {} not later",
                              c.rows, c.malformed, c.torn, c.notLater);
  }
  log.events.push_back({last_s, log.reason});
  return log;
}

}  // namespace depthservo
