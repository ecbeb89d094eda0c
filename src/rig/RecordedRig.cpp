#include "depthservo/rig/RecordedRig.h"

#include <fmt/format.h>

#include <algorithm>

#include "motion/median.h"
#include "depthservo/observation/words.h"
#include "observation/MotionSuspects.h"
#include "observation/ObserverSetup.h"
#include "rig/RowQueue.h"

namespace depthservo {
namespace {

/// Far from any pose nobody knows where the camera was, as the data sets' own tools have it
/// (associate.py).
constexpr double kFarFromPose_s = 0.02;

[[noreturn]] void refuse(const Sequence& sequence, const std::string& message) {
  throw InputError({sequence.folder(), 0, ""}, message);
}

MotionSource chooseMotion(const Sequence& sequence, MotionSource wanted) {
  const bool hasTwist = !sequence.odometry().empty();
  const bool hasPoses = sequence.poses().size() > 1;
  const bool hasTarget = sequence.target().points.size() >= 4;
  if (wanted == MotionSource::automatic) {
    wanted = hasTwist   ? MotionSource::twist
             : hasPoses ? MotionSource::groundtruth
                        : MotionSource::target;
    if (wanted == MotionSource::target && !hasTarget) {
      refuse(sequence,
             "the camera's motion is unknown: needs " + sequence.motionSources() +
                 " or a target of at least four points in sequence.yaml (or --target FILE)");
    }
  }
  if (wanted == MotionSource::twist && !hasTwist)
    refuse(sequence, isBag(sequence.folder())
                         ? "--motion twist needs a topic of velocities: --topics odometry=TOPIC"
                         : "--motion twist needs twist.csv");
  if (wanted == MotionSource::groundtruth && !hasPoses) {
    if (isBag(sequence.folder())) {
      refuse(sequence, "--motion groundtruth needs a topic of poses: --topics poses=TOPIC");
    }
    refuse(sequence,
           "--motion groundtruth needs ground truth with at least two poses (groundtruth.txt, "
           "*.gt.freiburg or mav0/state_groundtruth_estimate0/data.csv)");
  }
  if (wanted == MotionSource::target && !hasTarget) {
    refuse(sequence, "--motion target needs a target of at least four points in sequence.yaml");
  }
  return wanted;
}

}  // namespace

struct RecordedRig::Parts {
  Parts(const Sequence& s, const ObservationOptions& asked)
      : sequence(s), source(ObservedSource::of(s)), options(withTracker(source, asked)) {
    options.motion = chooseMotion(sequence, options.motion);
    if (options.motion == MotionSource::twist) offer(sequence.odometry());
    if (options.motion == MotionSource::groundtruth) {
      offer(odometryFromPoses(sequence.poses()));
      gaps = gapsOf(sequence.poses());
    }
  }

  void offer(const std::vector<OdometryRow>& odometry) {
    for (const OdometryRow& row : odometry) waiting.offer(row);
    source.rowPeriod_s =
        detail::medianPeriod(odometry, [](const OdometryRow& row) { return row.time_s; });
  }

  /// The gap without poses in whose midst this time lies; null: there is none.
  const TimeSpan* gapAt(double t) const {
    const auto gap = std::find_if(gaps.begin(), gaps.end(), [&](const TimeSpan& g) {
      return std::min(t - g.from_s, g.to_s - t) >= kFarFromPose_s;
    });
    return gap == gaps.end() ? nullptr : &*gap;
  }

  const Sequence& sequence;
  ObservedSource source;
  ObservationOptions options;  // tracker and motion chosen
  RowQueue waiting;
  std::vector<OdometryRow> rows;
  std::vector<TimeSpan> gaps;
  const TimeSpan* noted = nullptr;
  std::size_t frame = 0;
  double time_s = 0;
};

RecordedRig::RecordedRig(const Sequence& sequence, const ObservationOptions& options)
    : parts_(std::make_unique<Parts>(sequence, options)) {}

RecordedRig::~RecordedRig() = default;

const ObservationOptions& RecordedRig::options() const { return parts_->options; }
const ObservedSource& RecordedRig::source() const { return parts_->source; }
const std::vector<OdometryRow>& RecordedRig::odometry() const { return parts_->rows; }
double RecordedRig::time() const { return parts_->time_s; }

std::optional<Exposure> RecordedRig::next(Listener*) {
  Parts& p = *parts_;
  if (p.frame == p.sequence.frames().size()) return std::nullopt;
  const std::size_t k = p.frame++;
  const SequenceFrame& recorded = p.sequence.frames()[k];
  Exposure exposure;
  exposure.time_s = p.time_s = recorded.time_s;
  if (p.options.tracker == TrackerKind::tracks) {
    for (const PixelPoint& point : recorded.tracks) {
      exposure.points.push_back({point.id, point.u, point.v});
    }
  } else {
    exposure.image = p.sequence.readImage(k);
  }
  for (const TrueDepth& point : recorded.truth) exposure.truth.push_back({point.id, point.Z});
  if (auto depth = p.sequence.readDepth(k)) {
    exposure.depth = std::make_shared<const DepthMap>(std::move(*depth));
  }
  const TimeSpan* gap = p.gapAt(exposure.time_s);
  exposure.isMotionKnown = gap == nullptr;
  if (gap && gap != p.noted) {
    note(exposure.time_s,
         fmt::format("no pose for {:.3g} s: images are not used", gap->to_s - gap->from_s));
  }
  if (gap) p.noted = gap;
  return exposure;
}

void RecordedRig::readOdometry(MotionBuffer& odometry, double time_s) {
  parts_->waiting.readInto(odometry, time_s, parts_->rows);
}

RunLog replay(const Sequence& sequence, const ObservationOptions& options, RunWatcher* watcher) {
  RecordedRig rig(sequence, options);
  Observer observer(rig.source(), rig.options());
  RunLog log = observe(rig, observer, watcher);
  log.command = "replay";
  log.name = sequence.name();
  log.configuration = configurationOf(rig.options());
  if (rig.options().motion == MotionSource::twist) {
    explainMotion(log, rig.options(), sequence.odometry());
  } else if (rig.options().motion == MotionSource::groundtruth) {
    explainMotion(log, rig.options(), sequence.poses());
  }
  return log;
}

}  // namespace depthservo
