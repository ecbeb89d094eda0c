#include "depthservo/rig/SequenceRecorder.h"

namespace depthservo {

bool SequenceRecorder::onFrame(const RunFrame& frame) {
  const double time_s = frame.record.time_s;
  const Exposure& exposure = frame.exposure;
  if (exposure.hasImage()) writer_.addImage(time_s, exposure.image);
  for (const TrackedPoint& point : exposure.points) {
    writer_.addTrack(time_s, {point.id, point.u, point.v});
  }
  if (!exposure.truth.empty()) {
    for (const FeatureRecord& feature : frame.record.features) {
      writer_.addTruth(time_s, {feature.id, feature.Z_true});
    }
  }
  if (exposure.wMc) writer_.addPose(time_s, *exposure.wMc);
  const auto& rows = frame.rig.odometry();
  for (; rows_ < rows.size(); ++rows_) {
    writer_.addOdometry(rows[rows_].time_s, rows[rows_].twist);
  }
  return !next_ || next_->onFrame(frame);
}

}  // namespace depthservo
