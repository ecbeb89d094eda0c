#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "depthservo/experiments/SweepFolder.h"
#include "depthservo/scenario/run.h"
#include "papers/DeLuca2008.h"
#include "papers/EmbeddedSweeps.h"

namespace depthservo::deluca2008 {
namespace {

/// Index into the palette of the figures, after those of the guesses.
constexpr int kStartColour = 5;

/// Of a row: features if there is a choice, depths, guess, start.
using Cells = std::vector<std::string>;

const std::vector<std::string> kPointGuesses = {"1.6", "3", "5", "8"};         // [m]
const std::vector<std::string> kMomentGuesses = {"0.9", "3", "5", "8", "16"};  // [m]

/// The servo from the same starts, with the depth from several sources and guesses: rows of a
/// sweep of data/sweeps/deluca2008.
class Experiment {
 public:
  /// \param id of its rows in data/papers
  Experiment(std::string id, std::string_view text, std::string_view scenario,
             std::vector<std::string> guesses, std::string features = "")
      : id_(std::move(id)),
        guesses_(std::move(guesses)),
        features_(std::move(features)),
        sweep_(std::make_shared<const Sweep>(
            Sweep::Source{"deluca2008", std::string(text), "scenario", std::string(scenario)})) {
    std::map<Cells, std::size_t> rows;
    for (std::size_t i = 0; i < sweep_->size(); ++i) rows[sweep_->row(i).cells] = i;
    rows_ = std::make_shared<const std::map<Cells, std::size_t>>(std::move(rows));
    for (const SweepCase& start : sweep_->options().axes.back().cases)
      starts_.push_back(start.name);
  }

  /// The same through images, from some of the starts.
  Experiment throughImages(std::vector<std::string> from) const {
    Experiment seen = *this;
    seen.id_ += "/images";
    seen.starts_ = std::move(from);
    seen.overrides_ = {"sensing.source=image"};
    return seen;
  }

  const std::string& id() const { return id_; }
  const std::vector<std::string>& guesses() const { return guesses_; }
  const std::vector<std::string>& starts() const { return starts_; }

  /// How the servo ends, by start. \param depths, guess as in the sweep
  std::vector<std::string> outcomes(const std::string& depths, const std::string& guess) const {
    std::vector<std::size_t> rows;
    for (const std::string& start : starts_) rows.push_back(row(depths, guess, start));
    std::vector<std::string> outcomes;
    for (SweepResult& result : runRows(*sweep_, rows, overrides_)) {
      outcomes.push_back(std::move(result.outcome));
    }
    return outcomes;
  }

  /// Everything of one run through images, to its very end.
  RunLog log(const std::string& depths, const std::string& guess, const std::string& start) const {
    const Sweep::Row one = sweep_->row(row(depths, guess, start));
    return run(sweep_->scenario(one, {"sensing.source=image", "control.tolerance=0.1"}));
  }

 private:
  std::size_t row(const std::string& depths, const std::string& guess,
                  const std::string& start) const {
    Cells cells{depths, guess, start};
    if (!features_.empty()) cells.insert(cells.begin(), features_);
    return rows_->at(cells);
  }

