#include "depthservo/rig/SimulatedRig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "depthservo/sequence/SequenceWriter.h"
#include "observation/Spares.h"
#include "rig/CameraClock.h"
#include "rig/World.h"

namespace depthservo {
namespace {

constexpr double kTimeSlack_s = 1e-9;

ObservedSource sourceOf(const SimulatedRigOptions& options, const World& world, std::string place) {
  ObservedSource source{std::move(place), "", options.camera.pinhole(), {}};
  source.settings = source.place;
  source.target.target = options.target.dots();
  if (options.target.type == TargetKind::apriltag) {
    source.target.tags = options.target.assumedTags();
  } else if (options.target.hasBoard()) {
    source.target.board = options.target.boardTarget();
  } else if (options.target.type == TargetKind::dots) {
    for (const TruePoint& point : world.truth()) {
      source.target.dots.push_back({point.id, point.u, point.v});
    }
  }
  source.hasTruth = true;
  source.hasImages = options.sensing.source == SensingSource::image;
  for (std::size_t i = 0; i < options.target.points.size(); ++i) {
    source.ids.push_back(static_cast<int>(i));
  }
  source.frameRate = options.camera.slowest();
  source.fastestRate = options.camera.fastest();
  source.rowPeriod_s = 1 / options.odometry.rate;
  source.rows = options.odometry.rows;
  source.odometryRows = 4096;
  return source;
}

}  // namespace

struct SimulatedRig::Parts {
  Parts(const SimulatedRigOptions& o, std::string place)
      : options(drawnRobot(o)),
        clock(o.camera, o.seed),
        world(options),
        source(sourceOf(options, world, std::move(place))),
        stampJitter(o.seed, ErrorSource::stampJitter) {}

  SimulatedRigOptions options;
  CameraClock clock;
  World world;
  ObservedSource source;
  std::vector<Exposure> underway;  // taken, not yet arrived; few
  Spares<Exposure> spares;         // given back
  std::vector<TruePoint> truth;    // now
  std::size_t rowsRead = 0;
  NoiseStream stampJitter;
  double lastStamp_s = -std::numeric_limits<double>::infinity();

  void drive(double until_s, Listener* listener) {
    world.advanceTo(until_s, [&] {
      if (listener) listener->onRow(world.time());
    });
  }
  void expose();
  double stamp();
  double arrivalOf(const Exposure& exposure) const;
};

SimulatedRig::SimulatedRig(const SimulatedRigOptions& options, const std::string& place) try
    : parts_(std::make_unique<Parts>(options, place)) {
} catch (const std::invalid_argument& why) {
  throw InputError({place, 0, ""}, why.what());
}

SimulatedRig::~SimulatedRig() = default;

std::optional<Exposure> SimulatedRig::next(Listener* listener) {
  Parts& p = *parts_;
  while (true) {
    const double coming_s = p.clock.time();
    const double arrival_s = p.underway.empty() ? std::numeric_limits<double>::infinity()
                                                : p.arrivalOf(p.underway.front());
    if (std::min(coming_s, arrival_s) > p.options.duration + kTimeSlack_s) return std::nullopt;
    if (arrival_s <= coming_s) {
      p.drive(fileTime(arrival_s), listener);
      std::optional<Exposure> exposure(std::move(p.underway.front()));
      p.underway.erase(p.underway.begin());
      return exposure;
    }
    p.drive(coming_s, listener);
    p.world.truth(p.truth);
    if (!p.clock.isDropped()) p.expose();
    p.clock.advance();
    if (listener && !listener->onExposure(coming_s, p.truth)) return std::nullopt;
  }
}

void SimulatedRig::giveBack(Exposure exposure) { parts_->spares.give(std::move(exposure)); }

void SimulatedRig::Parts::expose() {
  const double time_s = stamp();
  if (time_s <= lastStamp_s) return;  // as whoever takes images by their stamps does
  lastStamp_s = time_s;
  Exposure exposure = spares.take();
  exposure.time_s = time_s;
  if (source.hasImages) {
    world.expose(exposure.image);
  } else {
    world.measure(truth, exposure.points);
  }
  exposure.truth = truth;
  exposure.wMc = world.wMc();
  underway.push_back(std::move(exposure));
}

/// Of an image taken now. Stamps stay in order, and none is before the odometry.
double SimulatedRig::Parts::stamp() {
  const ClockStep& step = options.sensing.clock_step;
  const double late_s =
      world.time() + options.sensing.latency + (world.time() < step.at ? 0 : step.by);
  const double jitter_s = options.sensing.stamp_jitter;
  if (jitter_s == 0) return fileTime(late_s);
  const double most_s = 0.4 * (1 - options.camera.jitter) / options.camera.fastest();
  const double drawn_s = std::clamp(jitter_s * stampJitter.next(), -most_s, most_s);
  return fileTime(std::max(0., late_s + drawn_s));
}

/// Where a row does not say how the camera goes on, an image waits for the next.
double SimulatedRig::Parts::arrivalOf(const Exposure& exposure) const {
  const double arrival_s = exposure.time_s + options.sensing.delay;
  if (options.odometry.rows == RowMeaning::hold) return arrival_s;
  const double rate = options.odometry.rate;
  const double row = std::ceil(exposure.time_s * rate - kTimeSlack_s);
  return std::max(arrival_s, fileTime(row / rate));
}

void SimulatedRig::readOdometry(MotionBuffer& odometry, double /*time_s*/) {
  Parts& p = *parts_;
  const auto& rows = p.world.odometry();
  for (; p.rowsRead < rows.size(); ++p.rowsRead) {
    odometry.push(rows[p.rowsRead].time_s, rows[p.rowsRead].twist);
  }
}

void SimulatedRig::describe(FrameRecord& frame) const {
  frame.robotPose = parts_->world.robot().floorPose();
  frame.applied = parts_->world.robot().velocity();
}

std::string SimulatedRig::whyEnded() const {
  return fmt::format("the time is up (duration: {:.6g} s)", parts_->options.duration);
}

bool SimulatedRig::isTargetMoving() const {
  const VelocityProfile& twist = parts_->options.target.twist;
  return !twist.empty() && time() < twist.back().until;
}

const ObservedSource& SimulatedRig::source() const { return parts_->source; }
const std::vector<OdometryRow>& SimulatedRig::odometry() const { return parts_->world.odometry(); }
void SimulatedRig::command(const Velocities& velocities) { parts_->world.setCommand(velocities); }
const RobotModel* SimulatedRig::robot() const { return &parts_->world.robot(); }
double SimulatedRig::time() const { return parts_->world.time(); }
std::vector<TruePoint> SimulatedRig::truth() const { return parts_->world.truth(); }
std::vector<TruePoint> SimulatedRig::truthAtGoal() const { return parts_->world.goal(); }
Eigen::Isometry3d SimulatedRig::cdMo() const { return parts_->world.cdMo(); }
Eigen::Isometry3d SimulatedRig::cMo() const { return parts_->world.cMo(); }
void SimulatedRig::lookFrom(const RobotPose& pose, DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  parts_->world.lookFrom(pose, image);
}
std::vector<std::optional<Eigen::Vector3d>> SimulatedRig::seenFrom(
    const RobotPose& pose, const std::vector<Eigen::Vector2d>& pixels) const {
  return parts_->world.seenFrom(pose, pixels);
}
void SimulatedRig::teach(std::shared_ptr<const TaughtImage> taught) {
  parts_->source.target.taught = std::move(taught);
}

}  // namespace depthservo
