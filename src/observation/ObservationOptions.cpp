#include "depthservo/observation/ObservationOptions.h"

namespace depthservo {

DepthPrior ObservationOptions::prior() const {
  DepthPrior prior{depth.initial};
  if (priorSigma_Z) prior.sigma_chi = *priorSigma_Z / (prior.Z * prior.Z);
  return prior;
}

ObservationOptions ObservationOptions::of(const Sequence& sequence) {
  return of(sequence.replayHints(), sequence.folder() + "/sequence.yaml");
}

ObservationOptions ObservationOptions::of(const ReplayHints& hints, const std::string& file) {
  ObservationOptions options;
  if (hints.estimator) {
    options.depth.estimator = estimatorNamed(*hints.estimator, {file, 0, "replay.estimator"});
  }
  options.depth.initial = hints.prior.value_or(options.depth.initial);
  options.pixelNoise_px = hints.pixel_noise.value_or(options.pixelNoise_px);
  options.isPixelNoiseGiven = hints.pixel_noise.has_value();
  if (const auto& noise = hints.odometry_noise) {
    options.odometryNoise =
        noise->isZero() ? OdometryNoise::none()
                        : OdometryNoise::white((*noise)[0], (*noise)[1], hints.odometry_mode);
  }
  options.odometryScaleSigma = hints.odometry_scale_sigma.value_or(options.odometryScaleSigma);
  options.focalSigma = hints.focal_sigma.value_or(options.focalSigma);
  if (const auto& joint = hints.joint) {
    options.depth.joint = {joint->time_offset, joint->gyro_bias, joint->focal};
  }
  options.depth.Z_min = hints.Z_min.value_or(options.depth.Z_min);
  options.depth.Z_max = hints.Z_max.value_or(options.depth.Z_max);
  options.depth.gains.settling = hints.settling.value_or(options.depth.gains.settling);
  options.depth.gains.W_min = hints.W_min.value_or(options.depth.gains.W_min);
  options.depth.gains.k = hints.k;
  options.depth.pose.ke = hints.ke;
  options.depth.pose.kappa = hints.kappa.value_or(options.depth.pose.kappa);
  options.depth.gains.k_3 = hints.k_3;
  return options;
}

}  // namespace depthservo
