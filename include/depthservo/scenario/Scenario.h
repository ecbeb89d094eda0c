#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/depth/ConsistencyMonitor.h"
#include "depthservo/observation/EstimatorOptions.h"
#include "depthservo/observation/RunLog.h"
#include "depthservo/rig/SimulatedRigOptions.h"
#include "depthservo/servo/ServoOptions.h"

namespace depthservo {

/// What a run must come to.
struct ScenarioExpectation {
  Outcome outcome = Outcome::converged;  ///< what the run must end with
  std::optional<double> coverage;        ///< least share of the depths claimed within 2 sigma [-]
  std::optional<Eigen::Vector2d> valid;  ///< points with a valid depth at the end, from to
  std::optional<ConsistencyMonitor::Cause> diagnosis;  ///< what must be named
  bool at_rest = false;                                ///< the last command is zero
};

/// Everything a closed-loop run needs: the options of each room. A member is the YAML key of the
/// same name, with its default; units, ranges and effects of all keys stand in doc/formats.md.
struct Scenario : SimulatedRigOptions {
  using Expect = ScenarioExpectation;

  std::string file;  ///< where it was read; not a key
  std::string name;
  EstimatorOptions depth;
  ControlOptions control;
  std::optional<Expect> expect;  ///< makes the run a regression test

  /// Reads a scenario. \param overrides "key.path=value" each, applied in order; the value is YAML,
  /// and `null` removes the key. Throws InputError.
  static Scenario load(const std::string& path, const std::vector<std::string>& overrides = {});

  /// The effective configuration with all defaults: one JSON object, always in the same order.
  std::string toJson() const;

  /// Every key there is, as "section.key".
  static std::vector<std::string> keys();
};

/// A scenario file in memory, of which variants are made: many runs read it once.
class ScenarioText {
 public:
  /// \param text of the file \param file its name, for messages and for what it refers to
  /// \throw InputError
  ScenarioText(const std::string& text, std::string file);
  ~ScenarioText();
  ScenarioText(ScenarioText&&) noexcept;
  ScenarioText& operator=(ScenarioText&&) noexcept;

  /// The scenario with these overrides, as of Scenario::load. May be called by several threads at
  /// once. \throw InputError
  Scenario with(const std::vector<std::string>& overrides) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace depthservo
