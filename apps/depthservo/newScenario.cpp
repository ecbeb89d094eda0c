#include <fmt/core.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>

#include "commands.h"
#include "depthservo/scenario/Scenario.h"
#include "depthservo/text/NewFolder.h"
#include "observation.h"

namespace depthservo {
namespace {

constexpr double kNearest_m = 1.5, kFarthest_m = 6;

struct NewArguments {
  std::string file, robot, target;
  double distance_m = 0;
};

constexpr const char* kHead =
    R"(# @robot@, @distance@ m before @target@: `depthservo run FILE --out my-run`, then open my-run/report.html.
# Every key with unit, default and range: `depthservo keys`. Units are m, s, rad and px; the world has z up.

name: @name@
seed: 1                    # of all noise; the same seed gives the same bytes
duration: 40               # s

camera: {width: 640, height: 480, fx: 600, fy: 600, cx: 319.5, cy: 239.5, rate: 30}   # px; rate in images/s

)";

constexpr const char* kDots =
    R"(target:                    # a plate at the origin of the world that faces -x
  type: dots
  points: [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]   # m: x right, y down, seen from the front
  radius: 0.02             # m

)";

constexpr const char* kTag =
    R"(target:                    # a tag at the origin of the world that faces -x
  type: apriltag
  family: 36h11
  tags:
    - {id: 7, size: 0.2}   # m; only the simulated world knows it, unless `assumed_size` says it

)";

constexpr const char* kWheels = R"(robot:
  type: @type@
  camera_offset: [0.07, 0.02, 0.13]      # m, robot frame: x forward, y left, z up
  initial: {x: -@distance@, y: @aside@, theta: 0}   # m, m, rad
  goal: {x: -1, y: 0, theta: 0}          # the image seen from here is the desired one
  limits: {v: 0.5, w: 1.0}               # m/s, rad/s

)";

constexpr const char* kFree = R"(robot:
  type: free               # a camera that moves in all six directions, as on an arm
  initial: {xyz: [-@distance@, @aside@, 0.2], rpy: [-1.5707963267948966, 0, -1.5707963267948966]}   # looks along x
  goal: {xyz: [-1, 0, 0.13], rpy: [-1.5707963267948966, 0, -1.5707963267948966]}

)";

constexpr const char* kTail = R"(sensing:
  source: image            # drawn into images and tracked there; geometry: quicker, without images
  tracker: @tracker@
  pixel_noise: 0.2         # px, 1 sigma per axis
  hidden: []               # e.g. [[7.0, 9.0]]: hidden from 7 s to 9 s

odometry:                  # what the estimator is told of the camera's motion
  rate: 30
  noise: [0.002, 0.001]    # m/s, rad/s, 1 sigma per row
  scale: 1.0               # 1.02: speeds, and so the depths, 2 % too large

depth:
  estimator: filter        # constant | two-frame | nonlinear | window | filter | joint
  initial: 1               # m, first guess of every depth; any will do

control: {gain: 0.5}       # 1/s

# expect: {outcome: converged}   # makes `depthservo run` exit with 1 unless it ends like this
)";

std::string filled(std::string text, const std::map<std::string, std::string>& values) {
  for (const auto& [name, value] : values) {
    const std::string mark = "@" + name + "@";
    for (std::size_t at = 0; (at = text.find(mark)) != std::string::npos;) {
      text.replace(at, mark.size(), value);
    }
  }
  return text;
}

std::string textOf(const NewArguments& a) {
  const bool isTag = a.target == "apriltag";
  const std::string robot = a.robot == "free" ? kFree : kWheels;
  return filled(
      std::string(kHead) + (isTag ? kTag : kDots) + robot + kTail,
      {{"name", fmt::format("{}-{}", a.robot, a.target)},
       {"robot", a.robot == "free" ? "A free camera" : "A robot (" + a.robot + ") with a camera"},
       {"target", isTag ? "an AprilTag" : "a plate with four dots"},
       {"type", a.robot},
       {"distance", fmt::format("{:g}", a.distance_m)},
       {"aside", fmt::format("{:g}", std::round(8 * a.distance_m) / 100)},
       {"tracker", isTag ? "apriltag" : "dots"}});
}

/// The answer of whoever sits at the terminal; none: the default.
std::string answer(const std::string& question, const std::string& byDefault) {
  fmt::print(stderr, "{} [{}] ", question, byDefault);
  std::string line;
  std::getline(std::cin, line);
  return line.empty() ? byDefault : line;
}

/// Asks for what was not given, where there is somebody to ask; the defaults otherwise.
void ask(NewArguments& a) {
  const bool isAsked = isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0;
  const auto given = [&](const char* question, const char* byDefault) {
    return isAsked ? answer(question, byDefault) : byDefault;
  };
  if (a.robot.empty())
    a.robot = given("What carries the camera: unicycle, omni, free?", "unicycle");
  if (a.target.empty()) a.target = given("What does it look at: dots, apriltag?", "dots");
  if (a.distance_m == 0) {
    const std::string text = given("From how far does it start, 1.5 to 6 m?", "3");
    if (!CLI::detail::lexical_cast(text, a.distance_m)) {
      refuseOption("--distance", fmt::format("'{}' is not a number", text));
    }
  }
}

void writeNew(NewArguments a) {
  requireNewFile(a.file);
  ask(a);
  const std::vector<std::string> robots{"unicycle", "omni", "free"}, targets{"dots", "apriltag"};
  if (std::find(robots.begin(), robots.end(), a.robot) == robots.end()) {
    refuseWord("--robot", a.robot, robots);
  }
  if (std::find(targets.begin(), targets.end(), a.target) == targets.end()) {
    refuseWord("--target", a.target, targets);
  }
  if (!(a.distance_m >= kNearest_m && a.distance_m <= kFarthest_m)) {
    refuseOption("--distance", fmt::format("expected {:g} to {:g} m, got {:g}", kNearest_m,
                                           kFarthest_m, a.distance_m));
  }
  makeFile(a.file, textOf(a));
  Scenario::load(a.file);
  fmt::print(stderr, "written: {}; depthservo run {} --out my-run\n", a.file, a.file);
}

}  // namespace

void addNew(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "new", "Write a commented scenario to begin with; asks three questions on a terminal");
  auto a = std::make_shared<NewArguments>();
  command->add_option("FILE", a->file, "Scenario to write; must not exist")->required();
  command->add_option("--robot", a->robot, "unicycle (default) | omni | free")->type_name("NAME");
  command->add_option("--target", a->target, "dots (default) | apriltag")->type_name("NAME");
  command->add_option("--distance", a->distance_m, "From the target at the start [m]; default 3")
      ->type_name("M");
  command->callback([a] { writeNew(*a); });
}

}  // namespace depthservo
