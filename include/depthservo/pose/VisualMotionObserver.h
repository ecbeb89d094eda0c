#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/depth/PointSetEstimator.h"
#include "depthservo/pose/PoseError.h"

namespace depthservo {

/// How the pose error is obtained from the image error f - f^ of all points.
enum class ImageErrorMethod {
  mixed,    ///< image Jacobian with the measured x, y: exact in translation, second order in
            ///< rotation
  taylor,   ///< image Jacobian with the predicted x, y: first order in both
  iterated  ///< the mixed step repeated to the end: exact, for rotations below kLargestRotation
};

/// What became of the last image.
enum class ImageVerdict {
  none,              ///< no image yet
  accepted,          ///< the pose was corrected with it
  tooFewPoints,      ///< fewer than four usable points
  behindCamera,      ///< a measured point is predicted behind the camera or nearer than Z_min
  degenerate,        ///< these points do not tell the pose from here
  rotationTooLarge,  ///< the target is turned by more than kLargestRotation from the estimate
  inconsistent       ///< no pose near the estimate explains the points
};
DEPTHSERVO_API const char* toString(ImageVerdict verdict);

namespace detail {
struct PoseStep;
/// A point of the target in an image.
struct SeenPoint {
  PointMeasurement point;
  bool isSeen = false;
};
}  // namespace detail

struct VisualMotionObserverOptions {
  /// Observer gain [1/s], > 0. The error decays at this rate; a target that moves with twist V is
  /// tracked with the lag V/ke; pixel noise of one image's pose is reduced by
  /// sqrt(keT/(2 - keT)). Choose keT <= 1 at frame period T (1 makes a full correction with every
  /// image), lower for still targets, see FrameRateConditions.
  double ke = 9;

  ImageErrorMethod method = ImageErrorMethod::mixed;

  /// Rotation error [rad] above which the iterated method is used whatever `method` says, as it is
  /// when a pose does not explain the points; infinity: never.
  double iterateAbove_rad = 0.3;

  /// What the first image does: take the pose it shows, or correct the guess at the rate ke.
  enum class Start { takePose, fromGuess } start = Start::takePose;

  /// Whether the correction by an image ends once it is complete, ke(t - t_i) = 1. Without this the
  /// error grows when images are further apart than 2/ke.
  enum class LostFrames { guarded, unguarded } lostFrames = LostFrames::guarded;

  /// Pose of the target in the camera to start from; without it the target is supposed to face the
  /// camera unturned (R = I) where the first image shows it.
  std::optional<Eigen::Isometry3d> cMo;

  /// Desired pose of the paper's coupled law (22), see PoseRegulation; evaluated at least every
  /// `couplingStep_s`.
  std::optional<Eigen::Isometry3d> coupledGoal;
  double couplingStep_s = 0.005;  ///< [s], > 0
};

/// Pose of a known target, still or moving, from sampled images, and so the depth of its points:
/// Ibuki, Nakano, Shigaki, Hatanaka, "Sampled visual feedback pose estimation and regulation based
/// on camera frame rates", Advanced Robotics 37, 2023, eq. 3-6 and 22.
///
///   between images    g^ <- exp(-V_wc h) g^ exp(u_e h),    u_e = ke e_e(t_i)
///   image at t_i      e_e ~ J^+ (f - f^),  f_i = (x_i, y_i),
///                     J_i = (1/Z^_i) [1 0 -x_i; 0 1 -y_i] R^ [I, -[p_oi]x]
///
/// with g^ the pose of the target in the camera, V_wc the camera's twist from odometry and e_e =
/// vec(g^^-1 g) in target axes. Both exponentials commute, so each interval is exact whatever its
/// length. Needs at least four points of the target in an image; with fewer it coasts on odometry.
///
/// Ids are indices into the points given at construction; priors are of use only as the distance to
/// start from when no pose is given, and measured depths (`correctDepth`) are ignored: the shape of
/// the target tells the depth. The estimator lives at exposure times, so an image that comes late
/// is compared with the pose at its exposure.
///
/// After a motion of the camera that is not known (`Motion::unknown`) the pose is kept with a sigma
/// that grows, and the next image is taken as the first one was.
///
/// When the rotation error exceeds kLargestRotation, the target passes the camera plane, or six
/// images in a row do not fit, the status is `lost`. Each further image is tried as a start from
/// the last pose; `reset(cMo)` with a pose from elsewhere (PnP) is the sure way back.
///
/// Points do not tell the pose when they are collinear, or fewer than four places altogether; four
/// corners of a flat figure do, from every side.
///
/// sigma is approximate: the noise of one image's pose, J^+ sigma, filtered as the correction does
/// (variance P <- (1 - a)^2 P + a^2 C, a = ke(t - t_i), which is keT/(2 - keT) C in the end), plus
/// the systematic lag behind a moving target, known as the mean of e_e over 1/ke, which grows while
/// nothing is measured. It has no share for an error of the target's shape, and none for odometry
/// errors other than their part in the lag. excitation is 0: no motion is needed.
class DEPTHSERVO_API VisualMotionObserver : public PointSetEstimator {
 public:
  using Options = VisualMotionObserverOptions;

  /// Rotation error [rad] beyond which an image does not tell the pose reliably.
  static constexpr double kLargestRotation = 1.4;

