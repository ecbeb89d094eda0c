#include "depthservo/servo/RobotRig.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "depthservo/sequence/SequenceWriter.h"
#include "robots/limits.h"
#include "robots/makeRobot.h"
#include "sequence/systemTime.h"
#include "servo/ImageCheck.h"
#include "visp/pose.h"

namespace depthservo {
namespace {

using Clock = std::chrono::steady_clock;
using detail::systemTime_s;

constexpr double kSameClock_s = 5;  // images that are no older carry the system's clock
constexpr int kLastZeros = 3;       // commands of zero at the end

double steadyTime_s() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

SafetyLimits limitsOf(const RobotOptions& robot) {
  const RobotVelocityLimits limits = velocityLimits(robot.type, robot.limits);
  return {limits.velocity, limits.acceleration, limits.braking};
}

/// What the estimator's gates made of the last measurements. (A filter that starts a point anew
/// after some rejections takes one now and then.)
class Gates {
 public:
  void add(double time_s, int accepted, int rejected) {
    constexpr double kWindow_s = 0.2;
    images_.push_back({time_s, accepted, rejected});
    while (images_.front().time_s < time_s - kWindow_s) images_.pop_front();
  }

  /// Whether more than half were rejected.
  bool areShut() const {
    int accepted = 0, rejected = 0;
    for (const Image& image : images_) accepted += image.accepted, rejected += image.rejected;
    return rejected > accepted;
  }

 private:
  struct Image {
    double time_s;
    int accepted, rejected;
  };
  std::deque<Image> images_;
};

}  // namespace

struct RobotRig::Parts {
  Parts(LiveRig& c, const RobotRigOptions& o)
      : options(o),
        camera(c),
        model(makeRobot(o.robot, o.robot.initial)),
        writer(o.sink ? nullptr
                      : std::make_unique<CommandWriter>(o.command, model->velocityNames())),
        sink(o.sink ? *o.sink : *writer),
        safety(limitsOf(o.robot), o.safety),
        wanted(Velocities::Zero(model->velocity().size())) {}

  // The loop's side.
  bool isStopped() const { return options.stop && *options.stop; }
  bool isOver();
  void noteLostCamera();
  void take(const Exposure& exposure);
  void skip(double time_s);

  // Under the lock.
  double now_s() const;
  SafetyInput inputs() const;
  void step();
  void write();
  void runThread();
  void note(std::string what) { events.push_back({now_s(), std::move(what)}); }

  RobotRigOptions options;
  LiveRig& camera;
  std::unique_ptr<SimulatedRobot> model;
  std::unique_ptr<CommandWriter> writer;  // null: somebody else has one
  CommandSink& sink;
  ImageCheck check;
  bool hasOdometry = false;  // before it comes images are of no use
  std::string reason;        // why the images have ended
  Eigen::Isometry3d cameraPose = Eigen::Isometry3d::Identity();
  double lastImage_s = kUnknown, armedAt_s = kUnknown;
  RobotRigCounts counts;

