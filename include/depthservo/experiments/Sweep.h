#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/scenario/Scenario.h"

namespace depthservo {

/// How the values of an axis are spread.
enum class SweepDraw { none, uniform, normal };

/// One value of an axis that sets several keys at once.
struct SweepCase {
  std::string name;
  std::vector<std::string> set;  ///< "key=value" each
};

/// Start poses from which all points of the target are in the image, drawn evenly.
struct SweepCone {
  double angle = 0.5;                    ///< half of it, around the front of the target [rad]
  Eigen::Vector2d distance{1, 1};        ///< of the camera from the middle of the target [m]
  double aim = 0;                        ///< greatest angle of the optical axis off it [rad]
  double roll = 0;                       ///< greatest angle about the optical axis (free) [rad]
  double margin = 10;                    ///< of the points from the border of the image [px]
};

/// What is varied, one thing in every direction.
struct SweepAxis {
  std::string name;
  std::string key;                  ///< of the scenario, or one of `sweepStartKeys()`
  std::vector<std::string> values;  ///< as they stand in a scenario
  std::optional<double> from, to;   ///< instead: so many values from the one to the other
  int count = 0;
  bool isLog = false;
  SweepDraw draw = SweepDraw::none;  ///< or drawn by the sweep's seed and the axis' name
  double mean = 0, sigma = 1;        ///< of SweepDraw::normal
  std::vector<SweepCase> cases;
  std::optional<SweepCone> cone;
};

/// A picture of the shares of outcomes over two columns, one for each value of a third.
struct SweepMap {
  std::string x, y, by;
};

/// The share of success over one column, a curve for each value of another.
struct SweepCurve {
  std::string x, by;
};

/// What a claim is about: share and number of success, or a statistic of a metric.
enum class SweepFigure { share, count, median, mean, min, max };

/// A figure over some of the runs, and what it must be.
struct SweepClaim {
  std::string id, claim, unit, note;
  std::vector<std::string> where;  ///< "column=value" each; empty: all runs
  SweepFigure of = SweepFigure::share;
  std::string metric;
  double expected = 0;
  std::string within = "0";
};

/// What a sweep file says.
struct SweepOptions {
  std::string name, title, scenario;
  std::vector<std::string> set;  ///< "key=value" each, of every run
  std::vector<SweepAxis> axes;
  int repeat = 1;
  unsigned seed = 1;
  std::vector<std::string> seededBy;  ///< axes that make the seed of a run; empty: all
  std::vector<std::string> metrics{"duration_s", "final_error_px", "min_border_px",
                                   "final_depth_error_max"};
  std::vector<std::string> success{"converged"};  ///< outcomes
  std::vector<SweepMap> maps;
  std::vector<SweepCurve> curves;
  std::vector<SweepClaim> claims;
  int worst = 3;  ///< runs whose reports are written
};

/// "start.distance" and others, with which an axis can say where the robot starts.
const std::vector<std::string>& sweepStartKeys();

/// Every key of a sweep file, as `depthservo keys` prints them.
std::string sweepKeysAsText(const std::string& prefix);
std::string sweepKeysAsMarkdown();
std::string sweepSchema();

/// Many runs of one scenario: every combination of the values of all axes, some times over. A row
/// is a run; the first axis varies slowest, repetitions fastest.
class Sweep {
 public:
  /// The texts it is made of; they are all that is needed to make it again.
  struct Source {
    std::string file, text;                  ///< the sweep file
    std::string scenarioFile, scenarioText;  ///< its scenario
  };

  /// \param resolve the file of a scenario that the sweep names \throw InputError
  static Sweep load(const std::string& file,
                    const std::function<std::string(const std::string&)>& resolve);

  /// Checks every value of every axis in a scenario. \throw InputError
  explicit Sweep(Source source);
  ~Sweep();
  Sweep(Sweep&&) noexcept;

  const SweepOptions& options() const;
  const Source& source() const;
  std::size_t size() const;  ///< runs

  /// What distinguishes runs: axes, more than one of those that make a start pose, `repeat`.
  const std::vector<std::string>& columns() const;

  /// A run, by its place in the whole.
  struct Row {
    std::vector<std::string> cells;     ///< by column
    std::vector<std::string> settings;  ///< "key=value" each, over the scenario
    unsigned seed = 1;
  };
  Row row(std::size_t index) const;

  /// \throw InputError these values do not go together. May be called by several threads at once.
  Scenario scenario(const Row& row, const std::vector<std::string>& overrides = {}) const;

  /// All that determines the results, as text.
  const std::string& identity() const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace depthservo
