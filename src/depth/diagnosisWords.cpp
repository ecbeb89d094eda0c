#include <cstdio>

#include "depthservo/depth/ConsistencyMonitor.h"
#include "motion/DecimalPoint.h"

namespace depthservo {
namespace {

using Cause = ConsistencyMonitor::Cause;

struct Words {
  Cause cause;
  const char* name;
  const char* unit;      // of the size
  const char* likewise;  // what it is as a rival; null: it is never one
  double scale;          // of the size in the sentence
  const char* sentence;  // of size, evidence, mean NIS and values, unless `message` says otherwise
};

/// What the motion as a whole and all that would explain it have in common.
constexpr const char* kNotExplained =
    "the motion does not explain the images at all: %d of %d measurements are rejected; check its "
    "frame, sign, unit and clock, and the order of quaternions";

constexpr Words kWords[] = {
    {Cause::none, "none", "", nullptr, 1,
     "images and odometry agree with the declared noise (mean NIS %.2f of %d values, expected 2)"},
    {Cause::latency, "latency", "s", "images that are late", 1e3,
     "latency: the images are about %.0f ms late against the odometry (evidence %.0f sigma, mean "
     "NIS %.2f of %d values); correct the stamps or use the joint filter"},
    {Cause::gyroBias, "gyro-bias", "rad/s", "a gyro bias", 1,
     "gyro bias of about %.4f rad/s (evidence %.0f sigma, mean NIS %.2f of %d values); calibrate "
     "it at rest"},
    {Cause::focalLength, "focal-length", "", "a wrong focal length", 100,
     "calibration: the focal length is about %+.1f %% off (evidence %.0f sigma, mean NIS %.2f of "
     "%d values); calibrate the camera or let the joint filter estimate it"},
    {Cause::movingTarget, "moving-target", "m/s", "a target that moves", 1e3,
     "the target moves, at about %.1f mm/s (evidence %.0f sigma, mean NIS %.2f of %d values); its "
     "depth cannot be observed so"},
    {Cause::outliers, "outliers", "", nullptr, 100,
     "outliers: %.1f %% of the measurements are rejected (%.0f sigma, mean NIS of the others %.2f "
     "of %d values); look at the tracker"},
    {Cause::noise, "noise", "", nullptr, 1,
     "innovations %.1f times the declared variance (%.0f sigma, mean NIS %.2f of %d values): noise "
     "is larger than declared, or the model is wrong"},
    {Cause::motion, "motion", "", nullptr, 1, kNotExplained},
    {Cause::frame, "frame", "", nullptr, 1, kNotExplained},
    {Cause::clock, "clock", "s", nullptr, 1, kNotExplained},
    {Cause::unit, "unit", "", nullptr, 1, kNotExplained},
    {Cause::poseConvention, "pose-convention", "", nullptr, 1, kNotExplained},
    {Cause::mount, "mount", "rad", "a camera that is mounted otherwise than said", 1,
     "mount: the camera is turned by about %.4f rad against where it is said to be (evidence %.0f "
     "sigma, mean NIS %.2f of %d values); calibrate its pose on the robot"},
    {Cause::slip, "slip", "", "wheels that slip", 100,
     "slip: the wheels slip by about %.1f %% of the speed (1 sigma; evidence %.0f sigma, mean NIS "
     "%.2f of %d values); declare it in an error profile, or drive more smoothly"},
    {Cause::poseNoise, "pose-noise", "m", nullptr, 1e3,
     "pose noise: the poses that tell the motion err by about %.1f mm (mean NIS %.2f of %d "
     "values)"},
    {Cause::noData, "no-data", "", nullptr, 1,
     "not judged: only %d measurements could be compared with the odometry"},
};

constexpr const char* kLittleNoise =
    "innovations only %.2f times the declared variance (%.0f sigma, mean NIS %.2f of %d values): "
    "declare less noise for smaller sigmas";

const Words& wordsOf(Cause cause) {
  for (const Words& words : kWords) {
    if (words.cause == cause) return words;
  }
  return kWords[0];
}

}  // namespace

const char* ConsistencyMonitor::toString(Cause cause) { return wordsOf(cause).name; }

const char* ConsistencyMonitor::unitOf(Cause cause) { return wordsOf(cause).unit; }

bool ConsistencyMonitor::Diagnosis::isMotion() const {
  return wordsOf(cause).sentence == wordsOf(Cause::motion).sentence;
}

std::string ConsistencyMonitor::Diagnosis::message() const {
  const Words& words = wordsOf(cause);
  const bool isLittleNoise = cause == Cause::noise && !(size > 1);
  const char* const sentence = isLittleNoise ? kLittleNoise : words.sentence;
  const DecimalPoint point;
  char text[256];
  if (cause == Cause::none) {
    std::snprintf(text, sizeof text, sentence, meanNis, values);
  } else if (cause == Cause::noData) {
    std::snprintf(text, sizeof text, sentence, values + rejected);
  } else if (cause == Cause::poseNoise) {
    std::snprintf(text, sizeof text, sentence, words.scale * size, meanNis, values);
  } else if (isMotion()) {
    std::snprintf(text, sizeof text, sentence, rejected, rejected + values);
  } else {
    std::snprintf(text, sizeof text, sentence, words.scale * size, evidence, meanNis, values);
  }
  const char* const likewise = wordsOf(rival).likewise;
  if (!likewise) return text;
  return std::string(text) + "; in this motion " + likewise + " would look nearly the same";
}

}  // namespace depthservo
