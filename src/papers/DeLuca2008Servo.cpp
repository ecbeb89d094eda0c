#include "papers/DeLuca2008Servo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "papers/DeLuca2008.h"

namespace depthservo::deluca2008 {
namespace {

/// Index into the palette of the figures, after those of the guesses.
constexpr int kStartColour = 5;

constexpr double kPointStart_Z = 3.9, kMomentStart_Z = 4.1;  // [m]

const std::vector<double> kPointGuesses = {1.6, 3, 5, 8};      // [m]
const std::vector<double> kMomentGuesses = {.9, 3, 5, 8, 16};  // [m]

/// The same servo from the same starts with several guesses.
class Sweep {
 public:
  Sweep(const Arrangement& arrangement, std::vector<Start> starts, Method method,
        const std::vector<double>& guesses, const Circumstances& circumstances = {})
      : isOfPoints_(method.features == FeatureChoice::points), starts_(starts.size()) {
    for (const double guess : guesses) {
      method.guess = guess;
      byGuess_.push_back(servoFromAll(arrangement, starts, method, circumstances));
    }
  }

  bool isReached(std::size_t guess, std::size_t start) const {
    const Course& course = byGuess_[guess][start];
    return isOfPoints_ ? course.reachedPoints() : course.reachedMoments();
  }
  bool isReachedFromAll(std::size_t start) const {
    for (std::size_t guess = 0; guess < byGuess_.size(); ++guess) {
      if (!isReached(guess, start)) return false;
    }
    return true;
  }
  bool isLostFromAll(std::size_t start) const {
    return std::none_of(byGuess_.begin(), byGuess_.end(),
                        [&](const auto& courses) { return courses[start].stayedInImage; });
  }

  /// Starts from which the goal is reached with this guess.
  int reached(std::size_t guess) const {
    int count = 0;
    for (std::size_t start = 0; start < starts_; ++start) count += isReached(guess, start);
    return count;
  }
  /// Starts from which a dot leaves the image with this guess.
  int lost(std::size_t guess) const {
    const auto& courses = byGuess_[guess];
    return static_cast<int>(std::count_if(courses.begin(), courses.end(), [](const Course& course) {
      return !course.stayedInImage;
    }));
  }
  /// The same as `reached` with each of the guesses.
  int reachedFromAll() const {
    int count = 0;
    for (std::size_t start = 0; start < starts_; ++start) count += isReachedFromAll(start);
    return count;
  }

 private:
  bool isOfPoints_;
  std::size_t starts_;
  std::vector<std::vector<Course>> byGuess_;
};

/// One experiment: its camera, features and guesses.
struct Experiment {
  std::string id;
  Arrangement arrangement;
  FeatureChoice features;
  std::vector<double> guesses;
  double start_Z;