  std::string id_;
  std::vector<std::string> guesses_;
  std::string features_;  ///< empty: there is no choice
  std::shared_ptr<const Sweep> sweep_;
  std::shared_ptr<const std::map<Cells, std::size_t>> rows_;
  std::vector<std::string> overrides_;
  std::vector<std::string> starts_;
};

int count(const std::vector<std::string>& outcomes, Outcome outcome) {
  return static_cast<int>(std::count(outcomes.begin(), outcomes.end(), toString(outcome)));
}

/// Starts from which the servo ends so with each of the guesses.
std::vector<bool> always(const Experiment& experiment, const std::string& depths, Outcome outcome) {
  std::vector<bool> all(experiment.starts().size(), true);
  for (const std::string& guess : experiment.guesses()) {
    const std::vector<std::string> outcomes = experiment.outcomes(depths, guess);
    for (std::size_t i = 0; i < all.size(); ++i)
      all[i] = all[i] && outcomes[i] == toString(outcome);
  }
  return all;
}

int reachedFromAll(const Experiment& experiment, const std::string& depths) {
  const std::vector<bool> reached = always(experiment, depths, Outcome::converged);
  return static_cast<int>(std::count(reached.begin(), reached.end(), true));
}

/// From how many starts the goal is reached, by source of the depth.
void addSuccess(Measurements& measured, const Experiment& experiment) {
  const auto id = [&](const std::string& rest) { return experiment.id() + "/" + rest; };
  const int truth =
      count(experiment.outcomes("true", experiment.guesses().front()), Outcome::converged);
  measured.add(id("true-depth"), truth);
  for (const std::string depths : {"observer", "object"}) {
    const int reached = reachedFromAll(experiment, depths);
    measured.add(id(depths), reached,
                 reached < truth
                     ? fmt::format("{} of the true depths' {} starts fail with one of the guesses",
                                   truth - reached, truth)
                     : "");
  }
  for (const std::string& guess : experiment.guesses()) {
    const std::vector<std::string> outcomes = experiment.outcomes("constant", guess);
    const int lost = count(outcomes, Outcome::leftImage);
    measured.add(id("constant/" + guess), count(outcomes, Outcome::converged),
                 lost == 0 ? "never leaves the image"
                           : fmt::format("leaves the image from {} starts", lost));
  }
}

/// Starts from which the observer reaches the goal with all guesses and all four constants leave
/// the image: the contrast that the paper shows.
void addContrast(Measurements& measured, const Experiment& experiment, const std::string& id) {
  const std::vector<bool> observed = always(experiment, "object", Outcome::converged);
  const std::vector<bool> lost = always(experiment, "constant", Outcome::leftImage);
  int both = 0;
  for (std::size_t i = 0; i < lost.size(); ++i) both += observed[i] && lost[i] ? 1 : 0;
  measured.add(id, both,
               fmt::format("the observer reaches the goal with all guesses from {} of {} starts",
                           std::count(observed.begin(), observed.end(), true), observed.size()));
}

/// The starts with the robot straight ahead, every other of them.
std::vector<std::string> fourStraight(const Experiment& experiment) {
  const std::vector<std::string>& all = experiment.starts();
  return {all[2], all[12], all[22], all[32]};
}

/// What a servo from one start does with several guesses.
struct Story {
  Panel image = Panel::labelled("", "u [px]", "v [px]");
  Panel depth = Panel::labelled("", "time [s]", "used / true depth");
  Panel error = Panel::labelled("", "time [s]", "distance from goal [px]");

