#include "depthservo/rig/Record.h"

#include "depthservo/sequence/SequenceWriter.h"
#include "observation/makeEstimator.h"
#include "rig/simulatedSetup.h"

namespace depthservo {
namespace {

/// What makes a replay estimate as the run did.
ReplayHints hintsOf(const Scenario& scenario) {
  const EstimatorOptions& depth = scenario.depth;
  ReplayHints hints;
  if (depth.estimator != EstimatorKind::trueDepth) hints.estimator = toString(depth.estimator);
  hints.prior = depth.initial;
  hints.pixel_noise = scenario.sensing.assumedNoise_px();
  hints.odometry_noise = scenario.odometry.noise;
  hints.odometry_mode = scenario.odometry.mode;
  hints.odometry_scale_sigma = scenario.odometry.scale_sigma;
  hints.focal_sigma = scenario.camera.focal_sigma;
  if (depth.estimator == EstimatorKind::joint) {
    hints.joint = {depth.joint.time_offset, depth.joint.gyro_bias, depth.joint.focal};
  }
  hints.Z_min = depth.Z_min;
  hints.Z_max = depth.Z_max;
  hints.settling = depth.gains.settling;
  hints.W_min = depth.gains.W_min;
  hints.k = depth.gains.k;
  hints.k_3 = depth.gains.k_3;
  if (depth.estimator == EstimatorKind::pose) {
    hints.ke = observerGain(simulatedSetup(scenario, scenario.depth));
    hints.kappa = depth.pose.kappa;
  }
  return hints;
}

class Recorder : public RunWatcher {
 public:
  Recorder(const Scenario& scenario, const std::string& folder, RunWatcher* next)
      : scenario_(scenario), writer_(folder), next_(next) {}

  void onFrame(const RunFrame& frame) override {
    const double time_s = frame.record.time_s;
    if (frame.image) writer_.addImage(time_s, *frame.image);
    for (const FeatureRecord& feature : frame.record.features) {
      if (!frame.image && feature.measured) {
        writer_.addTrack(time_s, {feature.id, feature.u, feature.v});
      }
      writer_.addTruth(time_s, {feature.id, feature.Z_true});
    }
    writer_.addPose(time_s, frame.wMc);
    for (; rows_ < frame.odometry.size(); ++rows_) {
      writer_.addOdometry(frame.odometry[rows_].time_s, frame.odometry[rows_].twist);
    }
    if (next_) next_->onFrame(frame);
  }

  void finish(const std::vector<PixelPoint>& dots) {
    SequenceSettings settings{scenario_.name, scenario_.camera.pinhole(), scenario_.target.dots(),
                              dots, hintsOf(scenario_)};
    if (scenario_.target.type == TargetKind::apriltag) {
      settings.tags = scenario_.target.assumedTags();
      settings.dots.clear();
    }
    writer_.finish(settings);
  }

 private:
  const Scenario& scenario_;
  SequenceWriter writer_;
  RunWatcher* next_;
  std::size_t rows_ = 0;
};

}  // namespace

RunLog record(const Scenario& scenario, const std::string& folder, RunWatcher* watcher) {
  Recorder recorder(scenario, folder, watcher);
  ServoLoop loop(scenario);
  RunLog log = loop.run(&recorder);
  recorder.finish(loop.starts());
  return log;
}

}  // namespace depthservo