  mutable std::mutex mutex;
  std::condition_variable wake;
  Safety safety;
  Velocities wanted;
  std::vector<Event> events;
  SafetyReason told = SafetyReason::notArmed, endedBy = SafetyReason::none;
  double image_s = kUnknown, imageArrived_s = kUnknown;  // of the newest usable image, and when
  double clock_s = kUnknown;                             // in lockstep: of the newest image
  bool isSystemClock = false;                            // stamps are of the system's clock
  double newestRow_s = kUnknown;
  double wantedImage_s = kUnknown, busySince_s = kUnknown;
  double seen_s = kUnknown, contradictedSince_s = kUnknown;  // of the points, images' clock
  Gates gates;
  bool isFound = false;  // all points, once
  bool hasNews = false, isDone = false;
  std::thread thread;
};

RobotRig::CameraSpeed RobotRig::greatestCameraSpeed(const RobotOptions& robot) {
  constexpr double kMargin = 1.5, kSlack_v = 0.05, kSlack_w = 0.1;
  const auto model = makeRobot(robot, robot.initial);
  const Velocities limits = model->velocityLimits();
  double v = 0, w = 0;
  for (unsigned signs = 0; signs < 1u << limits.size(); ++signs) {
    Velocities velocity = limits;
    for (Eigen::Index i = 0; i < limits.size(); ++i) {
      if (signs >> i & 1u) velocity[i] = -velocity[i];
    }
    const Twist twist = model->cameraTwist(velocity);
    v = std::max(v, twist.linear.norm());
    w = std::max(w, twist.angular.norm());
  }
  return {kMargin * v + kSlack_v, kMargin * w + kSlack_w};
}

RobotRig::RobotRig(LiveRig& camera, const RobotRigOptions& options)
    : parts_(std::make_unique<Parts>(camera, options)) {
  if (!options.isLockstep) parts_->thread = std::thread([p = parts_.get()] { p->runThread(); });
}

RobotRig::~RobotRig() { finish(); }

// The loop's side
// ----------------------------------------------------------------------------------

const ObservedSource& RobotRig::source() const { return parts_->camera.source(); }
const std::vector<OdometryRow>& RobotRig::odometry() const { return parts_->camera.odometry(); }
const RobotModel* RobotRig::robot() const { return parts_->model.get(); }
double RobotRig::time() const { return parts_->camera.time(); }
const RobotRigCounts& RobotRig::counts() const { return parts_->counts; }

std::string RobotRig::whyEnded() const {
  return parts_->reason.empty() ? parts_->camera.whyEnded() : parts_->reason;
}

/// Whether the run ends for another reason than its outcome; in that case the reason.
bool RobotRig::Parts::isOver() {
  const std::lock_guard lock(mutex);
  if (isStopped()) {
    reason = "stopped by the user";
    return true;
  }
  if (safety.isArmed() && safety.heldFor_s() > options.safety.give_up) {
    endedBy = safety.reason();
    reason =
        fmt::format("stopped by safety: {}, for {:g} s", wordsOf(endedBy), options.safety.give_up);
    return true;
  }
  if (safety.isArmed() && !isFound && lastImage_s - armedAt_s > options.find_s) {
    reason = fmt::format("the points of the goal were not found within {:g} s", options.find_s);
    return true;
  }
  return false;
}

/// A camera that gives no more images ends the run as a fault does.
void RobotRig::Parts::noteLostCamera() {
  const std::lock_guard lock(mutex);
  if (!safety.isArmed() || !camera.haveImagesEnded()) return;
  endedBy = SafetyReason::image;
  reason = fmt::format("stopped by safety: {}: {}", wordsOf(endedBy), camera.whyEnded());
}

std::optional<Exposure> RobotRig::next(Listener* listener) {
  Parts& p = *parts_;
  for (;;) {
    if (p.isOver()) return std::nullopt;
    std::optional<Exposure> exposure = p.camera.next(listener);
    for (Event& event : p.camera.takeEvents()) note(event.time_s, std::move(event.what));
    {
      const std::lock_guard lock(p.mutex);
      for (Event& event : std::exchange(p.events, {})) note(event.time_s, std::move(event.what));
    }
    if (!exposure) {
      if (!p.isOver()) p.noteLostCamera();
      return std::nullopt;
    }
    p.hasOdometry = p.hasOdometry || p.camera.hasOdometry();
    if (!p.hasOdometry) {
      p.skip(exposure->time_s);
      continue;
    }
    ++p.counts.images;
    const ImageCheck::Verdict verdict = p.check.look(exposure->image);
    p.counts.empty += verdict == ImageCheck::Verdict::empty;
    p.counts.frozen += verdict == ImageCheck::Verdict::frozen;
    if (verdict == ImageCheck::Verdict::usable) {
      p.take(*exposure);
      return exposure;
    }
    p.skip(exposure->time_s);
  }
}

/// In lockstep the robot waits for the command of every image.
void RobotRig::Parts::skip(double time_s) {
  if (!options.isLockstep) return;
  const std::lock_guard lock(mutex);
  wantedImage_s = clock_s = time_s;
  if (std::isnan(image_s)) image_s = time_s;
  step();
  write();
}

void RobotRig::Parts::take(const Exposure& exposure) {
  const std::lock_guard lock(mutex);
  if (std::isnan(image_s))
    isSystemClock = std::abs(systemTime_s() - exposure.time_s) < kSameClock_s;
  image_s = lastImage_s = clock_s = exposure.time_s;
  imageArrived_s = busySince_s = steadyTime_s();
  if (!safety.isArmed() && (!options.arm || *options.arm)) {
    safety.arm();
    armedAt_s = image_s;
    note("armed");
  }
}

void RobotRig::readOdometry(MotionBuffer& odometry, double time_s) {
  Parts& p = *parts_;
  p.camera.readOdometry(odometry, time_s);
  if (!std::isnan(p.check.odometry_s) && time_s > p.check.odometry_s) {
    const auto [motion, coverage] = odometry.motion(p.check.odometry_s, time_s);
    if (coverage == Coverage::complete) {
      p.check.move(motion);
      Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
      step.linear() = motion.R;
      step.translation() = motion.t;
      p.cameraPose = p.cameraPose * step.inverse();
    }
  }
  p.check.odometry_s = time_s;
  const std::lock_guard lock(p.mutex);
  p.newestRow_s = p.camera.newestTwist_s();
}

/// From above, as odometry has it, from where it was at the first image; what was commanded.
void RobotRig::describe(FrameRecord& frame) const {
  const Eigen::Isometry3d& pose = parts_->cameraPose;
  const Eigen::Vector3d axis = pose.linear().col(2);
  frame.robotPose = {pose.translation().z(), -pose.translation().x(),
                     std::atan2(-axis.x(), axis.z())};
  const std::lock_guard lock(parts_->mutex);
  frame.applied = parts_->safety.command();
}

void RobotRig::onObserved(const FrameRecord& frame) {
  Parts& p = *parts_;
  int accepted = 0, rejected = 0;
  for (const FeatureRecord& feature : frame.features) {
    const bool isRejected = feature.estimate.status == DepthStatus::rejected;
    accepted += feature.measured && !isRejected;
    rejected += isRejected;
  }
  const auto points = static_cast<int>(frame.features.size());
  const std::lock_guard lock(p.mutex);
  const bool isComplete = points > 0 && accepted == points;
  if (isComplete && !p.isFound) p.note("all points of the goal are found");
  p.isFound = p.isFound || isComplete;
  if (points > 0 && 2 * accepted >= points) p.seen_s = frame.time_s;
  p.gates.add(frame.time_s, accepted, rejected);
  const bool areShut = p.gates.areShut();
  if (areShut && std::isnan(p.contradictedSince_s)) p.contradictedSince_s = frame.time_s;
  const bool wasStopped = frame.time_s - p.contradictedSince_s > p.options.safety.contradiction;
  if (!areShut && (!wasStopped || isComplete)) p.contradictedSince_s = kUnknown;
}

void RobotRig::command(const Velocities& velocities) {
  Parts& p = *parts_;
  const std::lock_guard lock(p.mutex);
  if (velocities.size() == p.wanted.size()) {
    p.wanted = velocities;
  } else {
    p.wanted.setConstant(kUnknown);
  }
  p.wantedImage_s = p.image_s;
  p.busySince_s = kUnknown;
  if (p.isSystemClock) p.counts.latency.add(systemTime_s() - p.image_s);
  if (p.options.isLockstep) {
    p.step();
    p.write();
  } else {
    p.hasNews = true;
    p.wake.notify_one();
  }
  p.model->drive(p.safety.command(), 1 / p.camera.source().frameRate);
}

bool RobotRig::isHeld() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->safety.reason() != SafetyReason::none || !parts_->isFound;
}

