#include "depthservo/rig/SequenceRecorder.h"

#include <algorithm>
#include <cmath>

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
  auto row = std::isnan(lastRow_s_)
                 ? rows.begin()
                 : std::upper_bound(rows.begin(), rows.end(), lastRow_s_,
                                    [](double t, const OdometryRow& r) { return t < r.time_s; });
  for (; row != rows.end(); ++row) {
    writer_.addOdometry(row->time_s, row->twist);
    lastRow_s_ = row->time_s;
    ++rows_;
  }
  if (keepsCommands_ && frame.record.command.allFinite()) {
    writer_.addCommand({time_s, frame.rig.time(), rows_, frame.record.command},
                       frame.log.commandNames);
  }
  return !next_ || next_->onFrame(frame);
}

}  // namespace depthservo
