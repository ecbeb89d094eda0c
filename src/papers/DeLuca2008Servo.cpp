#include "papers/DeLuca2008Servo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "papers/DeLuca2008.h"

namespace depthservo::deluca2008 {
namespace {

/// Two simulations of the same, with different random numbers, may differ from this many starts.
constexpr int kStarts = 2;

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

/// What the specification of an experiment counts, of 35 starts.
struct Counts {
  int truth, observer, object;
  std::vector<int> constant;  // by guess
};

/// One experiment: its camera, features and guesses.
struct Experiment {
  std::string id, what;
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

std::string allGuesses(const Experiment& experiment) {
  return fmt::format("each of {} wrong guesses", experiment.guesses.size());
}

/// Success by source of the depth, of all 35 starts or of those given, against what is expected.
void successRows(Rows& rows, const Experiment& experiment, const std::vector<Start>& starts,
                 const Circumstances& circumstances, const Counts& expected, int tolerance) {
  const std::string unit = fmt::format("of {}", starts.size());
  const auto id = [&](const std::string& rest) { return experiment.id + "/" + rest; };
  const int truth = experiment.sweep(starts, DepthSource::truth, circumstances).reached(0);
  rows.addWithin(id("true-depth"),
                 experiment.what + ": starts from which the goal is reached with the true depths",
                 expected.truth, truth, unit, tolerance)
      .note = "two inputs for three degrees of freedom: not every start has a way to this goal";

  struct {
    const char* id;
    DepthSource depth;
    int expected;
    const char* name;
  } const observers[] = {
      {"observer", DepthSource::observer, expected.observer, "the observer"},
      {"object", DepthSource::object, expected.object, "the observer, one depth for the plate"}};
  for (const auto& observer : observers) {
    const int ours = experiment.sweep(starts, observer.depth, circumstances).reachedFromAll();
    ReproduceRow& row = rows.addWithin(
        id(observer.id),
        fmt::format("{}: {} reaches the goal with {}, from as many starts as the true depths",
                    experiment.what, observer.name, allGuesses(experiment)),
        observer.expected, ours, unit, tolerance);
    row.paper = "succeeds";
    row.reproduces = ours >= truth;
    if (ours < truth) {
      row.note = fmt::format("{} of the true depths' {} starts fail with one of the guesses",
                             truth - ours, truth);
    }
  }

  const Sweep constant = experiment.sweep(starts, DepthSource::constant, circumstances);
  const bool isOfPoints = experiment.features == FeatureChoice::points;
  for (std::size_t i = 0; i < experiment.guesses.size(); ++i) {
    const double guess = experiment.guesses[i];
    const bool shallSucceed = !isOfPoints && guess <= 3;
    const int ours = constant.reached(i);
    ReproduceRow& row = rows.addWithin(
        id(fmt::format("constant/{:g}", guess)),
        fmt::format(shallSucceed
                        ? "{}: a constant depth of {:g} m does as well as the true depths"
                        : "{}: a constant depth of {:g} m fails where the true depths do not",
                    experiment.what, guess),
        expected.constant[i], ours, unit, tolerance);
    row.paper = shallSucceed ? "succeeds" : "fails";
    row.reproduces = shallSucceed ? ours >= truth : ours < truth;
    const int lost = constant.lost(i);
    row.note =
        lost == 0 ? "never leaves the image" : fmt::format("leaves the image from {} starts", lost);
  }
}

Experiment pointExperiment(ImageSize size) {
  const bool isVga = size == ImageSize::vga;
  return {isVga ? "7.2/640x480" : "7.2/1024x768",
          isVga ? "points, 640x480" : "points, 1024x768",
          pointArrangement(size),
          FeatureChoice::points,
          kPointGuesses,
          kPointStart_Z};
}

Experiment momentExperiment(ImageSize size, FeatureChoice features) {
  const std::string image = size == ImageSize::vga ? "640x480" : "1024x768";
  const bool isInPixels = features == FeatureChoice::momentsInPixels;
  return {fmt::format("7.3/{}{}", image, isInPixels ? "/pixels" : ""),
          fmt::format("moments{}, {}", isInPixels ? " in pixels" : "", image),
          momentArrangement(size),
          features,
          kMomentGuesses,
          kMomentStart_Z};
}

/// What else the specification found on sec. 7.2.
void pointFindings(Rows& rows, const Experiment& experiment, int eulerExpected) {
  const auto starts = experiment.starts();
  const auto counted = [&](const Method& method, const Circumstances& circumstances = {}) {
    return Sweep(experiment.arrangement, starts, method, experiment.guesses, circumstances)
        .reachedFromAll();
  };
  const std::string wrongGuesses = allGuesses(experiment);
  rows.addWithin(experiment.id + "/observer/slower",
                 fmt::format("{}: the observer with k_3 = 8000 instead of 44000, {}",
                             experiment.what, wrongGuesses),
                 experiment.arrangement.camera.width == 640 ? 31 : 28,
                 counted({FeatureChoice::points, DepthSource::observer, 1, 8000}), "of 35", kStarts)
      .note = "slow enough that depths do not contradict each other";
  rows.addWithin(
      experiment.id + "/euler",
      fmt::format("{}: the observer by Euler's method, {}", experiment.what, wrongGuesses),
      eulerExpected, counted({FeatureChoice::points, DepthSource::euler}), "of 35", kStarts);
  if (experiment.arrangement.camera.width != 640) return;
  Circumstances fast;
  fast.isSpeedLimited = false;
  rows.addWithin(
          experiment.id + "/euler/no-speed-limit",
          fmt::format("{}: the same without limits of speed, {}", experiment.what, wrongGuesses),
          11, counted({FeatureChoice::points, DepthSource::euler}, fast), "of 35", kStarts)
      .note = "a depth that is too large asks for a speed that is too large";
  const Sweep goalDepth(experiment.arrangement, starts,
                        {FeatureChoice::points, DepthSource::constant},
                        {experiment.arrangement.Z_goal});
  rows.addWithin(experiment.id + "/constant/goal",
                 experiment.what + ": the constant depth at the goal, if one knows it", 33,
                 goalDepth.reached(0), "of 35", kStarts)
      .note = "as good as the true depths: the observer's merit is not to need it";
}

/// Starts from which the observer reaches the goal with all guesses and all four constants leave
/// the image: the contrast that the paper shows.
void contrastRow(Rows& rows, const Experiment& experiment, const std::string& id,
                 const std::string& what, const Circumstances& circumstances, int expected) {
  const auto starts = startsOfSearch(experiment.arrangement);
  const Sweep observed = experiment.sweep(starts, DepthSource::object, circumstances);
  const Sweep constant = experiment.sweep(starts, DepthSource::constant, circumstances);
  int ours = 0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    ours += observed.isReachedFromAll(i) && constant.isLostFromAll(i);
  }
  ReproduceRow& row =
      rows.addWithin(experiment.id + "/contrast" + id,
                     fmt::format("{}{}: starts from which the observer reaches the goal with all "
                                 "four guesses and every constant leaves the image",
                                 experiment.what, what),
                     expected, ours, fmt::format("of {}", starts.size()), kStarts);
  row.paper = "the pose shown";
  row.reproduces = ours > 0;
  row.note = fmt::format("the observer reaches the goal with all guesses from {} of {} starts",
                         observed.reachedFromAll(), starts.size());
}

/// The same through images. Without `full` from four starts with the robot straight ahead, compared
/// with exact geometry; with it from all, compared with the specification.
void imageRows(Rows& rows, Experiment experiment, const Counts& counts, bool full) {
  std::vector<Start> starts = experiment.starts();
  Counts expected = counts;
  if (!full) {
    starts = {starts[2], starts[12], starts[22], starts[32]};
    expected.truth = experiment.sweep(starts, DepthSource::truth).reached(0);
    expected.observer = experiment.sweep(starts, DepthSource::observer).reachedFromAll();
    expected.object = experiment.sweep(starts, DepthSource::object).reachedFromAll();
    const Sweep constant = experiment.sweep(starts, DepthSource::constant);
    for (std::size_t i = 0; i < experiment.guesses.size(); ++i) {
      expected.constant[i] = constant.reached(i);
    }
  }
  experiment.id += "/images";
  experiment.what += " through images";
  Circumstances circumstances;
  circumstances.throughImages = true;
  successRows(rows, experiment, starts, circumstances, expected, full ? kStarts : 1);
}

// Figures
// -----------------------------------------------------------------------------------------

/// One start, several guesses, with and without the observer, side by side.
class ContrastFigure {
 public:
  ContrastFigure(const Experiment& experiment, const Start& start,
                 const Circumstances& circumstances)
      : experiment_(experiment), start_(start), circumstances_(circumstances) {}

