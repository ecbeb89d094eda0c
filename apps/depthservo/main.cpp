#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "commands.h"
#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

constexpr const char* kExamples = R"(Image-based visual servoing with observed depth.

Examples:
  depthservo run data/scenarios/unicycle-4dots.yaml --out my-run    servo, then open my-run/report.html
  depthservo run SCENARIO --set depth.initial=8 --json              another guess, result as JSON
  depthservo record SCENARIO my-sequence                            keep images, odometry and truth
  depthservo replay my-sequence --prior 3 --out my-replay           observe depth on recorded data
  depthservo compare my-sequence --out my-comparison                all estimators on the same data
  depthservo report my-run                                          make report.html anew
  depthservo reproduce all                                          papers' simulations, theirs vs ours
  depthservo live --source 0 --camera camera.yaml --target target.yaml --twist twists.fifo
  depthservo target dots --out dots.pdf > target.yaml               a plate to print, in its true size
  depthservo noise still-recording                                  the pixel noise of your camera
  depthservo gains --law observer --fps 30 --kappa 0.1              gains for a camera's frame rate

Exit codes: 0 as expected (or converged, or timeout), 1 not as expected, 2 bad arguments or input,
3 any other outcome. Words go to stderr, data to stdout.)";

std::vector<std::string> subcommands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  return names;
}

/// Every word that may stand at this place: an option of the subcommand in use, or without one the
/// subcommands too.
std::vector<std::string> validWords(const CLI::App& app) {
  const bool isInside = !app.get_subcommands().empty();
  std::vector<std::string> words = isInside ? std::vector<std::string>() : subcommands(app);
  for (const CLI::Option* option :
       (isInside ? *app.get_subcommands().front() : app).get_options()) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  }
  return words;
}

std::string refusal(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> extras = app.remaining(true);
  if (!extras.empty()) {
    return fmt::format("'{}' is not known here; did you mean '{}'?", extras.front(),
                       nearestWord(extras.front(), validWords(app)));
  }
  if (app.get_subcommands().empty()) {
    return fmt::format("expected one of: {} (see depthservo --help)",
                       fmt::join(subcommands(app), ", "));
  }
  std::string text = error.what();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return fmt::format("{} (see depthservo {} --help)", text,
                     app.get_subcommands().front()->get_name());
}

int run(int argc, char** argv) {
  CLI::App app{kExamples, "depthservo"};
  app.set_version_flag("--version", "depthservo " DEPTHSERVO_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(44);
  int exitCode = kMet;
  addRun(app, exitCode);
  addReplay(app, exitCode);
  addRecord(app, exitCode);
  addReport(app, exitCode);
  addCompare(app, exitCode);
  addReproduce(app, exitCode);
  addGains(app, exitCode);
  addLive(app, exitCode);
  addTarget(app, exitCode);
  addNoise(app, exitCode);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "depthservo: {}\n", refusal(app, error));
    return kBadInput;
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "depthservo: {}\n", error.what());
    return kBadInput;
  }
  return exitCode;
}

}  // namespace
}  // namespace depthservo

int main(int argc, char** argv) {
  // Data and words may go to the same file: whole lines, in their order.
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  return depthservo::run(argc, argv);
}