  void add(const RunLog& log, const std::string& guess, int colour) {
    const Curve unnamed = Curve::named("", Curve::Style::line, colour);
    std::vector<Curve> dots(log.goals.size(), unnamed);
    dots[0].title = guess + " m";
    Curve ratio = unnamed, distance = unnamed;
    for (const FrameRecord& frame : log.frames) {
      double used = 0;
      for (const FeatureRecord& dot : frame.features) {
        dots[static_cast<std::size_t>(dot.id)].add(dot.u_true, dot.v_true);
        used += dot.estimate.Z() / dot.Z_true / static_cast<double>(frame.features.size());
      }
      ratio.add(frame.time_s, used);
      distance.add(frame.time_s, frame.error_px);
    }
    image.curves.insert(image.curves.end(), dots.begin(), dots.end());
    depth.curves.push_back(ratio);
    error.curves.push_back(distance);
  }
};

/// With the depth observed, or as guessed.
Story storyOf(const Experiment& experiment, const std::string& start, bool isObserved) {
  Story story;
  int left = 0;
  Curve starts = Curve::named("start", Curve::Style::points, kStartColour);
  Curve goals = Curve::named("goal", Curve::Style::points, Curve::kBlack);
  PinholeCamera camera;
  for (std::size_t g = 0; g < experiment.guesses().size(); ++g) {
    const std::string& guess = experiment.guesses()[g];
    const RunLog log = experiment.log(isObserved ? "object" : "constant", guess, start);
    story.add(log, guess, static_cast<int>(g));
    left += log.outcome == Outcome::leftImage ? 1 : 0;
    if (g > 0) continue;
    camera = log.camera;
    for (const FeatureRecord& dot : log.frames.front().features) {
      starts.add(dot.u_true, dot.v_true);
    }
    for (const Eigen::Vector2d& pixel : log.goals) goals.add(pixel.x(), pixel.y());
  }
  story.image.title = fmt::format(
      "the depth {}: {}", isObserved ? "is observed" : "stays as guessed",
      left == 0 ? "none leaves the image"
                : fmt::format("{} of {} leave the image", left, experiment.guesses().size()));
  story.image.axes = Panel::Axes::image;
  story.image.xRange = {0., static_cast<double>(camera.width)};
  story.image.yRange = {0., static_cast<double>(camera.height)};
  story.image.curves.push_back(starts);
  story.image.curves.push_back(goals);
  story.depth.logY = true;
  story.depth.xRange = story.error.xRange = {0, 20};
  story.depth.yRange = {0.1, 20};
  story.depth.curves.push_back(Curve::level(1, 0, 20));
  story.error.yRange = {0, 1.2 * story.error.curves.front().y.front()};
  return story;
}

/// Side by side.
Figure contrastFigure(const std::string& name, const Experiment& experiment,
                      const std::string& start) {
  const Story observed = storyOf(experiment, start, true);
  const Story guessed = storyOf(experiment, start, false);
  Figure figure;
  figure.name = name;
  figure.columns = 2;
  figure.panels = {observed.image, guessed.image,  observed.depth,
                   guessed.depth,  observed.error, guessed.error};
  return figure;
}

}  // namespace

void addServoExperiments(Experiments& r, const ReproduceOptions& options) {
  Measurements& measured = r.measured;
  const EmbeddedSweeps& sweeps = embeddedSweeps();
  const Experiment vga("7.2/640x480", sweeps.points640, sweeps.points, kPointGuesses);
  const Experiment xga("7.2/1024x768", sweeps.points1024, sweeps.points, kPointGuesses);
  for (const Experiment& points : {vga, xga}) {
    addSuccess(measured, points);
    measured.add(points.id() + "/observer/slower", reachedFromAll(points, "slower"));
    measured.add(points.id() + "/euler", reachedFromAll(points, "euler"));
  }
  measured.add(vga.id() + "/euler/no-speed-limit", reachedFromAll(vga, "euler-fast"));
  measured.add(vga.id() + "/constant/goal",
               count(vga.outcomes("constant", "0.97"), Outcome::converged));

  const Experiment search(vga.id(), sweeps.search640, sweeps.points, kPointGuesses);
  const Experiment late(xga.id(), sweeps.search1024late, sweeps.points, kPointGuesses);
  addContrast(measured, search, search.id() + "/contrast");
  addContrast(measured, late, late.id() + "/contrast/latency");
  addSuccess(measured, vga.throughImages(options.full ? vga.starts() : fourStraight(vga)));
  if (options.full) {
    addContrast(measured, search.throughImages(search.starts()), search.id() + "/contrast/images");
  }

  std::vector<Experiment> moments;
  for (const auto& [size, text] :
       {std::pair{"640x480", sweeps.moments640}, {"1024x768", sweeps.moments1024}}) {
    const std::string id = fmt::format("7.3/{}", size);
    moments.emplace_back(id, text, sweeps.moments, kMomentGuesses, "normalised");
    moments.emplace_back(id + "/pixels", text, sweeps.moments, kMomentGuesses, "pixels");
  }
  for (const Experiment& experiment : moments) addSuccess(measured, experiment);
  const Experiment& first = moments.front();
  measured.add(first.id() + "/loose-clamp",
               count(first.outcomes("loose", "0.9"), Outcome::converged));
  addSuccess(measured, first.throughImages(options.full ? first.starts() : fourStraight(first)));

  r.figures.push_back(contrastFigure("points", vga, "-0.99 m -15 deg"));
  r.figures.push_back(contrastFigure("points-latency", late, "+0.00 m +30 deg"));
  r.figures.push_back(contrastFigure("moments", first, "+1.05 m +0 deg"));
}

}  // namespace depthservo::deluca2008
