#include <fmt/core.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "ProgressBar.h"
#include "commands.h"
#include "depthservo/experiments/PixelNoise.h"
#include "depthservo/observation/words.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct NoiseArguments {
  std::string sequence, source, target, tracker = "auto";
  SequenceOptions options;
  std::size_t images = 300;
  bool json = false;
};

PixelNoise measure(const NoiseArguments& a) {
  if (a.sequence.empty() == a.source.empty()) {
    refuseOption("noise", "expected a SEQUENCE, or --source with a camera or a video file");
  }
  ProgressBar bar("noise");
  const auto show = [&](double done) { bar.show(done); };
  if (!a.sequence.empty()) {
    SequenceOptions options = a.options;
    options.target = a.target;
    const Sequence sequence(a.sequence, options);
    return measurePixelNoise(sequence, trackerNamed(a.tracker, {"--tracker", 0, ""}), show);
  }
  const SequenceTarget seen = a.target.empty() ? SequenceTarget{} : readTarget(a.target);
  silenceImageLibraries();
  VideoOptions video;
  video.fps = a.options.fps > 0 ? a.options.fps : 1;  // times do not matter
  VideoSource images(a.source, video);
  return measurePixelNoise(images, a.images, seen, trackerNamed(a.tracker, {"--tracker", 0, ""}),
                           show);
}

/// Two digits, upwards: noise that is told too small makes sigma too small.
double rounded(double sigma_px) {
  const double digit = std::pow(10, std::floor(std::log10(sigma_px)) - 1);
  return std::ceil(sigma_px / digit - 1e-9) * digit;
}

void printJson(const PixelNoise& noise) {
  auto points = nlohmann::ordered_json::array();
  for (const PointNoise& point : noise.points) {
    points.push_back({{"id", point.id},
                      {"images", point.images},
                      {"sigma_u", point.sigma_u},
                      {"sigma_v", point.sigma_v},
                      {"moved_px", point.moved_px}});
  }
  const nlohmann::ordered_json json = {
      {"pixel_noise", noise.sigma_px}, {"worst_px", noise.worst_px}, {"moved_px", noise.moved_px},
      {"has_moved", noise.hasMoved},   {"is_white", noise.isWhite},  {"points", points}};
  fmt::print("{}\n", json.dump(2));
}

void printNoise(const NoiseArguments& a) {
  const PixelNoise noise = measure(a);
  for (const PointNoise& point : noise.points) {
    fmt::print(stderr, "  point {}: u {:.4f} px, v {:.4f} px in {} images\n", point.id,
               point.sigma_u, point.sigma_v, point.images);
  }
  if (noise.hasMoved) {
    fmt::print(stderr, "the camera or the target has moved by {:.2g} px; this is taken out\n",
               noise.moved_px);
  }
  if (!noise.isWhite) {
    fmt::print(
        stderr,
        "successive images are alike: there was fast motion or flicker, and the figure holds "
        "it; record again with everything still\n");
  }
  if (noise.sigma_px == 0) {
    fmt::print(stderr, "all images are the same: a copy, not a recording?\n");
  }
  if (a.json) {
    printJson(noise);
  } else {
    const double sigma_px = noise.sigma_px > 0 ? rounded(noise.sigma_px) : 0;
    fmt::print("pixel_noise: {:.2g}\n", sigma_px);
    fmt::print(stderr,
               "that is: --pixel-noise {:.2g} for replay and live, sensing.assumed_noise "
               "in a scenario\n",
               sigma_px);
  }
}

}  // namespace

void addNoise(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "noise", "Measure the pixel noise to tell the estimators, from a still recording");
  auto a = std::make_shared<NoiseArguments>();
  command->add_option("SEQUENCE", a->sequence, "Folder or bag: see doc/formats.md");
  command->add_option("--source", a->source, "Camera or video file, as in live, instead")
      ->type_name("SOURCE");
  command->add_option("--target", a->target, "What is tracked: YAML file, as in live")
      ->type_name("FILE");
  command->add_option("--images", a->images, "Of a source, at most")
      ->type_name("N")
      ->check(within(15, 100000))
      ->capture_default_str();
  command
      ->add_option("--tracker", a->tracker,
                   "dots | apriltag | chessboard | charuco | klt | tracks; default as in replay")
      ->type_name("NAME");
  command->add_option("--camera", a->options.camera, "As in replay, for a folder without one")
      ->type_name("FILE");
  command->add_option("--fps", a->options.fps, "Images per second of a plain image folder")
      ->type_name("F")
      ->check(aboveZero());
  command->add_flag("--json", a->json, "Print the result as one JSON object on stdout");
  command->callback([a] { printNoise(*a); });
}

}  // namespace depthservo
