#include "observation/MotionSuspects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace depthservo {
namespace {

using Cause = ConsistencyMonitor::Cause;

/// As much of a log as it takes to tell.
constexpr std::size_t kMostFrames = 600, kMostPoints = 12;

/// Clocks are tried so far apart, in such steps [s].
constexpr double kMostOffset_s = 2, kOffsetStep_s = 0.05, kFineStep_s = 0.01;

/// A suspect explains the images when it leaves at most this share of rejected measurements, and
/// this share of the NIS that the motion as given has.
constexpr double kMostRejected = 0.1, kMostNis = 0.3;

/// Odometry as it would be if a usual mistake had been made.
struct MotionSuspect {
  Cause cause;       // frame, clock, unit or poseConvention
  double size = 0;   // see Cause
  std::string what;  // "the twists are in robot axes (x forward, y left, z up)"
  std::vector<OdometryRow> rows;
};

/// Columns: where x, y, z of a robot (x forward, y left, z up) are in the camera's frame.
Eigen::Matrix3d cameraRrobot() {
  Eigen::Matrix3d R;
  R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return R;
}

template <class Change>
MotionSuspect changed(Cause cause, double size, const char* what,
                      const std::vector<OdometryRow>& rows, const Change& change) {
  MotionSuspect suspect{cause, size, what, rows};
  for (OdometryRow& row : suspect.rows) change(row.twist);
  return suspect;
}

std::vector<OdometryRow> shifted(std::vector<OdometryRow> rows, double by_s) {
  for (OdometryRow& row : rows) row.time_s += by_s;
  return rows;
}

/// Lets the monitor judge a log with other odometry.
class Trial {
 public:
  /// \param noise times the pixel noise as declared
  Trial(const RunLog& log, const ObservationOptions& options, double noise = 1)
      : options_(options), meaning_(log.rows) {
    std::set<int> ids;
    for (std::size_t k = 0; k < std::min(kMostFrames, log.frames.size()); ++k) {
      frames_.push_back({log.frames[k].time_s, {}});
      for (const FeatureRecord& f : log.frames[k].features) {
        if (!f.measured || (ids.size() == kMostPoints && !ids.count(f.id))) continue;
        ids.insert(f.id);
        const Eigen::Vector2d s = log.camera.normalise(f.u, f.v);
        frames_.back().seen.push_back(
            {f.id, {s.x(), s.y(), noise * f.sigma_px / log.camera.focal_px(s.x(), s.y())}});
      }
    }
  }

  ConsistencyMonitor::Total judge(const std::vector<OdometryRow>& rows) const {
    ConsistencyMonitor::Options monitorOptions;
    monitorOptions.filter.odometry = options_.odometryNoise.value_or(OdometryNoise());
    ConsistencyMonitor monitor(kMostPoints, monitorOptions, options_.prior(),
                               options_.depth.range());
    MotionBuffer odometry(std::max<std::size_t>(2, rows.size()));
    odometry.setMeaning(meaning_);
    for (const OdometryRow& row : rows) odometry.push(row.time_s, row.twist);
    double last_s = kUnknown;
    for (const Frame& frame : frames_) {
      const auto [motion, coverage] = odometry.motion(last_s, frame.time_s);
      if (coverage == Coverage::complete) monitor.predict(motion);
      const bool isUsable = odometry.coverage(frame.time_s, frame.time_s) == Coverage::complete;
      last_s = isUsable ? frame.time_s : kUnknown;
      if (!isUsable || coverage != Coverage::complete) monitor.forgetPoints();
      if (isUsable) monitor.correct(frame.seen);
    }
    return monitor.total();
  }

