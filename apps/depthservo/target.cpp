#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "commands.h"
#include "depthservo/report/TargetSheet.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct TargetArguments {
  std::string kind, out, paper = "a4", family = "36h11", dictionary = "4x4_50";
  double size = 0.12, square = 0.024;
  std::optional<double> radius, marker;
  std::optional<int> columns, rows;
  int id = 0;
};

SequenceTarget boardOf(const TargetArguments& a) {
  constexpr int kColumns = 7, kRows = 4;
  constexpr double kMarker = 0.75;  // of a square
  SequenceTarget seen;
  BoardTarget& board = seen.board.emplace();
  board.columns = a.columns.value_or(kColumns);
  board.rows = a.rows.value_or(kRows);
  board.square = a.square;
  if (a.kind == "charuco") {
    constexpr double kMicrons = 1e6;
    const double byDefault = std::round(kMarker * a.square * kMicrons) / kMicrons;
    board.markers = {a.dictionary, a.marker.value_or(byDefault)};
    const auto known = arucoDictionaries();
    if (std::find(known.begin(), known.end(), a.dictionary) == known.end()) {
      refuseOption("--dictionary",
                   fmt::format("there is no ArUco dictionary '{}'; the nearest is '{}'",
                               a.dictionary, nearestWord(a.dictionary, known)));
    }
  }
  const std::string why = board.objection();
  if (!why.empty()) refuseOption("target", why);
  seen.target.points = board.corners();
  return seen;
}

SequenceTarget targetOf(const TargetArguments& a) {
  SequenceTarget seen;
  if (a.kind == "dots") {
    constexpr int kDots = 2;
    const int columns = a.columns.value_or(kDots), rows = a.rows.value_or(kDots);
    for (const auto& [name, dots] : {std::pair("--columns", columns), std::pair("--rows", rows)}) {
      if (dots > 8) refuseOption(name, fmt::format("is 2 to 8 for dots, not {}", dots));
    }
    const double step = a.size / std::max(1, columns - 1);
    const double radius = a.radius.value_or(0.15 * step);
    if (!(radius < 0.4 * step)) {
      refuseOption("--radius", fmt::format("dots of {:g} m radius, {:g} m apart, leave too little "
                                           "white between them; at most 0.4 of the distance",
                                           radius, step));
    }
    seen.target = dotGrid(columns, rows, a.size, radius);
    return seen;
  }
  if (a.kind == "chessboard" || a.kind == "charuco") return boardOf(a);
  if (a.kind != "apriltag") {
    refuseOption(
        "target",
        fmt::format("'{}' is not known; expected dots, apriltag, chessboard or charuco", a.kind));
  }
  const auto families = aprilTagFamilies();
  if (std::find(families.begin(), families.end(), a.family) == families.end()) {
    refuseOption("--family", fmt::format("there is no AprilTag family '{}'; the nearest is '{}'",
                                         a.family, nearestWord(a.family, families)));
  }
  if (a.id >= aprilTagCount(a.family)) {
    refuseOption("--id", fmt::format("family {} has the tags 0 to {}", a.family,
                                     aprilTagCount(a.family) - 1));
  }
  seen.tags = AprilTagTarget{a.family, {{a.id, a.size, Eigen::Isometry3d::Identity()}}};
  seen.target.points = seen.tags->corners();
  return seen;
}

void printTarget(const TargetArguments& a) {
  const SequenceTarget seen = targetOf(a);
  writeTargetSheet(seen, Paper::named(a.paper), a.out);
  fmt::print(stderr,
             "{}: print it at 100 %; the lines on stdout go into a scenario or sequence.yaml\n",
             a.out);
  fmt::print("{}", targetYaml(seen));
}

}  // namespace

void addTarget(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("target", "Draw a target to print, in its true size");
  auto a = std::make_shared<TargetArguments>();
  command->add_option("KIND", a->kind, "dots | apriltag | chessboard | charuco")->required();
  command->add_option("--out", a->out, "PDF to write; must not exist")
      ->required()
      ->type_name("FILE");
  command->add_option("--paper", a->paper, "a4 | letter")
      ->type_name("PAPER")
      ->capture_default_str();
  command
      ->add_option("--size", a->size,
                   "Between the outer columns of dots, or the corners of the tag [m]")
      ->type_name("M")
      ->check(within(0.001, 10.0))
      ->capture_default_str();
  command->add_option("--radius", a->radius, "Of a dot [m]; default: 0.15 of their distance")
      ->type_name("M")
      ->check(aboveZero());
  command
      ->add_option("--columns", a->columns,
                   "Of dots, default 2; inner corners of a board in a row, default 7")
      ->type_name("N")
      ->check(within(2, BoardTarget::kMost));
  command
      ->add_option("--rows", a->rows,
                   "Of dots, default 2; inner corners of a board in a column, default 4")
      ->type_name("N")
      ->check(within(2, BoardTarget::kMost));
  command->add_option("--square", a->square, "Side of a square of a board [m]")
      ->type_name("M")
      ->check(within(0.001, 1.0))
      ->capture_default_str();
  command
      ->add_option("--marker", a->marker,
                   "Side of a marker of a ChArUco board [m]; default: 0.75 of a square")
      ->type_name("M")
      ->check(aboveZero());
  command->add_option("--dictionary", a->dictionary, "Of the markers of a ChArUco board")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--family", a->family, "Of AprilTags")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--id", a->id, "Number of the tag")
      ->type_name("N")
      ->check(zeroOrMore())
      ->capture_default_str();
  command->callback([a] { printTarget(*a); });
}

}  // namespace depthservo