  Figure draw(const std::string& name, const std::string& title, const std::string& caption) {
    figure_.name = name;
    figure_.title = title;
    figure_.caption = caption;
    figure_.columns = 2;
    for (const bool isObserved : {true, false}) side(isObserved);
    for (std::size_t row = 0; row < left_.size(); ++row) {
      figure_.panels.push_back(left_[row]);
      figure_.panels.push_back(right_[row]);
    }
    return figure_;
  }

 private:
  void side(bool isObserved) {
    const PinholeCamera& camera = experiment_.arrangement.camera;
    Panel image = Panel::labelled("", "u [px]", "v [px]");
    Panel depth = Panel::labelled("", "time [s]", "used / true depth");
    Panel error = Panel::labelled("", "time [s]", "distance from goal [px]");
    image.axes = Panel::Axes::image;
    image.xRange = {0., static_cast<double>(camera.width)};
    image.yRange = {0., static_cast<double>(camera.height)};
    depth.logY = true;
    depth.xRange = {0, 20};
    depth.yRange = {0.1, 20};
    error.xRange = {0, 20};

    int stayed = 0;
    for (std::size_t g = 0; g < experiment_.guesses.size(); ++g) {
      const double guess = experiment_.guesses[g];
      const Course course = servo(
          experiment_.arrangement, start_,
          {experiment_.features, isObserved ? DepthSource::object : DepthSource::constant, guess},
          circumstances_, Keep::everything);
      if (course.path.empty()) continue;
      const int colour = static_cast<int>(g);
      const Curve unnamed = Curve::named("", Curve::Style::line, colour);
      std::vector<Curve> dots(4, unnamed);
      dots[0].title = fmt::format("{:g} m", guess);
      stayed += course.stayedInImage;
      Curve ratio = unnamed, distance = unnamed;
      for (const Instant& instant : course.path) {
        double used = 0, squares = 0;
        for (std::size_t i = 0; i < dots.size(); ++i) {
          dots[i].add(instant.pixels[i].x(), instant.pixels[i].y());
          used += instant.Z_used[i] / instant.Z[i] / static_cast<double>(dots.size());
          squares +=
              (instant.pixels[i] - goal()[i]).squaredNorm() / static_cast<double>(dots.size());
        }
        ratio.add(instant.time_s, used);
        distance.add(instant.time_s, std::sqrt(squares));
      }
      image.curves.insert(image.curves.end(), dots.begin(), dots.end());
      depth.curves.push_back(ratio);
      error.curves.push_back(distance);
    }
    error.yRange = {0, 1.2 * error.curves.front().y.front()};
    const int left = static_cast<int>(experiment_.guesses.size()) - stayed;
    image.title = fmt::format(
        "the depth {}: {}", isObserved ? "is observed" : "stays as guessed",
        left == 0 ? "all reach the goal"
                  : fmt::format("{} of {} leave the image", left, experiment_.guesses.size()));
    Curve starts = Curve::named("start", Curve::Style::points, kStartColour);
    for (std::size_t i = 0; i < 4; ++i) {
      starts.add(image.curves[i].x.front(), image.curves[i].y.front());
    }
    Curve goals = Curve::named("goal", Curve::Style::points, Curve::kBlack);
    for (const Eigen::Vector2d& pixel : goal()) goals.add(pixel.x(), pixel.y());
    image.curves.push_back(starts);
    image.curves.push_back(goals);
    depth.curves.push_back(Curve::level(1, 0, 20));
    (isObserved ? left_ : right_) = {image, depth, error};
  }