  std::vector<Start> starts() const { return startsOfTables(arrangement, start_Z); }
  Sweep sweep(const std::vector<Start>& from, DepthSource depth,
              const Circumstances& circumstances = {}) const {
    const bool isToldTheTruth = depth == DepthSource::truth;
    return Sweep(arrangement, from, {features, depth},
                 isToldTheTruth ? std::vector<double>{1} : guesses, circumstances);
  }
};

/// From how many starts the goal is reached, by source of the depth.
void addSuccess(Measurements& measured, const Experiment& experiment,
                const std::vector<Start>& starts, const Circumstances& circumstances = {}) {
  const auto id = [&](const std::string& rest) { return experiment.id + "/" + rest; };
  const int truth = experiment.sweep(starts, DepthSource::truth, circumstances).reached(0);
  measured.add(id("true-depth"), truth);
  for (const auto& [name, depth] :
       {std::pair{"observer", DepthSource::observer}, {"object", DepthSource::object}}) {
    const int reached = experiment.sweep(starts, depth, circumstances).reachedFromAll();
    measured.add(id(name), reached,
                 reached < truth
                     ? fmt::format("{} of the true depths' {} starts fail with one of the guesses",
                                   truth - reached, truth)
                     : "");
  }
  const Sweep constant = experiment.sweep(starts, DepthSource::constant, circumstances);
  for (std::size_t i = 0; i < experiment.guesses.size(); ++i) {
    const int lost = constant.lost(i);
    measured.add(id(fmt::format("constant/{:g}", experiment.guesses[i])), constant.reached(i),
                 lost == 0 ? "never leaves the image"
                           : fmt::format("leaves the image from {} starts", lost));
  }
}

Experiment pointExperiment(ImageSize size) {
  return {size == ImageSize::vga ? "7.2/640x480" : "7.2/1024x768", pointArrangement(size),
          FeatureChoice::points, kPointGuesses, kPointStart_Z};
}

Experiment momentExperiment(ImageSize size, FeatureChoice features) {
  return {fmt::format("7.3/{}{}", size == ImageSize::vga ? "640x480" : "1024x768",
                      features == FeatureChoice::momentsInPixels ? "/pixels" : ""),
          momentArrangement(size), features, kMomentGuesses, kMomentStart_Z};
}

/// What else the specification found on sec. 7.2.
void addPointFindings(Measurements& measured, const Experiment& experiment) {
  const auto starts = experiment.starts();
  const auto counted = [&](const Method& method, const Circumstances& circumstances = {}) {
    return Sweep(experiment.arrangement, starts, method, experiment.guesses, circumstances)
        .reachedFromAll();
  };
  measured.add(experiment.id + "/observer/slower",
               counted({FeatureChoice::points, DepthSource::observer, 1, 8000}));
  measured.add(experiment.id + "/euler", counted({FeatureChoice::points, DepthSource::euler}));
  if (experiment.arrangement.camera.width != 640) return;
  Circumstances fast;
  fast.isSpeedLimited = false;
  measured.add(experiment.id + "/euler/no-speed-limit",
               counted({FeatureChoice::points, DepthSource::euler}, fast));
  const Sweep goalDepth(experiment.arrangement, starts,
                        {FeatureChoice::points, DepthSource::constant},
                        {experiment.arrangement.Z_goal});
  measured.add(experiment.id + "/constant/goal", goalDepth.reached(0));
}

/// Starts from which the observer reaches the goal with all guesses and all four constants leave
/// the image: the contrast that the paper shows.
void addContrast(Measurements& measured, const Experiment& experiment, const std::string& id,
                 const Circumstances& circumstances) {
  const auto starts = startsOfSearch(experiment.arrangement);
  const Sweep observed = experiment.sweep(starts, DepthSource::object, circumstances);
  const Sweep constant = experiment.sweep(starts, DepthSource::constant, circumstances);
  int ours = 0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    ours += observed.isReachedFromAll(i) && constant.isLostFromAll(i);
  }
  measured.add(experiment.id + id, ours,
               fmt::format("the observer reaches the goal with all guesses from {} of {} starts",
                           observed.reachedFromAll(), starts.size()));
}

Circumstances throughImages() {
  Circumstances circumstances;
  circumstances.throughImages = true;
  return circumstances;
}

/// A slow loop: commands 0.3 s late, drives of 0.4 s.
Circumstances slowLoop() {
  Circumstances circumstances;
  circumstances.delay = 9;
  circumstances.lag_s = 0.4;
  return circumstances;
}

/// The same through images. Without `full` from four starts with the robot straight ahead.
void addImages(Measurements& measured, Experiment experiment, bool full) {
  std::vector<Start> starts = experiment.starts();
  if (!full) starts = {starts[2], starts[12], starts[22], starts[32]};
  experiment.id += "/images";
  addSuccess(measured, experiment, starts, throughImages());
}

/// What a servo from one start does with several guesses.
struct Story {
  Panel image = Panel::labelled("", "u [px]", "v [px]");
  Panel depth = Panel::labelled("", "time [s]", "used / true depth");
  Panel error = Panel::labelled("", "time [s]", "distance from goal [px]");

