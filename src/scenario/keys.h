#pragma once

#include <Eigen/Geometry>

#include "depthservo/observation/ObservationOptions.h"
#include "depthservo/scenario/RobotFile.h"
#include "depthservo/scenario/Scenario.h"
#include "observation/errorKeys.h"
#include "text/Fields.h"

namespace depthservo {

/// Every key of a scenario, in its order: name, unit, range, default (the value it has) and
/// meaning.
void describe(detail::Fields& f, Scenario& scenario);

/// The keys of `replay` in sequence.yaml.
void describe(detail::Fields& f, ObservationOptions& observation);

/// The keys of a file of --robot.
void describe(detail::Fields& f, RobotFile& file);

// The sections.

void describe(detail::Fields& f, CameraOptions& camera);
void describe(detail::Fields& f, TargetOptions& target);
void describe(detail::Fields& f, RobotOptions& robot);
void describe(detail::Fields& f, SensingOptions& sensing);
void describe(detail::Fields& f, OdometryOptions& odometry);
void describe(detail::Fields& f, EstimatorOptions& depth);
void describe(detail::Fields& f, ControlOptions& control);

// What several have.

void describe(detail::Fields& f, const detail::Key& key, VelocityProfile& profile,
              const detail::Range& velocity);
void describe(detail::Fields& f, RpyPose& pose, const detail::Need& need = detail::kOptional);
void describe(detail::Fields& f, Interlude& time);
const std::vector<detail::Choice<TargetKind>>& targetWords();
const std::vector<detail::Choice<OdometryMode>>& odometryModes();

namespace ranges {
constexpr detail::Range kAngle{-6.3, 6.3};                          // rad
constexpr detail::Range kPosition{-1000, 1000};                     // m
constexpr detail::Range kLength = detail::Range::above(0, 10);      // m
constexpr detail::Range kDuration = detail::Range::above(0, 3600);  // s
constexpr detail::Range kDepth = detail::Range::above(0, 1e6);      // m
}  // namespace ranges

}  // namespace depthservo