  std::vector<Eigen::Vector2d> goal() const {
    const Arrangement& a = experiment_.arrangement;
    UnicycleCamera robot = a.robot();
    robot.setPose(a.pose(a.X_goal, a.Z_goal, a.heading));
    const Eigen::Isometry3d cMo = robot.wMc().inverse() * a.wMo();
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector3d& point : a.target().points) {
      const Eigen::Vector3d p = cMo * point;
      pixels.push_back(a.camera.toPixel(p.x() / p.z(), p.y() / p.z()));
    }
    return pixels;
  }

  Experiment experiment_;
  Start start_;
  Circumstances circumstances_;
  Figure figure_;
  std::vector<Panel> left_, right_;
};

void addFigures(std::vector<Figure>& figures) {
  Circumstances images;
  images.throughImages = true;
  const Experiment points = pointExperiment(ImageSize::vga);
  const double headings = M_PI / 180;
  figures.push_back(
      ContrastFigure(points, {points.starts().front().X, kPointStart_Z, -15 * headings}, images)
          .draw("points", "Figures 11 to 14: the same start, four wrong guesses, points",
                "A robot drives until four dots are where they shall be (black), "
                "tracked in synthetic images. Left, the depth is observed on the "
                "way: four guesses end at the goal. Right, it stays as guessed: "
                "too large a depth makes the robot too fast, and the dots leave "
                "the image. Below: the depth in use over the true one, which the "
                "observer finds within seconds; how far the dots are from the "
                "goal."));
  Circumstances late;
  late.delay = 9;
  late.lag_s = 0.4;
  const Experiment large = pointExperiment(ImageSize::xga);
  figures.push_back(
      ContrastFigure(large, {0, kPointStart_Z, 30 * headings}, late)
          .draw("points-latency",
                "The published contrast: all four constants fail, with a slow loop",
                "As before, 1024 x 768 pixels on exact geometry, but with 0.3 s from an image to "
                "its command and drives that take 0.4 s: now the guess of 1.6 m fails too, as in "
                "the paper."));
  const Experiment moments = momentExperiment(ImageSize::vga, FeatureChoice::moments);
  figures.push_back(ContrastFigure(moments, {moments.starts().back().X, kMomentStart_Z, 0}, images)
                        .draw("moments",
                              "Figures 15 to 18: the same start, five wrong guesses, moments",
                              "The features are the barycentre of the four dots and their size. "
                              "Constant depths of 0.9 and 3 m still reach the goal, larger ones "
                              "leave the image; the observer does from all five, as in the "
                              "paper."));
}

}  // namespace

