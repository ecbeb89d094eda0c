#include "depthservo/report/Metrics.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "observation/unexcited.h"

namespace depthservo {
namespace {

/// The final image error is that of this last time [s].
constexpr double kFinal_s = 1;

/// Distance of a pixel to the nearest border of the image [px]; negative outside.
double borderDistance(const PinholeCamera& camera, double u, double v) {
  return std::min({u + 0.5, v + 0.5, camera.width - 0.5 - u, camera.height - 0.5 - v});
}

/// Smallest border distance of the dots whose place is known: the true one, or else the measured
/// one.
double smallestBorderDistance(const RunLog& log) {
  double smallest = kUnknown;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      const bool hasTruth = std::isfinite(feature.u_true) && std::isfinite(feature.v_true);
      if (!hasTruth && !feature.measured) continue;
      const double distance = hasTruth ? borderDistance(log.camera, feature.u_true, feature.v_true)
                                       : borderDistance(log.camera, feature.u, feature.v);
      smallest = std::fmin(smallest, distance);
    }
  }
  return smallest;
}

double coverageWithin2Sigma(const RunLog& log) {
  std::size_t judged = 0, covered = 0;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      const DepthEstimate& estimate = feature.estimate;
      const bool claimsDepth =
          estimate.status == DepthStatus::valid || estimate.status == DepthStatus::converging;
      if (!claimsDepth || !(feature.Z_true > 0)) continue;
      ++judged;
      if (std::abs(estimate.chi - 1 / feature.Z_true) <= 2 * estimate.sigma_chi) ++covered;
    }
  }
  return judged > 0 ? static_cast<double>(covered) / static_cast<double>(judged) : kUnknown;
}

}  // namespace

Metrics computeMetrics(const RunLog& log) {
  Metrics metrics;
  metrics.frames = log.frames.size();
  if (log.frames.empty()) return metrics;
  metrics.duration_s = log.frames.back().time_s - log.frames.front().time_s;
  const double end_s = log.frames.back().time_s;
  for (std::size_t i = 1; i < log.frames.size(); ++i) {
    const double gap_s = log.frames[i].time_s - log.frames[i - 1].time_s;
    metrics.min_frame_rate = std::fmin(metrics.min_frame_rate, 1 / gap_s);
  }
  metrics.final_error_px = meanImageError(log, end_s - kFinal_s, end_s);
  metrics.min_border_px = smallestBorderDistance(log);
  metrics.all_in_image = metrics.min_border_px >= 0;
  metrics.coverage_2sigma = coverageWithin2Sigma(log);

  struct Story {
    PointMetrics point;
    double lastMeasured_s = 0;
  };
  std::map<int, Story> stories;
  double lastFrame_s = log.frames.front().time_s;
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& feature : frame.features) {
      if (feature.estimate.status == DepthStatus::unset) continue;
      const auto [found, isNew] = stories.try_emplace(feature.id);
      auto& [point, lastMeasured_s] = found->second;
      if (isNew) lastMeasured_s = frame.time_s;
      if (!isNew && feature.estimate.status == DepthStatus::unexcited) {
        point.unexcited_s += frame.time_s - lastFrame_s;
      }
      point.id = feature.id;
      point.Z = feature.estimate.Z();
      point.sigma_Z = feature.estimate.sigma_Z();
      point.Z_true = feature.Z_true;
      point.relative_error = std::abs(point.Z - point.Z_true) / point.Z_true;
      point.status = feature.estimate.status;
      point.frames_to_5pct = feature.frames_to_5pct;
      if (feature.frames_to_5pct == 0 && std::isnan(point.time_to_5pct_s)) {
        point.time_to_5pct_s = frame.time_s - log.frames.front().time_s;
      }
      ++(feature.measured ? point.measured_frames : point.hidden_frames);
      if (feature.measured && feature.estimate.status == DepthStatus::rejected) {
        ++point.rejected_frames;
        ++metrics.rejected_measurements;
      }
      if (point.hidden_frames > 0) {
        metrics.max_gap_s = std::max(metrics.max_gap_s, frame.time_s - lastMeasured_s);
      }
      if (feature.measured) lastMeasured_s = frame.time_s;
    }
    lastFrame_s = frame.time_s;
  }
  for (const UnexcitedPeriod& period : unexcitedPeriods(log)) {
    stories[period.point].point.unexcited_because = period.because;
  }
  for (const auto& [id, story] : stories) {
    metrics.points.push_back(story.point);
    const DepthStatus last = story.point.status;
    if (last == DepthStatus::rejected || last == DepthStatus::lost) ++metrics.rejected_points;
    metrics.final_depth_error_max =
        std::fmax(metrics.final_depth_error_max, story.point.relative_error);
  }
  return metrics;
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

}  // namespace

std::string toJson(const RunLog& log) {
  const Metrics metrics = computeMetrics(log);
  Json points = Json::array();
  for (const PointMetrics& point : metrics.points) {
    points.push_back({{"id", point.id},
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
                      {"unexcited_because", nullptr}});
    if (!point.unexcited_because.empty()) {
      points.back()["unexcited_because"] = point.unexcited_because;
    }
  }
  Json json = {{"command", log.command}, {"name", log.name}, {"seed", log.seed}};
  if (log.hasOutcome) json["outcome"] = toString(log.outcome);
  json["reason"] = log.reason;
  json["metrics"] = {{"duration_s", metrics.duration_s},
                     {"frames", metrics.frames},
                     {"min_frame_rate", metrics.min_frame_rate},
                     {"final_error_px", metrics.final_error_px},
                     {"max_gap_s", metrics.max_gap_s},
                     {"min_border_px", metrics.min_border_px},
                     {"all_in_image", metrics.all_in_image},
                     {"final_depth_error_max", metrics.final_depth_error_max},
                     {"coverage_2sigma", metrics.coverage_2sigma},
                     {"rejected_measurements", metrics.rejected_measurements},
                     {"rejected_points", metrics.rejected_points}};
  if (!log.tags.empty()) {
    json["tags"] = Json::array();
    for (const TagRecord& tag : log.tags) {
      json["tags"].push_back({{"id", tag.id},
                              {"size", tag.size},
                              {"observed_size", tag.observed_size},
                              {"sigma", tag.sigma},
                              {"disagrees", tag.disagrees}});
    }
  }
  if (log.diagnosis) json["diagnosis"] = toJson(*log.diagnosis);
  if (log.joint) json["joint"] = toJson(*log.joint, log.camera.focal_px());
  json["points"] = std::move(points);
  if (log.frameRate) json["frame_rate"] = frameRateJson(*log.frameRate);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace depthservo
