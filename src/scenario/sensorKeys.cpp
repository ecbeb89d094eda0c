#include "scenario/keys.h"
#include "sequence/rowMeanings.h"

namespace depthservo {

using detail::Fields;
using detail::kOptional;
using detail::kRequired;
using detail::Range;

const std::vector<detail::Choice<OdometryMode>>& odometryModes() {
  static const std::vector<detail::Choice<OdometryMode>> all = {
      {OdometryMode::measured, "measured"}, {OdometryMode::commanded, "commanded"}};
  return all;
}

void describe(Fields& f, CameraOptions& camera) {
  const Range size{16, 8192}, focal = Range::above(0, 1e5), centre{0, 8191};
  f.integer({"width", "of the image", kRequired}, camera.width, size, "px");
  f.integer({"height", "of the image", kRequired}, camera.height, size, "px");
  f.number({"fx", "focal length, horizontal", kRequired}, camera.fx, focal, "px");
  f.number({"fy", "focal length, vertical", kRequired}, camera.fy, focal, "px");
  f.number({"cx", "principal point, in the image", kRequired}, camera.cx, centre, "px");
  f.number({"cy", "principal point, in the image", kRequired}, camera.cy, centre, "px");
  f.oneOrMore(
      {"rate", "images per second; a list [30, 20, 60] gives the intervals between images in turn",
       kRequired},
      camera.rate, Range::above(0, 1000), "Hz");
  f.number({"jitter", "every interval is longer or shorter by up to this fraction of it"},
           camera.jitter, {0, 0.9}, "");
  f.number({"dropped", "probability that an image gets lost"}, camera.dropped, {0, 0.9}, "");
  f.number({"focal_error",
            "true over given focal length (`fx`, `fy`) - 1; simulated error, the estimator is not "
            "informed"},
           camera.focal_error, {-0.5, 0.5}, "");
  f.number({"focal_drawn",
            "1 sigma of what the seed draws and adds to `focal_error`; simulated error, the "
            "estimator is not informed"},
           camera.focal_drawn, {0, 0.1}, "");
  f.number({"focal_sigma", "1 sigma of the focal length, relative, that the estimator is told"},
           camera.focal_sigma, {0, 1}, "");
}

namespace {

/// What finds the points of each kind of target.
const std::vector<detail::Choice<TargetKind>>& trackerWords() {
  static const std::vector<detail::Choice<TargetKind>> all = {
      {TargetKind::dots, "dots"},
      {TargetKind::apriltag, "apriltag"},
      {TargetKind::wall, "klt"},
      {TargetKind::chessboard, "chessboard"},
      {TargetKind::charuco, "charuco"}};
  return all;
}

/// \param range of sigma \param unit of sigma
void describe(Fields& f, LastingError& error, const Range& range, const char* unit) {
  f.number({"sigma", "1 sigma at any time; 0: none"}, error.sigma, range, unit);
  f.number({"tau", "correlation time: exp(-1) of the error is left after it; 0: white"}, error.tau,
           {0, 3600}, "s");
}

void describe(Fields& f, PointPeriod& hidden) {
  f.number({"from", "first instant hidden", kRequired}, hidden.from, {0, 3600}, "s");
  f.number({"to", "first instant seen again, after `from`", kRequired}, hidden.to, {0, 3600}, "s");
  f.integers({"points", "only these points of the target, by id; empty: all"}, hidden.points,
             {0, 1e6});
}

void describeSwapped(Fields& f, PointPeriod& swapped) {
  f.number({"from", "first instant", kRequired}, swapped.from, {0, 3600}, "s");
  f.number({"to", "first instant in which they are told apart again, after `from`", kRequired},
           swapped.to, {0, 3600}, "s");
  f.integers({"points", "two or more of the target, by id"}, swapped.points, {0, 1e6});
}

void describe(Fields& f, ClockStep& step) {
  f.number({"at", "when"}, step.at, {0, 3600}, "s");
  f.number({"by", "how far; below 0: images are left out until they are later than those before"},
           step.by, {-60, 60}, "s");
}

}  // namespace

void describe(Fields& f, Interlude& time) {
  f.number({"from", "first instant", kRequired}, time.from, {0, 3600}, "s");
  f.number({"to", "first instant after it", kRequired}, time.to, {0, 3600}, "s");
}

void describe(Fields& f, SensingOptions& sensing) {
  f.choice<SensingSource>(
      {"source", "image: dots are drawn and tracked; geometry: projected points"}, sensing.source,
      {{SensingSource::geometry, "geometry"}, {SensingSource::image, "image"}});
  f.choice({"tracker", "must agree with `target.type`", kOptional, "as `target.type`"},
           sensing.tracker, trackerWords());
  f.integer({"corners",
             "natural corners of a wall that are followed, at most: spread over the image from "
             "`robot.goal`, and seen from `robot.initial`, too"},
            sensing.corners, {8, 64}, "");
  f.number({"pixel_noise",
            "1 sigma per axis: a measured position is the true projection plus white noise. With "
            "images every dot is drawn displaced by it"},
           sensing.pixel_noise, {0, 50}, "px");
  f.number({"assumed_noise", "1 sigma per axis that the estimator is told", kOptional,
            "max(pixel_noise, 0.1)"},
           sensing.assumed_noise, Range::above(0, 50), "px");
  f.list({"hidden",
          "times during which points are not seen: `[from, to]` hides all; also `{from, to, "
          "points}`. With images an occluder is drawn"},
         sensing.hidden, [](Fields& item, PointPeriod& hidden) { describe(item, hidden); },
         {"from", "to"});
  f.list({"swapped",
          "times during which a point is taken for the next one of `points`, and the last for the "
          "first; needs `source: geometry`"},
         sensing.swapped, describeSwapped);
  f.number({"outliers", "fraction of measurements that are wrong by 5 to 50 px"}, sensing.outliers,
           {0, 0.5}, "");
  f.number({"delay", "age of an image when it reaches the controller"}, sensing.delay, {0, 2}, "s");
  f.number({"latency",
            "images are stamped so much later than they were taken; simulated error, the estimator "
            "is not informed"},
           sensing.latency, {0, 2}, "s");
  f.number(
      {"latency_drawn", "1 sigma of what the seed draws: its absolute value is added to `latency`"},
      sensing.latency_drawn, {0, 1}, "s");
  f.section({"clock_step",
             "the clock that stamps the images is set once; simulated error, the estimator is not "
             "informed"},
            [&](Fields& step) { describe(step, sensing.clock_step); });
  f.number(
      {"stamp_jitter",
       "1 sigma of the stamp of each image, white, but never more than 0.4 of the time between "
       "images; simulated error, the estimator is not informed"},
      sensing.stamp_jitter, {0, 1}, "s");
  f.number(
      {"readout",
       "rolling shutter: how much later than the first row of an image the last is exposed, each "
       "point as a whole; the estimator is informed by `readout` of an error profile"},
      sensing.readout, {0, 0.1}, "s");
  f.section({"wander",
             "slow error of every measured position, each axis of each point by itself (drift of a "
             "template); simulated error, the estimator is not informed"},
            [&](Fields& wander) {
              describe(wander, sensing.wander, {0, 50}, "px");
            });
  f.number({"gray_noise", "1 sigma, white, of every pixel"}, sensing.gray_noise, {0, 100},
           "gray levels");
  f.number({"exposure",
            "motion blur, not longer than the time between images; the time of an image is the "
            "middle of the exposure"},
           sensing.exposure, {0, 1}, "s");
  f.number({"vignetting", "fraction of the light that is lost in the corners"}, sensing.vignetting,
           {0, 1}, "");
  f.flag({"light_on_dark", "light dots on a dark plate"}, sensing.light_on_dark);
}

void describe(Fields& f, OdometryOptions& odometry) {
  f.number({"scale", "measured over true linear velocity; Z scales by the same factor"},
           odometry.scale, {0.1, 10}, "");
  f.number({"scale_sigma", "1 sigma of the scale that the estimator is told"}, odometry.scale_sigma,
           {0, 1}, "");
  f.numbers({"noise", "1 sigma per row, white"}, odometry.noise, {0, 10}, "m/s, rad/s");
  f.numbers({"gyro_bias",
             "added to the angular velocity, camera frame; simulated error, the estimator is not "
             "informed"},
            odometry.gyro_bias, {-1, 1}, "rad/s");
  f.number({"scale_drawn",
            "1 sigma of S, which the seed draws; the true linear velocity is (1 + S) times the "
            "measured one, so that `scale` is 1 / (1 + S); simulated error, the estimator is not "
            "informed"},
           odometry.scale_drawn, {0, 0.2}, "");
  f.section({"slip",
             "lasting error s of the linear velocity: the true one is (1 + S + s) times the "
             "measured one; simulated error, the estimator is not informed"},
            [&](Fields& slip) {
              describe(slip, odometry.slip, {0, 0.2}, "");
            });
  f.number(
      {"gyro_bias_drawn", "1 sigma of each axis of what the seed draws and adds to `gyro_bias`"},
      odometry.gyro_bias_drawn, {0, 1}, "rad/s");
  f.number({"gyro_noise",
            "1 sigma per row and axis of the angular velocity, white, besides `noise`; simulated "
            "error, the estimator is not informed"},
           odometry.gyro_noise, {0, 1}, "rad/s");
  f.number({"rate", "rows per second; they need not fall on images"}, odometry.rate,
           Range::above(0, 10000), "Hz");
  f.choice(
      {"rows",
       "what the twist of a row is: the mean until the next row (hold; the base takes commands "
       "when a row begins), a sample (instant) or the mean since the row before (mean-before)"},
      odometry.rows, detail::rowMeanings());
  f.choice({"mode", "commanded: the estimator gets the exact command, the noise moves the robot"},
           odometry.mode, odometryModes());
  f.number({"ticks", "resolution of the wheel encoders (unicycle); 0: perfect"}, odometry.ticks,
           {0, 0.1}, "m");
  f.number({"wheel_base", "distance of the wheels, for the ticks"}, odometry.wheel_base,
           ranges::kLength, "m");
  f.list(
      {"gaps", "times `[from, to]` of which no row comes, as where a driver's rows are no numbers"},
      odometry.gaps, [](Fields& item, Interlude& gap) { describe(item, gap); }, {"from", "to"});
}

}  // namespace depthservo
