#pragma once

#include <memory>

#include "depthservo/api.h"
#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/rig/observe.h"
#include "depthservo/sequence/Sequence.h"

namespace depthservo {

/// A recorded sequence as a rig: its images or tracks, its odometry, its truth.
class DEPTHSERVO_API RecordedRig : public Rig {
 public:
  /// \param sequence outlives the rig \throw InputError it lacks what the options ask for
  RecordedRig(const Sequence& sequence, const ObservationOptions& options);
  ~RecordedRig() override;

  /// As given, with tracker and motion chosen.
  const ObservationOptions& options() const;

  const ObservedSource& source() const override;
  /// \throw InputError an image cannot be read
  std::optional<Exposure> next(Listener* listener) override;
  void readOdometry(MotionBuffer& odometry, double time_s) override;
  const std::vector<OdometryRow>& odometry() const override;
  double time() const override;
  std::string whyEnded() const override { return ""; }

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Observes depth on recorded data. \param watcher may be null \throw InputError the sequence lacks
/// what the options ask for, or an image cannot be read
DEPTHSERVO_API RunLog replay(const Sequence& sequence, const ObservationOptions& options,
                             RunWatcher* watcher = nullptr);

}  // namespace depthservo
