#include "observation/estimatorWords.h"
#include "scenario/keys.h"

namespace depthservo {

using detail::Fields;
using detail::Key;
using detail::kOptional;
using detail::kRequired;
using detail::Range;

namespace {

void describeEstimator(Fields& f, EstimatorOptions& depth) {
  f.choice({"estimator", "which one: doc/estimators.md. true is told the true depths"},
           depth.estimator, estimatorWords());
}

void describeErrors(Fields& f, EstimatorOptions& depth) {
  f.choice({"errors",
            "what the estimators filter and joint are told of the robot's errors (doc/robots.md): "
            "white noise alone (declared, exact), or a profile of errors that last"},
           depth.errors, errorWords());
}

void describeRange(Fields& f, EstimatorOptions& depth) {
  f.number({"Z_min", "least depth reported; a camera closer than this has collided"}, depth.Z_min,
           ranges::kDepth, "m");
  f.number({"Z_max", "greatest depth reported, above Z_min"}, depth.Z_max, ranges::kDepth, "m");
}

void describeObject(Fields& f, EstimatorOptions& depth) {
  f.flag(
      {"object", "one depth for all points (doc/depth-observer.md); needs the nonlinear estimator"},
      depth.object);
}

void describe(Fields& f, ObserverGainOptions& gains) {
  f.number({"settling", "time to 2 % at any excitation above W_min"}, gains.settling,
           Range::above(0, 1000), "s");
  f.number({"W_min", "excitation below which the gain stops growing"}, gains.W_min,
           Range::above(0, 10), "m/s");
  f.number({"k", "k_1 = k_2 of De Luca et al. 2008, with k_3 instead of settling and W_min"},
           gains.k, Range::above(0, 1e6), "1/s");
  f.number({"k_3",
            "for normalised image coordinates: focal_px^2 times the value for pixels; more than "
            "(10 rate)^2 is refused as too fast for the frame rate or in the wrong unit"},
           gains.k_3, {0, 1e12}, "1/m^2");
}

void describe(Fields& f, JointStateOptions& joint) {
  f.flag({"time_offset", "how late the images are against the odometry"}, joint.time_offset);
  f.flag({"gyro_bias", "constant error of the angular velocity"}, joint.gyro_bias);
  f.flag({"focal", "true over given focal length"}, joint.focal);
}

const char* const kJoint = "what the joint filter learns besides depths";

void describe(Fields& f, KnownTargetOptions& pose) {
  f.number({"ke", "gain of `pose`: a target moving at V is tracked with the lag V/ke", kOptional,
            "by the frame rate"},
           pose.ke, Range::above(0, 1000), "1/s");
  f.number({"kappa",
            "how fast the target may move; for the choice of ke and for the conditions on the "
            "frame rate"},
           pose.kappa, Range::above(0, 100), "m/s, rad/s");
  f.flag({"guard",
          "the correction by an image ends once it is complete; false: it is held until the next, "
          "as in the paper"},
         pose.guard);
}

/// Of the coupled regulation, as `pose` needs it.
struct Coupling {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double step_s = KnownTargetOptions().couplingStep_s;
  std::optional<double> kc;