  /// \param points of the target, in its own frame [m]
  explicit VisualMotionObserver(std::vector<Eigen::Vector3d> points, const Options& options = {},
                                const DepthRange& range = {});

  VisualMotionObserver(const VisualMotionObserver&) = default;  // no move: nothing is left without its memory
  VisualMotionObserver& operator=(const VisualMotionObserver&) = default;
  std::unique_ptr<PointSetEstimator> clone() const override;
  void reset() override;
  bool setPrior(int id, const DepthPrior& prior) override;
  Coverage advance(const MotionBuffer& odometry, double time_s) override;
  void correct(const std::vector<PointObservation>& observations) override;
  void correctDepth(int id, const DepthPrior& measured) override;
  DepthEstimate estimate(int id) const override;
  /// The target goes on with the held correction, so a moving one is met where it will be.
  DepthEstimate estimate(int id, const MotionBuffer& odometry, double time_s) const override;
  double time() const override { return time_s_; }
  const DepthRange& range() const override { return range_; }

  /// Starts anew from a pose of the target in the camera at the time of the last `advance`, with
  /// the next image. False, and nothing done, when it is not a finite rigid motion.
  bool reset(const Eigen::Isometry3d& cMo);

  /// Corrects with the whole pose at the time of the last `advance`, as a tag or PnP gives it,
  /// instead of points. False, and nothing done, when it is not a finite rigid motion.
  /// \param covariance of its `poseError`, in target axes
  bool correctPose(const Eigen::Isometry3d& cMo, const Matrix6d& covariance = Matrix6d::Zero());

  /// Estimated pose of the target in the camera at the time of the last `advance`. Finite.
  const Eigen::Isometry3d& cMo() const { return cMo_; }

  /// The same at a later time, as far as the odometry reaches: camera motion and held correction.
  Eigen::Isometry3d cMo(const MotionBuffer& odometry, double time_s) const;

  /// e_e of the last accepted image.
  const Vector6d& error() const { return e_e_; }

  /// |Z_i - Z^_i| <= |p_ee| + 2 sin(theta_ee/2) |p_oi| [m] as the last accepted image had it; holds
  /// for e_e without noise and theta_ee <= pi/2. Infinite for an unknown id or before the first
  /// image.
  double depthErrorBound(int id) const;

  ImageVerdict verdict() const { return verdict_; }

  /// Whether there is a pose to go on from: false before the first image and while lost.
  bool isStarted() const { return isStarted_; }

  /// rms image error (normalised) that no pose near the estimate explains, in the last accepted
  /// image.
  double residual() const { return residual_; }

  /// Smallest frame rate met so far, one over the longest time between accepted images [Hz];
  /// infinite before the second. What the conditions on the frame rate must be judged by.
  double minimumFrameRate() const { return 1 / longestGap_s_; }

  /// Observations ignored because their id is not of the target or came twice in an image.
  std::size_t ignored() const { return ignored_; }

 private:
  enum class Phase { unset, tracking, coasting, rejected, lost };
  /// The estimate some time after the last accepted image.
  struct Instant {
    Eigen::Isometry3d cMo;
    double elapsed_s = 0;
    double corrected = 0;  // share of e_e applied by then
  };

  void take(const std::vector<PointObservation>& observations);
  detail::PoseStep imageStep() const;
  bool takesPose() const;
  void letDrift(const UnknownPart& unknown);
  void accept(const detail::PoseStep& step);
  void refuse(ImageVerdict verdict);
  double heldFor() const;
  Eigen::Isometry3d moved(const Motion& motion) const;
  Matrix6d covariance(double corrected) const;
  DepthEstimate estimateAt(const Instant& instant, int id) const;
  bool isKnown(int id) const { return id >= 0 && id < static_cast<int>(points_.size()); }

  std::vector<Eigen::Vector3d> points_;
  double size_;  // rms distance of the points from the target's origin [m]
  Options options_;
  DepthRange range_;

  std::vector<detail::SeenPoint> measured_;  // in the last image
  std::size_t seen_ = 0, ignored_ = 0;
  bool isOnImage_ = false;  // nothing has moved since measured_

  Eigen::Isometry3d cMo_;
  bool hasGuess_ = false;
  double startDistance_ = DepthPrior().Z;
  Phase phase_ = Phase::unset;
  bool isStarted_ = false;
  bool isAdrift_ = false;  // the camera's motion since the last accepted image is not known
  ImageVerdict verdict_ = ImageVerdict::none;
  double time_s_ = std::numeric_limits<double>::quiet_NaN();
  double longestGap_s_ = 0;

  int refusals_ = 0;  // in a row

  // Of the last accepted image, t_i.
  Vector6d e_e_ = Vector6d::Zero();  // held
  double elapsed_s_ = 0;             // since then
  double residual_ = 0;
  double corrected_ = 0;             // share of e_e applied since then: ke(t - t_i)
  Matrix6d P_ = Matrix6d::Zero();    // error of the estimate at t_i, from noise
  Matrix6d C_ = Matrix6d::Zero();    // error of e_e, from noise
  Vector6d lag_ = Vector6d::Zero();  // mean of e_e
};

}  // namespace depthservo
