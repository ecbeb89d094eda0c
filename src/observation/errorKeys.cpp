#include "observation/errorKeys.h"

namespace depthservo {

using detail::Fields;
using detail::Range;

namespace {

void describe(Fields& f, GaussMarkov& error, const Range& range, const char* unit) {
  f.number({"sigma", "1 sigma"}, error.sigma, range, unit);
  f.number({"tau", "how long it lasts (correlation time); 0: anew in each image"}, error.tau_s,
           {0, 1000}, "s");
}

void describe(Fields& f, ErrorProfile::Values& v) {
  f.number({"scale", "true = (1 + scale) measured"}, v.scale, {-0.9, 10}, "");
  f.number({"latency", "> 0: images are stamped late"}, v.latency_s, {-2, 2}, "s");
  f.number({"focal", "true = (1 + focal) given"}, v.focal, {-0.9, 10}, "");
  f.numbers({"gyro_bias", "measured = true + bias, camera frame"}, v.gyroBias_rad_s, {-1, 1},
            "rad/s");
  f.numbers({"gyro_bias_sigma", "of each axis; 0: `gyro_bias` above"}, v.gyroBiasSigma_rad_s,
            {0, 1}, "rad/s");
  f.numbers({"mount", "rotation vector of the camera against where it is said to be mounted"},
            v.mount_rad, {-1, 1}, "rad");
  f.numbers({"mount_sigma", "of each axis; 0: `mount` above"}, v.mountSigma_rad, {0, 1}, "rad");
}

}  // namespace

void describe(Fields& f, ErrorProfile& e) {
  f.number(
      {"scale", "of the translation, constant: true = (1 + scale) measured; no image tells it"},
      e.scale, {0, 1}, "");
  f.section({"slip", "likewise, but for a while"}, [&](Fields& slip) {
    describe(slip, e.slip, {0, 1}, "");
  });
  f.number({"gyro_bias", "constant, per axis"}, e.gyroBias_rad_s, {0, 1}, "rad/s");
  f.number({"gyro_noise", "white, per row and axis"}, e.odometry.sigma_w, {0, 10}, "rad/s");
  f.number({"velocity_noise", "white, per row and axis"}, e.odometry.sigma_v, {0, 10}, "m/s");
  f.number({"latency", "constant: how late images are stamped"}, e.latency_s, {0, 2}, "s");
  f.number({"stamp_jitter", "of the images' stamps, white"}, e.jitter_s, {0, 1}, "s");
  f.number({"readout", "rolling shutter: from the first row to the last"}, e.readout_s, {0, 1},
           "s");
  f.number({"focal", "of the focal length, constant, relative"}, e.focal, {0, 1}, "");
  f.number({"mount", "of the camera's orientation on the robot, constant, per axis"}, e.mount_rad,
           {0, 1}, "rad");
  f.section({"wander", "of each point's tracker, besides its white noise, per axis"},
            [&](Fields& wander) {
              describe(wander, e.wander_px, {0, 50}, "px");
            });
  f.section({"pose_noise", "of the poses from which the motion is taken, per axis"},
            [&](Fields& pose) {
              pose.number({"position", "1 sigma"}, e.position_m, {0, 1}, "m");
              pose.number({"angle", "1 sigma"}, e.angle_rad, {0, 1}, "rad");
              pose.number({"tau", "how long it lasts (correlation time); 0: anew in each image"},
                          e.poseTau_s, {0, 1000}, "s");
            });
  f.section({"values",
             "what the constants are, by `calibrate`; the sizes above are then those of "
             "what is left"},
            [&](Fields& values) { describe(values, e.values); });
}

}  // namespace depthservo
