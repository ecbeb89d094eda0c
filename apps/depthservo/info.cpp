#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "depthservo/sequence/RecordingInfo.h"
#include "observation.h"

namespace depthservo {
namespace {

struct InfoArguments {
  std::string recording;
  SequenceOptions source;
  bool json = false;
};

void printTopic(const RecordedTopic& t) {
  std::string line = fmt::format("  {} ({}): {}", t.name, t.type, t.messages);
  if (t.unreadable > 0) line += fmt::format(" and {} that cannot be read", t.unreadable);
  if (t.rate_hz > 0) line += fmt::format(", {:.4g} Hz", t.rate_hz);
  if (t.messages > 0) line += fmt::format(", from {:.3f} to {:.3f} s", t.span.from_s, t.span.to_s);
  if (!t.gaps.empty()) {
    const auto longest = std::max_element(
        t.gaps.begin(), t.gaps.end(),
        [](const TimeSpan& a, const TimeSpan& b) { return a.to_s - a.from_s < b.to_s - b.from_s; });
    line += fmt::format(", {} gaps, the longest {:.3g} s at {:.3f} s", t.gaps.size(),
                        longest->to_s - longest->from_s, longest->from_s);
  }
  if (t.age) {
    line += fmt::format(", received {:.3g} s later than stamped ({:.3g} to {:.3g})",
                        t.age->median_s, t.age->least_s, t.age->most_s);
  }
  if (!t.frames.empty()) line += fmt::format(", frame {}", fmt::join(t.frames, " or "));
  if (!t.content.empty()) line += fmt::format(", {}", t.content);
  if (!t.use.empty()) line += fmt::format(" <- {}", t.use);
  fmt::print("{}\n", line);
}

/// Without what is left of a zero after turning it about.
Eigen::Vector3d clean(const Eigen::Vector3d& values) {
  constexpr double kFine = 1e12;
  return (values * kFine).array().round() / kFine + 0.0;
}

/// xyz and rpy as they are shown.
RpyPose shown(const Eigen::Isometry3d& pose) {
  const RpyPose exact = RpyPose::of(pose);
  return {clean(exact.xyz), clean(exact.rpy)};
}

void print(const RecordingInfo& info) {
  fmt::print("{}: {}", info.path, info.kind);
  if (info.bytes > 0) fmt::print(", {:.3g} MB", 1e-6 * static_cast<double>(info.bytes));
  fmt::print("\n");
  for (const RecordedTopic& topic : info.topics) printTopic(topic);
  for (const FrameInfo& frame : info.frames) {
    const auto [p, rpy] = shown(frame.pose);
    fmt::print("  frame {} in {}: xyz {:.4g} {:.4g} {:.4g} m, rpy {:.4g} {:.4g} {:.4g} rad{}\n",
               frame.name, frame.parent, p.x(), p.y(), p.z(), rpy.x(), rpy.y(), rpy.z(),
               frame.isStill ? "" : " at first, it moves");
  }
  if (info.camera) {
    const PinholeCamera& c = *info.camera;
    fmt::print("  camera {}x{}, fx {:.6g}, fy {:.6g}, cx {:.6g}, cy {:.6g} px\n", c.width, c.height,
               c.fx, c.fy, c.cx, c.cy);
  }
  for (const std::string& note : info.notes) fmt::print("note: {}\n", note);
  fmt::print("{}\n", info.missing.empty() ? "it can be replayed" : "missing: " + info.missing);
}

nlohmann::ordered_json toJson(const RecordedTopic& t) {
  nlohmann::ordered_json json = {{"name", t.name},
                                 {"type", t.type},
                                 {"use", t.use},
                                 {"messages", t.messages},
                                 {"unreadable", t.unreadable},
                                 {"rate", t.rate_hz},
                                 {"from", t.span.from_s},
                                 {"to", t.span.to_s},
                                 {"content", t.content},
                                 {"frames", t.frames}};
  auto& gaps = json["gaps"] = nlohmann::ordered_json::array();
  for (const TimeSpan& gap : t.gaps) gaps.push_back({gap.from_s, gap.to_s});
  json["received_later"] = nullptr;
  if (t.age) {
    json["received_later"] = {
        {"median", t.age->median_s}, {"least", t.age->least_s}, {"most", t.age->most_s}};
  }
  return json;
}

void printJson(const RecordingInfo& info) {
  nlohmann::ordered_json json = {{"path", info.path}, {"kind", info.kind}, {"bytes", info.bytes}};
  auto& topics = json["topics"] = nlohmann::ordered_json::array();
  for (const RecordedTopic& topic : info.topics) topics.push_back(toJson(topic));
  auto& frames = json["frames"] = nlohmann::ordered_json::array();
  for (const FrameInfo& frame : info.frames) {
    const auto [p, rpy] = shown(frame.pose);
    frames.push_back({{"name", frame.name},
                      {"parent", frame.parent},
                      {"xyz", {p.x(), p.y(), p.z()}},
                      {"rpy", {rpy.x(), rpy.y(), rpy.z()}},
                      {"still", frame.isStill}});
  }
  json["notes"] = info.notes;
  json["replayable"] = info.missing.empty();
  json["missing"] = info.missing;
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void describe(const InfoArguments& a) {
  const RecordingInfo info = describeRecording(a.recording, a.source);
  if (a.json) {
    printJson(info);
  } else {
    print(info);
  }
}

}  // namespace

void addInfo(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "info", "What a bag or a sequence has: topics, rates, gaps, clocks, frames, what is missing");
  auto a = std::make_shared<InfoArguments>();
  command->add_option("RECORDING", a->recording, "Folder or bag: see doc/formats.md")->required();
  addSourceOptions(*command, a->source);
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->callback([a] { describe(*a); });
}

}  // namespace depthservo
