#include "depthservo/rig/observe.h"

#include "depthservo/observation/UnexcitedPeriods.h"

namespace depthservo {
namespace {

constexpr std::size_t kLastFrames = 600;

/// The first image, and the last so far.
void keepImage(RunLog& log, const Exposure& exposure) {
  const auto& image = exposure.image;
  std::vector<unsigned char> bytes(image.bitmap, image.bitmap + image.getSize());
  if (log.images.size() < 2) {
    log.images.emplace_back(log.images.empty() ? "first" : "last", std::move(bytes));
  } else {
    log.images.back().second = std::move(bytes);
  }
}

}  // namespace

void takeEvents(RunLog& log, Rig& rig, Observer& observer) {
  for (Event& event : rig.takeEvents()) log.events.push_back(std::move(event));
  for (Event& event : observer.takeEvents()) log.events.push_back(std::move(event));
}

void forgetTheOld(RunLog& log) {
  if (log.frames.size() < kLastFrames) return;
  log.frames.erase(log.frames.begin(), log.frames.begin() + kLastFrames / 2);
  log.events.clear();
}

void append(RunLog& log, FrameRecord frame, const Exposure& exposure, Keep keep) {
  if (keep == Keep::everything && exposure.hasImage()) {
    keepImage(log, exposure);
    log.film.add(exposure.time_s, exposure.image);
  }
  log.frames.push_back(std::move(frame));
}

RunLog observe(Rig& rig, Observer& observer, RunWatcher* watcher, Keep keep) {
  RunLog log;
  log.camera = rig.source().camera;
  while (const auto exposure = rig.next()) {
    if (keep != Keep::everything) forgetTheOld(log);
    rig.readOdometry(observer.odometry(), exposure->time_s);
    FrameRecord frame = observer.observe(*exposure);
    rig.describe(frame);
    takeEvents(log, rig, observer);
    append(log, std::move(frame), *exposure, keep);
    if (watcher && !watcher->onFrame({log.frames.back(), *exposure, log, rig})) {
      log.reason = "stopped by the user";
      break;
    }
  }
  takeEvents(log, rig, observer);
  if (log.reason.empty()) log.reason = rig.whyEnded();
  if (keep == Keep::everything) log.odometry = rig.odometry();
  observer.finish(log);
  addUnexcitedEvents(log);
  return log;
}

}  // namespace depthservo