  static std::optional<Coupling> of(const KnownTargetOptions& pose) {
    if (!pose.coupledGoal) return std::nullopt;
    return Coupling{pose.coupledGoal->translation(), Eigen::Quaterniond(pose.coupledGoal->linear()),
                    pose.couplingStep_s, pose.kc};
  }
  void to(KnownTargetOptions& pose) const {
    pose.coupledGoal = Eigen::Translation3d(xyz) * rotation;
    pose.couplingStep_s = step_s;
    pose.kc = kc;
  }
};

void describe(Fields& f, Coupling& coupled) {
  f.numbers({"xyz", "position of the target in the camera at the goal", kRequired}, coupled.xyz,
            ranges::kPosition, "m");
  f.quaternion({"quaternion", "its orientation [qx, qy, qz, qw]", kRequired}, coupled.rotation);
  f.number({"step", "period of the law"}, coupled.step_s, Range::above(0, 1000), "s");
  f.number({"kc", "gain of the law, for the conditions on the frame rate"}, coupled.kc,
           Range::above(0, 1000), "1/s");
}

void describePixelNoise(Fields& f, ObservationOptions& options) {
  std::optional<double> noise;
  if (options.isPixelNoiseGiven) noise = options.pixelNoise_px;
  f.number(
      {"pixel_noise", "1 sigma per axis", kOptional, "0.5; of trackers but dots what they measure"},
      noise, Range::above(0, 50), "px");
  options.isPixelNoiseGiven = noise.has_value();
  if (noise) options.pixelNoise_px = *noise;
}

void describeOdometryNoise(Fields& f, ObservationOptions& options) {
  std::optional<Eigen::Vector2d> sigma;
  OdometryMode mode = OdometryMode::measured;
  if (const auto& noise = options.odometryNoise) {
    sigma.emplace(noise->sigma_v, noise->sigma_w);
    if (!sigma->isZero()) mode = noise->mode;
  }
  f.numbers(
      {"odometry_noise", "1 sigma per row, white; [0, 0]: exact", kOptional, "the estimator's own"},
      sigma, {0, 10}, "m/s, rad/s");
  f.choice({"odometry_mode", "commanded: the noise is in what the camera did, not in the rows"},
           mode, odometryModes());
  if (sigma) {
    options.odometryNoise = sigma->isZero() ? OdometryNoise::none()
                                            : OdometryNoise::white((*sigma)[0], (*sigma)[1], mode);
  }
}

}  // namespace

void describe(Fields& f, EstimatorOptions& depth) {
  describeEstimator(f, depth);
  f.number({"initial", "first guess for every point, from Z_min to Z_max", kRequired},
           depth.initial, ranges::kDepth, "m");
  describeRange(f, depth);
  describeErrors(f, depth);
  describeObject(f, depth);
  f.flag(
      {"euler",
       "the nonlinear observer by Euler's method, as printed in De Luca et al. 2008: diverges at "
       "the rates of cameras; for comparison"},
      depth.euler);
  f.section({"gains", "of the nonlinear observer: `settling` and `W_min`, or `k` and `k_3`"},
            [&](Fields& gains) { describe(gains, depth.gains); });
  f.section({"joint", kJoint}, [&](Fields& joint) { describe(joint, depth.joint); });
  f.section({"pose",
             "of the estimator `pose` (doc/known-target.md); the target needs four points or more, "
             "not on one line"},
            [&](Fields& pose) { describe(pose, depth.pose); });
}

void describe(Fields& f, ObservationOptions& options) {
  EstimatorOptions& depth = options.depth;
  describeEstimator(f, depth);
  f.number({"prior", "first guess of every depth"}, depth.initial, ranges::kDepth, "m");
  describePixelNoise(f, options);
  describeOdometryNoise(f, options);
  f.number({"odometry_scale_sigma", "1 sigma of the scale of the translation, relative"},
           options.odometryScaleSigma, {0, 1}, "");
  f.number({"focal_sigma", "1 sigma of the focal length, relative"}, options.focalSigma, {0, 1},
           "");
  describeRange(f, depth);
  describeErrors(f, depth);
  describeObject(f, depth);
  describe(f, depth.gains);
  f.section({"joint", kJoint}, [&](Fields& joint) { describe(joint, depth.joint); });
  describe(f, depth.pose);
  std::optional<Coupling> coupled = Coupling::of(depth.pose);
  f.section(
      {"coupled", "of the coupled regulation (doc/known-target.md), which `pose` takes part in"},
      coupled, [](Fields& fields, Coupling& coupling) { describe(fields, coupling); });
  if (coupled) coupled->to(depth.pose);
}

}  // namespace depthservo