void addServoExperiments(Rows& rows, std::vector<Figure>& figures,
                         const ReproduceOptions& options) {
  const Experiment vga = pointExperiment(ImageSize::vga), xga = pointExperiment(ImageSize::xga);
  const Counts vgaCounts{31, 26, 31, {33, 25, 21, 14}};
  successRows(rows, vga, vga.starts(), {}, vgaCounts, kStarts);
  pointFindings(rows, vga, 26);
  successRows(rows, xga, xga.starts(), {}, {28, 28, 28, {30, 21, 14, 10}}, kStarts);
  pointFindings(rows, xga, 25);
  contrastRow(rows, vga, "", "", {}, 0);
  Circumstances late;
  late.delay = 9;
  late.lag_s = 0.4;
  contrastRow(rows, xga, "/latency", ", 0.3 s late and drives of 0.4 s", late, 4);
  imageRows(rows, vga, vgaCounts, options.full);
  if (options.full) {
    Circumstances images;
    images.throughImages = true;
    contrastRow(rows, vga, "/images", " through images", images, 0);
  }

  const struct {
    ImageSize size;
    FeatureChoice features;
    Counts counts;
  } momentTables[] = {
      {ImageSize::vga, FeatureChoice::moments, {35, 35, 35, {35, 35, 30, 20, 10}}},
      {ImageSize::vga, FeatureChoice::momentsInPixels, {35, 35, 35, {35, 35, 20, 15, 10}}},
      {ImageSize::xga, FeatureChoice::moments, {32, 32, 32, {34, 31, 26, 15, 10}}},
      {ImageSize::xga, FeatureChoice::momentsInPixels, {35, 35, 35, {35, 35, 20, 15, 5}}}};
  for (const auto& [size, features, counts] : momentTables) {
    const Experiment experiment = momentExperiment(size, features);
    successRows(rows, experiment, experiment.starts(), {}, counts, kStarts);
  }
  const Experiment moments = momentExperiment(ImageSize::vga, FeatureChoice::moments);
  const Sweep loose(moments.arrangement, moments.starts(),
                    {FeatureChoice::moments, DepthSource::observer, 1, 44000, 0.05}, {0.9});
  rows.addWithin(moments.id + "/loose-clamp",
                 "moments, 640x480: the observer may report depths down to 0.05 m instead of "
                 "0.5 m, guess 0.9 m",
                 25, loose.reached(0), "of 35", kStarts)
      .note = "a depth that is too small dies down the command, and with it what could correct it";
  imageRows(rows, moments, momentTables[0].counts, options.full);
  addFigures(figures);
}

}  // namespace depthservo::deluca2008