  void add(const Course& course, double guess, int colour) {
    const Curve unnamed = Curve::named("", Curve::Style::line, colour);
    std::vector<Curve> dots(4, unnamed);
    dots[0].title = fmt::format("{:g} m", guess);
    Curve ratio = unnamed, distance = unnamed;
    for (const Instant& instant : course.path) {
      double used = 0, squares = 0;
      for (std::size_t i = 0; i < dots.size(); ++i) {
        dots[i].add(instant.pixels[i].x(), instant.pixels[i].y());
        used += instant.Z_used[i] / instant.Z[i] / static_cast<double>(dots.size());
        squares +=
            (instant.pixels[i] - course.goal[i]).squaredNorm() / static_cast<double>(dots.size());
      }
      ratio.add(instant.time_s, used);
      distance.add(instant.time_s, std::sqrt(squares));
    }
    image.curves.insert(image.curves.end(), dots.begin(), dots.end());
    depth.curves.push_back(ratio);
    error.curves.push_back(distance);
  }
};

/// With the depth observed, or as guessed.
Story storyOf(const Experiment& experiment, const Start& start, const Circumstances& circumstances,
              bool isObserved) {
  Story story;
  int stayed = 0;
  Curve starts = Curve::named("start", Curve::Style::points, kStartColour);
  Curve goals = Curve::named("goal", Curve::Style::points, Curve::kBlack);
  for (std::size_t g = 0; g < experiment.guesses.size(); ++g) {
    const Course course =
        servo(experiment.arrangement, start,
              {experiment.features, isObserved ? DepthSource::object : DepthSource::constant,
               experiment.guesses[g]},
              circumstances, Keep::everything);
    story.add(course, experiment.guesses[g], static_cast<int>(g));
    stayed += course.stayedInImage;
    if (g > 0) continue;
    for (const Eigen::Vector2d& pixel : course.path.front().pixels)
      starts.add(pixel.x(), pixel.y());
    for (const Eigen::Vector2d& pixel : course.goal) goals.add(pixel.x(), pixel.y());
  }
  const int left = static_cast<int>(experiment.guesses.size()) - stayed;
  story.image.title =
      fmt::format("the depth {}: {}", isObserved ? "is observed" : "stays as guessed",
                  left == 0 ? "all reach the goal"
                            : fmt::format("{} of {} leave the image", left, stayed + left));
  const PinholeCamera& camera = experiment.arrangement.camera;
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
Figure contrastFigure(const std::string& name, const Experiment& experiment, const Start& start,
                      const Circumstances& circumstances) {
  const Story observed = storyOf(experiment, start, circumstances, true);
  const Story guessed = storyOf(experiment, start, circumstances, false);
  Figure figure;
  figure.name = name;
  figure.columns = 2;
  figure.panels = {observed.image, guessed.image,  observed.depth,
                   guessed.depth,  observed.error, guessed.error};
  return figure;
}

void addFigures(std::vector<Figure>& figures) {
  const Experiment points = pointExperiment(ImageSize::vga),
                   large = pointExperiment(ImageSize::xga),
                   moments = momentExperiment(ImageSize::vga, FeatureChoice::moments);
  constexpr double kDegree = M_PI / 180;
  figures.push_back(contrastFigure("points", points,
                                   {points.starts().front().X, kPointStart_Z, -15 * kDegree},
                                   throughImages()));
  figures.push_back(
      contrastFigure("points-latency", large, {0, kPointStart_Z, 30 * kDegree}, slowLoop()));
  figures.push_back(contrastFigure(
      "moments", moments, {moments.starts().back().X, kMomentStart_Z, 0}, throughImages()));
}

}  // namespace

void addServoExperiments(Experiments& r, const ReproduceOptions& options) {
  Measurements& measured = r.measured;
  const Experiment vga = pointExperiment(ImageSize::vga), xga = pointExperiment(ImageSize::xga);
  for (const Experiment& points : {vga, xga}) {
    addSuccess(measured, points, points.starts());
    addPointFindings(measured, points);
  }
  addContrast(measured, vga, "/contrast", {});
  addContrast(measured, xga, "/contrast/latency", slowLoop());
  addImages(measured, vga, options.full);
  if (options.full) addContrast(measured, vga, "/contrast/images", throughImages());

  for (const ImageSize size : {ImageSize::vga, ImageSize::xga}) {
    for (const FeatureChoice features : {FeatureChoice::moments, FeatureChoice::momentsInPixels}) {
      const Experiment experiment = momentExperiment(size, features);
      addSuccess(measured, experiment, experiment.starts());
    }
  }
  const Experiment moments = momentExperiment(ImageSize::vga, FeatureChoice::moments);
  const Sweep loose(moments.arrangement, moments.starts(),
                    {FeatureChoice::moments, DepthSource::observer, 1, 44000, 0.05}, {0.9});
  measured.add(moments.id + "/loose-clamp", loose.reached(0));
  addImages(measured, moments, options.full);
  addFigures(r.figures);
}

}  // namespace depthservo::deluca2008