 private:
  struct Frame {
    double time_s;
    std::vector<PointObservation> seen;
  };
  const ObservationOptions& options_;
  RowMeaning meaning_;
  std::vector<Frame> frames_;
};

/// The clock offset that explains the images best.
MotionSuspect suspectClock(const Trial& trial, const std::vector<OdometryRow>& rows) {
  const auto best = [&](double from_s, double to_s, double step_s) {
    double offset_s = 0, least = HUGE_VAL;
    for (int i = 0; i <= std::lround((to_s - from_s) / step_s); ++i) {
      const double candidate_s = from_s + i * step_s;
      const ConsistencyMonitor::Total total = trial.judge(shifted(rows, candidate_s));
      if (total.accepted + total.rejected == 0 || !(total.meanNis < least)) continue;
      least = total.meanNis;
      offset_s = candidate_s;
    }
    return offset_s;
  };
  const double coarse_s = best(-kMostOffset_s, kMostOffset_s, kOffsetStep_s);
  const double offset_s = best(coarse_s - kOffsetStep_s, coarse_s + kOffsetStep_s, kFineStep_s);
  return {Cause::clock, offset_s,
          fmt::format("the odometry's clock is {:.2f} s {} that of the images", std::abs(offset_s),
                      offset_s > 0 ? "behind" : "ahead of"),
          shifted(rows, offset_s)};
}

/// Whether more pixel noise than declared explains the images with the motion as given: a sentence.
std::string suspectNoise(const RunLog& log, const ObservationOptions& options,
                         const std::vector<OdometryRow>& rows,
                         const ConsistencyMonitor::Total& given) {
  constexpr double kMostLeft = 0.02;  // rejected; white noise leaves fewer
  for (const int factor : {2, 3, 5}) {
    const ConsistencyMonitor::Total total = Trial(log, options, factor).judge(rows);
    if (total.accepted == 0 || total.rejectedShare() > kMostLeft) continue;
    return fmt::format(
        "They are explained if the pixel noise is {} times what was declared: then {:.1f} % are "
        "rejected (now {:.0f} %); measure it with 'depthservo noise'",
        factor, 100 * total.rejectedShare(), 100 * given.rejectedShare());
  }
  return "";
}

std::vector<MotionSuspect> suspectTwists(const std::vector<OdometryRow>& rows) {
  const Eigen::Matrix3d R = cameraRrobot();
  static constexpr double kDegree = M_PI / 180;
  return {
      changed(Cause::frame, 0, "the twists are in robot axes (x forward, y left, z up)", rows,
              [&](Twist& t) {
                t = {R * t.linear, R * t.angular};
              }),
      changed(Cause::frame, 0, "the twists are in axes x forward, y right, z down", rows,
              [](Twist& t) {
                t = {{t.linear.y(), t.linear.z(), t.linear.x()},
                     {t.angular.y(), t.angular.z(), t.angular.x()}};
              }),
      changed(Cause::frame, 0, "the twists have the opposite sign (the target's in the camera)",
              rows,
              [](Twist& t) {
                t = {-t.linear, -t.angular};
              }),
      changed(Cause::frame, 0, "the linear velocities have the opposite sign", rows,
              [](Twist& t) { t.linear = -t.linear; }),
      changed(Cause::frame, 0, "the angular velocities have the opposite sign", rows,
              [](Twist& t) { t.angular = -t.angular; }),
      changed(Cause::frame, 0, "the angular velocities stand before the linear ones", rows,
              [](Twist& t) { std::swap(t.linear, t.angular); }),
      changed(Cause::unit, kDegree, "the angular velocities are in degrees per second", rows,
              [](Twist& t) { t.angular *= kDegree; }),
  };
}

std::vector<MotionSuspect> suspectPoses(const std::vector<CameraPose>& poses) {
  const auto suspect = [&](const char* what, const auto& change) {
    std::vector<CameraPose> other = poses;
    for (CameraPose& pose : other) pose.wMc = change(pose.wMc);
    return MotionSuspect{Cause::poseConvention, 0, what, odometryFromPoses(other)};
  };
  const auto reordered = [](const Eigen::Isometry3d& pose) {
    const Eigen::Quaterniond q(pose.linear());
    Eigen::Isometry3d other = pose;  // x y z w were read from w x y z
    other.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
    return other;
  };
  Eigen::Isometry3d robot = Eigen::Isometry3d::Identity(), openGl = robot;
  robot.linear() = cameraRrobot().transpose();
  openGl.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  using Pose = Eigen::Isometry3d;
  return {
      suspect("the poses are those of the world in the camera: invert them",
              [](const Pose& M) -> Pose { return M.inverse(); }),
      suspect("the quaternions have w first", reordered),
      suspect("the quaternions have w first and the poses are those of the world in the camera",
              [&](const Pose& M) -> Pose { return reordered(M).inverse(); }),
      suspect("the poses are those of a robot (x forward, y left, z up)",
              [&](const Pose& M) -> Pose { return M * robot; }),
      suspect("the poses have the camera axes of OpenGL (y up, z backward)",
              [&](const Pose& M) -> Pose { return M * openGl; }),
  };
}

bool isUnexplained(const RunLog& log) {
  return log.diagnosis && log.diagnosis->latest.cause == Cause::motion && !log.frames.empty();
}

/// Those that the images of a trial need, with any clock that is tried: of an hour of odometry a
/// minute.
std::vector<OdometryRow> rowsToTry(const RunLog& log, const std::vector<OdometryRow>& rows) {
  constexpr double kSlack_s = 1;  // for a row that holds
  const double last_s = log.frames[std::min(kMostFrames, log.frames.size()) - 1].time_s;
  const auto end = std::find_if(rows.begin(), rows.end(), [&](const OdometryRow& row) {
    return row.time_s > last_s + kMostOffset_s + kSlack_s;
  });
  return {rows.begin(), end};
}

void explain(RunLog& log, const ObservationOptions& options, const std::vector<OdometryRow>& rows,
             const std::vector<MotionSuspect>& suspects) {
  const Trial trial(log, options);
  const ConsistencyMonitor::Total given = trial.judge(rows);
  std::optional<MotionSuspect> best;
  ConsistencyMonitor::Total bestTotal;
  const auto consider = [&](const MotionSuspect& suspect) {
    const ConsistencyMonitor::Total total = trial.judge(suspect.rows);
    const bool explains = total.accepted > 0 && total.rejectedShare() < kMostRejected &&
                          total.meanNis < kMostNis * given.meanNis;
    if (!explains || (best && total.meanNis >= bestTotal.meanNis)) return;
    best = suspect;
    bestTotal = total;
  };
  for (const MotionSuspect& suspect : suspects) consider(suspect);
  if (!best) {
    if (const std::string noise = suspectNoise(log, options, rows, given); !noise.empty()) {
      log.diagnosis->explanation = noise;
      return;
    }
    consider(suspectClock(trial, rows));
  }
  if (!best) {
    log.diagnosis->explanation =
        "No usual mistake (axes, signs, order, degrees, inverted poses, w first, a clock apart by "
        "up to 2 s) explains them either";
    return;
  }
  log.diagnosis->latest.cause = best->cause;
  log.diagnosis->latest.size = best->size;
  log.diagnosis->explanation =
      fmt::format("They are explained if {}: then {:.1f} % are rejected (now {:.0f} %)", best->what,
                  100 * bestTotal.rejectedShare(), 100 * given.rejectedShare());
}

}  // namespace

void explainMotion(RunLog& log, const ObservationOptions& options,
                   const std::vector<OdometryRow>& rows) {
  if (!isUnexplained(log) || rows.empty()) return;
  const std::vector<OdometryRow> tried = rowsToTry(log, rows);
  explain(log, options, tried, suspectTwists(tried));
}

void explainMotion(RunLog& log, const ObservationOptions& options,
                   const std::vector<CameraPose>& poses) {
  if (!isUnexplained(log)) return;
  const std::vector<OdometryRow> rows = odometryFromPoses(poses);
  if (!rows.empty()) explain(log, options, rows, suspectPoses(poses));
}

}  // namespace depthservo
