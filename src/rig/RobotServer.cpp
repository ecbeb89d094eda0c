#include "depthservo/rig/RobotServer.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <fstream>
#include <optional>
#include <thread>

#include "depthservo/rig/SimulatedRig.h"
#include "depthservo/sequence/CommandStream.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/text/NewFolder.h"
#include "robots/limits.h"
#include "sequence/ImagePipe.h"
#include "sequence/PipeWriter.h"
#include "sequence/systemTime.h"
#include "sequence/twistLine.h"

namespace depthservo {
namespace {

using Clock = std::chrono::steady_clock;
using detail::PipeWriter;
using detail::systemTime_s;

constexpr double kSlice_s = 0.02;      // in which somebody may ask to stop
constexpr double kAfterwards_s = 0.5;  // the robot is watched so long when it stands for good
constexpr std::size_t kMostAwaited = 1000;

SimulatedRigOptions withStrongDrives(SimulatedRigOptions rig) {
  RobotLimits& limits = rig.robot.limits;
  limits.dv = std::max(limits.dv, limits.brake_v);
  limits.dw = std::max(limits.dw, limits.brake_w);
  return rig;
}

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// An image whose command has not come yet.
struct Awaited {
  double stamp_s;
  Clock::time_point taken;
};

}  // namespace

struct RobotServer::Parts : Rig::Listener {
  Parts(const SimulatedRigOptions& r, const RobotServerOptions& o, const std::string& place)
      : options(o),
        hasGoal(r.robot.goal.has_value()),
        rig(withStrongDrives(r), place),
        braking(velocityLimits(r.robot.type, r.robot.limits).braking),
        images(o.images),
        twists(o.twist),
        commandPipe(o.command),
        commands(o.command, braking.size()),
        command(Velocities::Zero(braking.size())) {
    if (o.log.empty()) return;
    requireNewFile(o.log);
    log.open(o.log);
    log << "timestamp,x,y,theta";
    for (const std::string& name : rig.robot()->velocityNames()) log << ',' << shortName(name);
    for (const std::string& name : rig.robot()->velocityNames()) {
      log << ",commanded_" << shortName(name);
    }
    log << ",expired\n";
    if (!log) throw notWritten(o.log);
  }

  bool isStopped() const { return options.stop && *options.stop; }
  bool awaitReader();
  void onRow(double time_s) override;
  void waitUntil(double time_s);
  void take(double wait_s);
  void follow(double time_s);
  void logRow(double time_s, bool isExpired);
  void writeRows();
  void write(const Exposure& exposure);
  bool awaitCommand(double image_s);
  bool isOver(double time_s);
  void serve();
  double goalError() const;

  RobotServerOptions options;
  bool hasGoal;
  SimulatedRig rig;
  Velocities braking;
  PipeWriter images, twists;
  detail::MadePipe commandPipe;
  CommandReader commands;
  std::ofstream log;
  Velocities command;
  std::optional<CommandRow> last;
  Clock::time_point lastArrival, start;
  double epoch_s = 0;  // of the system's clock at the start
  double rowTime_s = 0, stands_s = 0;
  bool isHeld = false;    // for want of a command, after it had moved
  bool hasMoved = false;  // was commanded to
  bool hasRows = false;
  std::size_t rowsWritten = 0;
  std::deque<Awaited> awaited;
  std::string bytes;
  RobotServerReport report;
};

RobotServer::RobotServer(const SimulatedRigOptions& rig, const RobotServerOptions& options,
                         const std::string& place)
    : parts_(std::make_unique<Parts>(rig, options, place)) {}

RobotServer::~RobotServer() = default;

/// False: nobody reads the images.
bool RobotServer::Parts::awaitReader() {
  const auto begin = Clock::now();
  while (!images.open()) {
    if (isStopped() || secondsSince(begin) > options.wait_s) return false;
    std::this_thread::sleep_for(std::chrono::duration<double>(kSlice_s));
  }
  return true;
}

/// Commands that come meanwhile are taken as they come.
void RobotServer::Parts::waitUntil(double time_s) {
  for (;;) {
    const double left_s = time_s - secondsSince(start);
    images.flush();
    if (!(left_s > 0) || isStopped()) return take(0);
    if (commands.isEnded()) {
      take(0);
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left_s, kSlice_s)));
    } else {
      take(std::max(1e-3, std::min(left_s, kSlice_s)));
    }
  }
}

void RobotServer::Parts::take(double wait_s) {
  for (CommandRow& row : commands.read(wait_s)) {
    lastArrival = Clock::now();
    for (; !awaited.empty() && awaited.front().stamp_s <= row.image_s; awaited.pop_front()) {
      const bool isItsOwn = awaited.front().stamp_s == row.image_s;
      if (isItsOwn && !options.isLockstep) report.latency.add(secondsSince(awaited.front().taken));
    }
    last = std::move(row);
    hasMoved = hasMoved || !last->velocities.isZero(0);
  }
}

