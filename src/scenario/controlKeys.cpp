#include "scenario/keys.h"
#include "servo/ControlLaw.h"

namespace depthservo {

using detail::Choice;
using detail::Fields;
using detail::Range;

namespace {

void describe(Fields& f, ExciteOptions& excite) {
  f.number({"speed", "of the camera on its circle across the optical axis"}, excite.speed,
           Range::above(0, 1), "m/s");
  f.number({"limit",
            "by which it may displace a point in the image while it lasts; a third of it by "
            "itself, whatever the depth within two sigma"},
           excite.limit, Range::above(0, 1e4), "px");
}

/// What vpServo steers by, and how fast.
void describeServo(Fields& f, ControlOptions& control) {
  f.choice<FeatureKind>(
      {"features",
       "what vpServo steers by: every point, or their barycentre and size (doc/visp.md). "
       "`control.tolerance` and all errors are those of the points either way"},
      control.features, {{FeatureKind::points, "points"}, {FeatureKind::moments, "moments"}});
  f.number({"size_weight",
            "value of the moment feature that tells the size, at the goal: its weight against the "
            "barycentre (normalised)"},
           control.size_weight, Range::above(0, 1000), "");
  f.number({"gain", "lambda of vpServo"}, control.gain, Range::above(0, 100), "1/s");
  f.number({"gain_in_doubt",
            "factor of the gain while a sigma of inverse depth is above half of it and the rms "
            "image error above a tenth of the image's width"},
           control.gain_in_doubt, Range::above(0, 1), "");
  f.number(
      {"tolerance",
       "rms image error at which the task is done; of the mean positions over 2 s, 1 s and 0.5 s, "
       "so that neither noise nor a swing counts"},
      control.tolerance, Range::above(0, 1000), "px");
  f.flag(
      {"all_in_image",
       "the run ends, `left-image`, as soon as one point is outside the image; false: when fewer "
       "than three are in it for 2 s, or the others cannot be predicted"},
      control.all_in_image);
  f.choice<ServoDepth>(
      {"depth",
       "what the task is given; blended: the estimate and the depth at the goal, weighted by their "
       "variances (without `robot.goal` the first guess stands for the latter)"},
      control.depth, {{ServoDepth::observed, "observed"}, {ServoDepth::blended, "blended"}});
  f.section({"excite",
             "a motion added while depths are not known (doc/estimators.md): from a sigma_Z above "
             "10 % of Z until all are below 5 %"},
            control.excite,
            [](Fields& fields, ExciteOptions& excite) { describe(fields, excite); });
  f.choice<InteractionKind>(
      {"interaction", "interaction matrix of vpServo; desired never uses the observed depth"},
      control.interaction,
      {{InteractionKind::current, "current"},
       {InteractionKind::mean, "mean"},
       {InteractionKind::desired, "desired"}});
}

}  // namespace

void describe(Fields& f, ControlOptions& control) {
  describeServo(f, control);
  f.number({"hidden_sigma",
            "image sigma predicted for a hidden point at which the robot has slowed down to a "
            "stop; up to half of it it goes at full speed"},
           control.hidden_sigma, Range::above(0, 1e5), "px");
  f.number({"hidden_wait", "the robot waits so long for hidden points, then the run ends, `lost`"},
           control.hidden_wait, {0, 3600}, "s");
  f.choice({"law",
            "task: the task function of Durand Petiteville et al. 2010, eq. 8, with the depths at "
            "the goal (not for a unicycle or mobile-manipulator); profile: given velocities, "
            "whatever the image shows; regulation: by the pose of the target, at every row of "
            "odometry (Ibuki et al. 2023; robots omni and free, needs `depth.estimator: pose` and "
            "`robot.goal`)"},
           control.law, lawWords());
  describe(f,
           {"profile",
            "velocities of the robot for the law of this name, each until a time of the run; as "
            "many numbers as the robot has velocities"},
           control.profile, {-20, 20});
  f.number({"kc", "gain of the law regulation"}, control.kc, Range::above(0, 1000), "1/s");
  f.flag({"coupled",
          "regulation: the coupled law (22), whose proof covers observer and robot at once; false: "
          "the observer does not know of the robot"},
         control.coupled);
  f.text(
      {"taught",
       "folder of a goal that `depthservo teach` wrote at `robot.goal` before the same walls, from "
       "the current folder or that of the scenario; `start`: the image seen from `robot.goal` is "
       "taught at the start"},
      control.taught);
  f.rows({"desired", "desired [u, v] of every point, in the image, instead of `robot.goal`"},
         control.desired, {-1e5, 1e5}, "px");
}

}  // namespace depthservo
