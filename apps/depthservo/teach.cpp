#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "Interruption.h"
#include "commands.h"
#include "depthservo/observation/words.h"
#include "depthservo/sequence/VideoSource.h"
#include "depthservo/servo/TaughtGoal.h"
#include "numbers.h"
#include "observation.h"

namespace depthservo {
namespace {

struct TeachArguments {
  std::string source, camera, target, tracker = "auto", out;
  TeachOptions teach;
  double depth = 0;
  int skip = 0;
};

/// An image file stands for a series of one.
TimedImage imageOf(const TeachArguments& a, const PinholeCamera& camera) {
  VideoOptions video;
  video.width = camera.width;
  video.height = camera.height;
  video.stop = &stopOnInterruption();
  TimedImage image;
  if (auto file = imageIn(a.source)) {
    image.image = std::move(*file);
    return image;
  }
  if (a.source.find('%') != std::string::npos) video.fps = 30;  // of no account
  VideoSource source(a.source, video);
  int skipped = 0;
  for (ImageStatus status; (status = source.next(image)) != ImageStatus::ended;) {
    if (status == ImageStatus::image && skipped++ == a.skip) return image;
  }
  throw InputError({a.source, 0, ""},
                   fmt::format("no image to teach ({} skipped): {}", skipped, source.reason()));
}

const char* nounOf(TrackerKind tracker) {
  return tracker == TrackerKind::dots       ? "dots"
         : tracker == TrackerKind::apriltag ? "corners of tags"
         : tracker == TrackerKind::klt      ? "natural corners"
                                            : "corners of the board";
}

void teachGoal(TeachArguments& a) {
  silenceImageLibraries();
  const PinholeCamera camera = requiredCamera(a.camera);
  SequenceTarget target;
  if (!a.target.empty()) target = readTarget(a.target);
  a.teach.tracker = trackerNamed(a.tracker, {"--tracker", 0, ""});
  if (a.teach.tracker == TrackerKind::tracks) {
    refuseOption("--tracker",
                 "tracks has no image; expected dots, apriltag, chessboard, charuco or klt");
  }
  if (a.depth > 0) a.teach.depth = a.depth;
  const TaughtGoal goal = teach(imageOf(a, camera).image, camera, target, a.teach, a.source);
  writeGoal(goal, a.out);
  fmt::print(stderr, "{}: {} {}", a.out, goal.points.size(), nounOf(goal.tracker));
  if (goal.Z.empty()) {
    fmt::print(stderr,
               "; their depths at the goal are not known (--depth, or --target with sizes)\n");
  } else {
    const auto [least, most] = std::minmax_element(goal.Z.begin(), goal.Z.end());
    fmt::print(stderr, ", {:.3g} to {:.3g} m away\n", *least, *most);
  }
}

}  // namespace

void addTeach(CLI::App& app, int&) {
  CLI::App* command =
      app.add_subcommand("teach", "Keep what a camera sees at a place, as a goal for servo");
  auto a = std::make_shared<TeachArguments>();
  command
      ->add_option("--source", a->source,
                   "Image file, camera (0, /dev/video0, rtsp://...), video file, or pipe of PGM")
      ->required()
      ->type_name("SOURCE");
  command->add_option("--camera", a->camera, "camera_info file of this camera")->type_name("FILE");
  command
      ->add_option("--out", a->out, "Folder of the goal, a sequence of one image; must not exist")
      ->required()
      ->type_name("GOAL");
  command
      ->add_option("--target", a->target,
                   "YAML file with 'target: {...}': with sizes, the depths are known, too")
      ->type_name("FILE");
  command
      ->add_option(
          "--tracker", a->tracker,
          "dots | apriltag | chessboard | charuco | klt; default: the target's, klt without "
          "a target")
      ->type_name("NAME");
  command->add_option("--tag-family", a->teach.tagFamily, "Of AprilTags, without a target")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--corners", a->teach.corners, "Natural corners that are kept")
      ->type_name("N")
      ->check(within(8, 256))
      ->capture_default_str();
  command->add_option("--depth", a->depth, "Of all points at the goal, if known [m]")
      ->type_name("M")
      ->check(aboveZero());
  command->add_option("--skip", a->skip, "Images before the one that is taken")
      ->type_name("N")
      ->check(zeroOrMore());
  command->callback([a] { teachGoal(*a); });
}

}  // namespace depthservo
