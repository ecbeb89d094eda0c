#include "depthservo/report/Metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "observation/errorKeys.h"
#include "text/KeyTree.h"

namespace depthservo {
namespace {

/// Distance of a pixel to the nearest border of the image [px]; negative outside.
double borderDistance(const PinholeCamera& camera, double u, double v) {
  return std::min({u + 0.5, v + 0.5, camera.width - 0.5 - u, camera.height - 0.5 - v});
}

/// By the forecast or, where the estimator makes none, by what it claims.
bool isKnownTo5Percent(const FeatureRecord& feature) {
  constexpr double kWell = 0.05;
  const DepthEstimate& e = feature.estimate;
  if (feature.frames_to_5pct == 0) return true;
  return std::isnan(feature.frames_to_5pct) && e.status != DepthStatus::lost && e.chi > 0 &&
         e.sigma_chi <= kWell * e.chi;
}

}  // namespace

MetricsMeter::MetricsMeter(const PinholeCamera& camera, std::vector<Eigen::Vector2d> goals)
    : camera_(camera) {
  recent_.goals = std::move(goals);
}

void MetricsMeter::add(const FrameRecord& frame) {
  if (metrics_.frames++ == 0) {
    first_s_ = last_s_ = frame.time_s;
  } else {
    metrics_.min_frame_rate = std::fmin(metrics_.min_frame_rate, 1 / (frame.time_s - last_s_));
  }
  if (arePointsAsked_) addPoints(frame);
  keepForImageError(frame);
  last_s_ = frame.time_s;
}

void MetricsMeter::addPoints(const FrameRecord& frame) {
  for (const FeatureRecord& feature : frame.features) {
    seeBorder(feature);
    judge(feature);
    if (feature.estimate.status != DepthStatus::unset) addPoint(feature, frame.time_s);
  }
  for (auto story = stories_.begin(); story != stories_.end();) {
    story = story->second.frame == metrics_.frames ? std::next(story) : stories_.erase(story);
  }
  if (isExcitationAsked_) unexcited_.add(frame);
  for (const UnexcitedPeriod& period : unexcited_.takeEnded()) {
    const auto story = stories_.find(period.point);
    if (story != stories_.end()) story->second.point.unexcited_because = period.because;
  }
}

/// Dots whose place is known: the true one, or else the measured one.
void MetricsMeter::seeBorder(const FeatureRecord& feature) {
  const bool hasTruth = std::isfinite(feature.u_true) && std::isfinite(feature.v_true);
  if (!hasTruth && !feature.measured) return;
  const double distance = hasTruth ? borderDistance(camera_, feature.u_true, feature.v_true)
                                   : borderDistance(camera_, feature.u, feature.v);
  metrics_.min_border_px = std::fmin(metrics_.min_border_px, distance);
}

void MetricsMeter::judge(const FeatureRecord& feature) {
  const DepthEstimate& estimate = feature.estimate;
  const bool claimsDepth =
      estimate.status == DepthStatus::valid || estimate.status == DepthStatus::converging;
  if (!claimsDepth || !(feature.Z_true > 0)) return;
  ++judged_;
  if (std::abs(estimate.chi - 1 / feature.Z_true) <= 2 * estimate.sigma_chi) ++covered_;
}

void MetricsMeter::addPoint(const FeatureRecord& feature, double time_s) {
  const DepthEstimate& estimate = feature.estimate;
  const auto [found, isNew] = stories_.try_emplace(feature.id);
  auto& [point, lastMeasured_s, frame] = found->second;
  frame = metrics_.frames;
  if (isNew) {
    ++metrics_.points_seen;
    lastMeasured_s = time_s;
  } else if (estimate.status == DepthStatus::unexcited) {
    point.unexcited_s += time_s - last_s_;
  }
  point.id = feature.id;
  point.Z = estimate.Z();
  point.sigma_Z = estimate.sigma_Z();
  point.Z_true = feature.Z_true;
  point.relative_error = std::abs(point.Z - point.Z_true) / point.Z_true;
  point.status = estimate.status;
  const bool isKnown = isKnownTo5Percent(feature);
  point.frames_to_5pct = isKnown ? 0 : feature.frames_to_5pct;
  if (isKnown && std::isnan(point.time_to_5pct_s)) point.time_to_5pct_s = time_s - first_s_;
  ++(feature.measured ? point.measured_frames : point.hidden_frames);
  if (feature.measured && estimate.status == DepthStatus::rejected) {
    ++point.rejected_frames;
    ++metrics_.rejected_measurements;
  }
  if (point.hidden_frames > 0) {
    metrics_.max_gap_s = std::max(metrics_.max_gap_s, time_s - lastMeasured_s);
  }
  if (feature.measured) lastMeasured_s = time_s;
  if (feature.estimate.status == DepthStatus::valid) point.last_valid_s = time_s;
}

void MetricsMeter::keepForImageError(const FrameRecord& frame) {
  if (recent_.goals.empty()) return;
  recent_.frames.push_back(frame);
  if (frame.time_s - recent_.frames.front().time_s < 2 * kImageErrorOver_s) return;
  const auto isOld = [&](const FrameRecord& old) {
    return frame.time_s - old.time_s > 1.1 * kImageErrorOver_s;
  };
  recent_.frames.erase(recent_.frames.begin(),
                       std::find_if_not(recent_.frames.begin(), recent_.frames.end(), isOld));
}

Metrics MetricsMeter::result(const RunLog& log) const {
  Metrics metrics = metrics_;
  if (metrics.frames == 0) return metrics;
  metrics.duration_s = last_s_ - first_s_;
  metrics.final_error_px = meanImageError(recent_, last_s_ - kImageErrorOver_s, last_s_);
  metrics.all_in_image = metrics.min_border_px >= 0;
  if (log.cdMc) {
    metrics.final_distance_m = log.cdMc->translation().norm();
    metrics.final_angle_rad = Eigen::AngleAxisd(log.cdMc->linear()).angle();
  }
  if (judged_ > 0 && !log.isTruthOfMotion) {
    metrics.coverage_2sigma = static_cast<double>(covered_) / static_cast<double>(judged_);
  }
  for (const auto& [id, story] : stories_) {
    PointMetrics& point = metrics.points.emplace_back(story.point);
    if (const UnexcitedPeriod* period = unexcited_.current(id)) {
      point.unexcited_because = period->because;
    }
    if (!log.isDepthObserved) point.unexcited_because.clear();
    const bool isUseless =
        point.status == DepthStatus::rejected || point.status == DepthStatus::lost;
    if (isUseless) ++metrics.rejected_points;
    metrics.final_depth_error_max = std::fmax(metrics.final_depth_error_max, point.relative_error);
  }
  return metrics;
}

std::string wayLeft(const RunLog& log, const Metrics& metrics) {
  constexpr double kDegree = 180 / M_PI, kNear_m = 0.01, kNear_deg = 1;
  const double distance_m = metrics.final_distance_m, angle_deg = kDegree * metrics.final_angle_rad;
  if (!std::isfinite(distance_m)) return "";
  std::string words = distance_m < 0.1 ? fmt::format("{:.1f} mm", 1000 * distance_m)
                                       : fmt::format("{:.2f} m", distance_m);
  words += fmt::format(" and {:.{}f} deg from its goal", angle_deg, angle_deg < 10 ? 2 : 0);
  const bool isNear = distance_m <= kNear_m && angle_deg <= kNear_deg;
  if (isNear || log.outcome != Outcome::converged) return words;
  const bool isUnicycle = log.commandNames.size() == 2;
  return words +
         (isUnicycle ? ": two velocities cannot reach a pose of three degrees of freedom; "
                     : ": ") +
         "what is left shows little in the image";
}

std::string inPercent(double share) {
  const double percent = 100 * share;
  if (!(std::abs(percent) >= 10)) return fmt::format("{:.2g} %", percent);
  return fmt::format("{:.0f} %", percent);
}

Metrics computeMetrics(const RunLog& log) {
  MetricsMeter meter(log.camera, log.goals);
  for (const FrameRecord& frame : log.frames) meter.add(frame);
  return meter.result(log);
}

namespace {

using Json = nlohmann::ordered_json;

/// "cause" is none without a fault; the message may then still say that sigmas are too large.
Json toJson(const RunDiagnosis& diagnosis) {
  using Monitor = ConsistencyMonitor;
  const Monitor::Diagnosis& latest = diagnosis.latest;
  const auto cause = diagnosis.isFault() ? latest.cause : Monitor::Cause::none;
  Json json = {{"cause", Monitor::toString(cause)}};
  json["message"] = diagnosis.message();
  if (diagnosis.isFault()) {
    json["size"] = latest.size;
    json["unit"] = Monitor::unitOf(cause);
    json["evidence_sigma"] = latest.evidence;
    json["first_s"] = diagnosis.first_s;
    json["named_s"] = diagnosis.named_s;
    json["compensated"] = diagnosis.isCompensated;
    json["rival"] = Monitor::toString(latest.rival);
  }
  json["mean_nis"] = latest.meanNis;
  json["variance_factor"] = diagnosis.varianceFactor;
  return json;
}

Json toJson(const JointDepthFilter::Common& state, const char* unit) {
  return {{"value", state.value},
          {"sigma", state.sigma},
          {"unit", unit},
          {"observed", state.isObserved}};
}

/// Only what was estimated.
Json toJson(const JointStates& joint, double focal_px) {
  Json json = Json::object();
  if (joint.timeOffset.isEstimated) json["time_offset"] = toJson(joint.timeOffset, "s");
  const char* const axes[] = {"gyro_bias_x", "gyro_bias_y", "gyro_bias_z"};
  for (std::size_t i = 0; i < 3; ++i) {
    if (joint.gyroBias[i].isEstimated) json[axes[i]] = toJson(joint.gyroBias[i], "rad/s");
  }
  if (joint.focal.isEstimated) json["focal"] = toJson(joint.focal, "");
  json["words"] = joint.sentences(focal_px);
  return json;
}

Json toJson(const MeasurementNoise& noise) {
  return {
      {"pixel_px", noise.pixel_px.sigma()},  {"pixel_lasting_px", noise.pixel_px.lasting.sigma},
      {"pose_m", noise.position_m.sigma()},  {"pose_lasting_m", noise.position_m.lasting.sigma},
      {"pose_rad", noise.angle_rad.sigma()}, {"pose_lasting_rad", noise.angle_rad.lasting.sigma},
      {"words", sentenceOf(noise)}};
}

Json frameRateJson(const FrameRateReport& report) {
  Json json{{"ke", report.ke},
            {"kappa", report.kappa},
            {"kc", nullptr},
            {"lowest_fps", report.check.fps},
            {"required_fps", report.check.required_fps},
            {"true_limit_fps", report.check.true_limit_fps},
            {"bound", report.check.bound},
            {"verdict", toString(report.check.verdict)},
            {"sentence", report.sentence}};
  if (report.kc) json["kc"] = *report.kc;
  return json;
}

Json toJson(const PointMetrics& point) {
  Json json = {{"id", point.id},
               {"Z", point.Z},
               {"sigma_Z", point.sigma_Z},
               {"Z_true", point.Z_true},
               {"relative_error", point.relative_error},
               {"status", toString(point.status)},
               {"frames_to_5pct", point.frames_to_5pct},
               {"time_to_5pct_s", point.time_to_5pct_s},
               {"measured_frames", point.measured_frames},
               {"hidden_frames", point.hidden_frames},
               {"rejected_frames", point.rejected_frames},
               {"unexcited_s", point.unexcited_s},
               {"unexcited_because", nullptr}};
  if (!point.unexcited_because.empty()) json["unexcited_because"] = point.unexcited_because;
  return json;
}

Json toJson(const Metrics& metrics) {
  return {{"duration_s", metrics.duration_s},
          {"frames", metrics.frames},
          {"min_frame_rate", metrics.min_frame_rate},
          {"final_error_px", metrics.final_error_px},
          {"final_distance_m", metrics.final_distance_m},
          {"final_angle_rad", metrics.final_angle_rad},
          {"max_gap_s", metrics.max_gap_s},
          {"min_border_px", metrics.min_border_px},
          {"all_in_image", metrics.all_in_image},
          {"final_depth_error_max", metrics.final_depth_error_max},
          {"coverage_2sigma", metrics.coverage_2sigma},
          {"rejected_measurements", metrics.rejected_measurements},
          {"rejected_points", metrics.rejected_points},
          {"points_seen", metrics.points_seen},
          {"points_gone", metrics.points_gone()}};
}

Json toJson(const TagRecord& tag) {
  return {{"id", tag.id},
          {"size", tag.size},
          {"observed_size", tag.observed_size},
          {"sigma", tag.sigma},
          {"disagrees", tag.disagrees}};
}

}  // namespace

std::string toJson(const RunLog& log, const Metrics& metrics) {
  Json json = {{"command", log.command}, {"name", log.name}, {"seed", log.seed}};
  if (log.hasOutcome) json["outcome"] = toString(log.outcome);
  json["reason"] = log.reason;
  json["way_left"] = nullptr;
  if (const std::string words = wayLeft(log, metrics); !words.empty()) json["way_left"] = words;
  json["observes_depth"] = log.isDepthObserved;
  json["truth_is_pose_of_motion"] = log.isTruthOfMotion;
  json["metrics"] = toJson(metrics);
  if (!log.tags.empty()) {
    json["tags"] = Json::array();
    for (const TagRecord& tag : log.tags) json["tags"].push_back(toJson(tag));
  }
  json["robot_errors"] = {{"profile", log.profile}, {"considered", nullptr}};
  if (log.errors) {
    ErrorProfile errors = *log.errors;
    json["robot_errors"]["considered"] =
        detail::toJson(detail::keyTree([&](detail::Fields& f) { describe(f, errors); }));
  }
  if (log.diagnosis) json["diagnosis"] = toJson(*log.diagnosis);
  if (log.joint) json["joint"] = toJson(*log.joint, log.camera.focal_px());
  if (log.noise) json["noise"] = toJson(*log.noise);
  json["points"] = Json::array();
  for (const PointMetrics& point : metrics.points) json["points"].push_back(toJson(point));
  if (log.frameRate) json["frame_rate"] = frameRateJson(*log.frameRate);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string toJson(const RunLog& log) { return toJson(log, computeMetrics(log)); }

}  // namespace depthservo