/// The command of now, or a braking one where it has expired.
void RobotServer::Parts::follow(double time_s) {
  const double now_s = epoch_s + time_s;
  const bool isAlive = last && (options.isLockstep || (now_s <= last->time_s + last->ttl_s &&
                                                       secondsSince(lastArrival) <= last->ttl_s));
  if (isAlive) {
    command = last->velocities;
  } else {
    command *= brakingFactor(command, braking, time_s - rowTime_s);
    if (last && !isHeld) ++report.watchdogStops;
  }
  isHeld = last && !isAlive;
  rowTime_s = time_s;
  rig.command(command);
}

void RobotServer::Parts::onRow(double time_s) {
  if (!options.isLockstep) waitUntil(time_s);
  writeRows();
  logRow(time_s, isHeld);
  follow(time_s);
}

void RobotServer::Parts::logRow(double time_s, bool isExpired) {
  if (!log.is_open()) return;
  FrameRecord now;
  rig.describe(now);
  log << fmt::format("{:.9f},{},{},{}", epoch_s + time_s, now.robotPose.x(), now.robotPose.y(),
                     now.robotPose.z());
  for (const double v : now.applied) log << fmt::format(",{}", v);
  for (const double v : command) log << fmt::format(",{}", v);
  log << (isExpired ? ",1" : ",0") << std::endl;  // who is killed leaves whole lines
}

/// Rows of odometry that are known by now.
void RobotServer::Parts::writeRows() {
  if (!hasRows) {
    const std::string header = std::string(detail::kTwistHeader) + "\n";
    hasRows = twists.write(header) == PipeWriter::Written::whole;
  }
  const auto& rows = rig.odometry();
  for (; rowsWritten < rows.size(); ++rowsWritten) {
    const OdometryRow& row = rows[rowsWritten];
    twists.write(detail::twistLine(epoch_s + row.time_s, row.twist));
    ++report.rows;
    if (options.isLockstep) twists.flush(options.wait_s);
  }
}

void RobotServer::Parts::write(const Exposure& exposure) {
  writeRows();
  const double stamp_s = fileTime(epoch_s + exposure.time_s);
  if (!options.isLockstep) waitUntil(rig.time());
  bytes.clear();
  detail::appendTo(bytes, stamp_s, exposure.image);
  const auto written = images.write(bytes);
  if (written == PipeWriter::Written::whole) {
    ++report.images;
    if (awaited.size() == kMostAwaited) awaited.pop_front();
    awaited.push_back({stamp_s, start + std::chrono::duration_cast<Clock::duration>(
                                            std::chrono::duration<double>(exposure.time_s))});
  } else if (written == PipeWriter::Written::dropped) {
    ++report.dropped;
    if (!hasMoved) ++report.droppedAtStart;
  }
  if (options.isLockstep) images.flush(options.wait_s);
}

/// Lockstep: false when the command of this image does not come.
bool RobotServer::Parts::awaitCommand(double image_s) {
  const auto begin = Clock::now();
  while (!(last && last->image_s >= image_s)) {
    if (isStopped()) report.whyEnded = "stopped by the user";
    if (isStopped() || commands.isEnded()) return false;
    if (secondsSince(begin) > options.wait_s) {
      report.whyEnded = fmt::format("no command for {:g} s", options.wait_s);
      return false;
    }
    take(kSlice_s);
  }
  return true;
}

bool RobotServer::Parts::isOver(double time_s) {
  if (isStopped()) {
    report.whyEnded = "stopped by the user";
    return true;
  }
  if (!commands.isEnded() || !rig.robot()->velocity().isZero(0)) {
    stands_s = time_s;
    return false;
  }
  report.whyEnded = "whoever commanded has gone, and the robot stands";
  return time_s - stands_s > kAfterwards_s;
}

double RobotServer::Parts::goalError() const {
  if (!hasGoal) return kUnknown;
  const auto now = rig.truth(), goal = rig.truthAtGoal();
  double squared = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    squared += std::pow(now[i].u - goal[i].u, 2) + std::pow(now[i].v - goal[i].v, 2);
  }
  return std::sqrt(squared / static_cast<double>(now.size()));
}

void RobotServer::Parts::serve() {
  if (!awaitReader()) {
    report.whyEnded = isStopped() ? "stopped by the user" : "nobody reads the images";
    return;
  }
  start = Clock::now();
  if (!options.isLockstep) epoch_s = fileTime(systemTime_s());
  while (!isOver(rig.time())) {
    const auto exposure = rig.next(this);
    if (!exposure) {
      report.whyEnded = rig.whyEnded();
      return;
    }
    write(*exposure);
    if (!options.isLockstep || awaitCommand(fileTime(exposure->time_s))) continue;
    if (!commands.isEnded()) return;
    last.reset();
  }
}

RobotServerReport RobotServer::run() {
  Parts& p = *parts_;
  p.serve();
  if (p.log.is_open()) p.log.close();
  if (!p.log) throw notWritten(p.options.log);
  FrameRecord end;
  p.rig.describe(end);
  p.report.pose = end.robotPose;
  p.report.velocity = end.applied;
  p.report.duration_s = p.rig.time();
  p.report.commands = p.commands.rows();
  p.report.refused = p.commands.refused();
  p.report.goalError_px = p.goalError();
  return std::move(p.report);
}

}  // namespace depthservo