SafetyReason RobotRig::endedBy() const { return parts_->endedBy; }

SafetyReason RobotRig::reason() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->safety.reason();
}

Velocities RobotRig::wanted() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->wanted * commonFactor(parts_->wanted, parts_->model->velocityLimits());
}

void RobotRig::finish() {
  Parts& p = *parts_;
  {
    const std::lock_guard lock(p.mutex);
    if (p.isDone) return;
    p.safety.end();
    p.isDone = true;
    p.hasNews = true;
    p.wake.notify_one();
  }
  if (p.thread.joinable()) return p.thread.join();
  p.wanted.setZero();
  while (!p.safety.isStanding()) {  // on a clock of its own: there are no more images
    p.clock_s += 1 / p.options.rate;
    p.step();
    p.write();
  }
  p.write();
}

// The thread
// ---------------------------------------------------------------------------------------

/// Now, by the clock of the images.
double RobotRig::Parts::now_s() const {
  if (std::isnan(image_s)) return 0;
  if (options.isLockstep) return clock_s;
  return isSystemClock ? systemTime_s() : image_s + steadyTime_s() - imageArrived_s;
}

SafetyInput RobotRig::Parts::inputs() const {
  const double now = now_s();
  SafetyInput input;
  input.time_s = options.isLockstep ? now : steadyTime_s();
  if (std::isnan(image_s)) {  // nothing has come yet
    input.imageAge_s = kUnknown;
    return input;
  }
  input.imageAge_s = now - image_s;
  input.odometryAge_s = now - newestRow_s;
  if (isFound) input.trackAge_s = image_s - seen_s;
  if (!std::isnan(contradictedSince_s)) input.contradictedFor_s = image_s - contradictedSince_s;
  if (!std::isnan(busySince_s) && !options.isLockstep) {
    input.busyFor_s = steadyTime_s() - busySince_s;
  }
  input.unreadFor_s = sink.unread() / options.rate;
  return input;
}

void RobotRig::Parts::step() {
  safety.step(inputs(), wanted);
  const SafetyReason now = safety.reason();
  if (now == told) return;
  if (isFault(now) && safety.isArmed()) note(fmt::format("stopped by safety: {}", wordsOf(now)));
  if (isFault(told) && now == SafetyReason::none) note(fmt::format("goes on: {}", wordsOf(now)));
  told = now;
}

void RobotRig::Parts::write() {
  CommandRow row;
  row.time_s = std::isnan(image_s) && !options.isLockstep ? systemTime_s() : now_s();
  row.ttl_s = options.ttl;
  row.image_s = wantedImage_s;
  row.velocities = safety.command();
  const bool isWritten = sink.write(row);
  ++(isWritten ? counts.commands : counts.unwritten);
}

void RobotRig::Parts::runThread() {
  const auto period =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / options.rate));
  std::unique_lock lock(mutex);
  int zeros = 0;
  while (zeros < kLastZeros) {
    wake.wait_for(lock, period, [&] { return hasNews; });
    hasNews = false;
    step();
    write();
    if (isDone && safety.isStanding()) ++zeros;
  }
}

}  // namespace depthservo
