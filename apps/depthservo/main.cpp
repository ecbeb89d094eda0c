#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <visp3/core/vpConfig.h>

#include <Eigen/Core>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/version.hpp>
#include <string>

#include "commands.h"
#include "depthservo/text/InputError.h"
#include "depthservo/text/InterruptWatch.h"
#include "failure.h"
#include "refusal.h"

namespace depthservo {
namespace {

constexpr const char* kExamples = R"(Image-based visual servoing with observed depth.

Examples:
  depthservo run data/scenarios/unicycle-4dots.yaml --out my-run    servo, then open my-run/report.html
  depthservo run unicycle-4dots --set depth.initial=8 --json        a shipped one, another guess, JSON
  depthservo new my-scenario.yaml                                   a commented one to begin with
  depthservo keys depth                                             what can be set, with unit and range
  depthservo record SCENARIO my-sequence                            keep images, odometry and truth
  depthservo replay my-sequence --prior 3 --out my-replay           observe depth on recorded data
  depthservo compare my-sequence --out my-comparison                all estimators on the same data
  depthservo report my-run                                          make report.html anew
  depthservo report my-run other-run                                one page of both, side by side
  depthservo sweep guess-by-start --out my-sweep                    many runs: success maps, my-sweep/report.html
  depthservo run --of my-sweep --row 17 --out that-run              one of them again, with its report
  depthservo reproduce all                                          papers' simulations, theirs vs ours
  depthservo live --source 0 --camera camera.yaml --target target.yaml --twist twists.fifo
  depthservo teach --source 0 --camera camera.yaml --target target.yaml --out my-goal
  depthservo servo --source 0 --goal my-goal --robot robot.yaml --twist twists --command commands
  depthservo robot unicycle-4dots --images images --twist twists --command commands
  depthservo target dots --out dots.pdf > target.yaml               a plate to print, in its true size
  depthservo noise still-recording                                  the pixel noise of your camera
  depthservo info drive.mcap                                        topics, rates, clocks and frames of a bag
  depthservo replay drive.bag --topics image=/camera/image_raw,odometry=/odom --target target.yaml
  depthservo calibrate my-drive --out robot.yaml                    errors of your robot, for --errors
  depthservo gains --law observer --fps 30 --kappa 0.1              gains for a camera's frame rate

Exit codes: 0 as expected (or converged, or timeout), 1 not as expected, 2 bad arguments or input,
3 any other outcome, 4 stopped by safety, 70 internal error, 130 Ctrl-C. Words go to stderr, data to stdout.)";

/// Of depthservo, and of the libraries it was built with.
std::string versions() {
  return fmt::format("depthservo {}\nViSP {}.{}.{}, OpenCV {}, Eigen {}.{}.{}", DEPTHSERVO_VERSION,
                     VISP_VERSION_MAJOR, VISP_VERSION_MINOR, VISP_VERSION_PATCH, CV_VERSION,
                     EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION);
}

/// Words on stderr go nowhere between `begin` and `end`.
class Quiet {
 public:
  ~Quiet() { end(); }
  void begin() {
    std::fflush(stderr);
    kept_ = dup(STDERR_FILENO);
    const int nowhere = open("/dev/null", O_WRONLY);
    dup2(nowhere, STDERR_FILENO);
    close(nowhere);
  }
  void end() {
    if (kept_ < 0) return;
    std::fflush(stderr);
    dup2(kept_, STDERR_FILENO);
    close(kept_);
    kept_ = -1;
  }

 private:
  int kept_ = -1;
};

/// \throw InputError what was printed has not arrived: a full disk behind `> file`
void requireWritten() {
  if (std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  throw InputError({"standard output", 0, ""},
                   fmt::format("cannot be written: {}", std::strerror(errno)));
}

int run(int argc, char** argv) {
  CLI::App app{kExamples, "depthservo"};
  app.set_version_flag("--version", versions());
  app.require_subcommand(1);
  app.get_formatter()->column_width(44);
  int exitCode = kMet;
  for (const auto add : kSubcommands) add(app, exitCode);
  Quiet quiet;
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    command->add_flag_callback(
        "--quiet", [&quiet] { quiet.begin(); }, "No words on stderr but why it failed");
  }
  try {
    // OpenCV waits for ever for a thread that it could not make, and gains nothing here by threads.
    cv::setNumThreads(1);
    try {
      app.parse(argc, argv);
    } catch (const CLI::Success& success) {
      exitCode = app.exit(success);
    }
    requireWritten();
    return exitCode;
  } catch (const CLI::ParseError& error) {
    quiet.end();
    fmt::print(stderr, "depthservo: {}\n", refusal(app, error, {argv + 1, argv + argc}));
    return kBadInput;
  } catch (const Interrupted& interrupted) {
    quiet.end();
    fmt::print(stderr, "interrupted; nothing was written\n");
    std::signal(interrupted.signal, SIG_DFL);
    std::raise(interrupted.signal);
    return kBadInput;
  } catch (...) {
    quiet.end();
    return tellFailure(std::current_exception());
  }
}

}  // namespace
}  // namespace depthservo

int main(int argc, char** argv) {
  // Data and words may go to the same file: whole lines, in their order.
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit for files is an error of writing, not the end
  return depthservo::run(argc, argv);
}
