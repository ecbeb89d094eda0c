#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "depthservo/report/Figure.h"
#include "depthservo/rig/RecordedRig.h"
#include "depthservo/scenario/run.h"

namespace depthservo {

struct CompareOptions {
  std::vector<EstimatorKind> estimators;  ///< empty: every one that can be used
  /// Times after the first image at which figures are given [s]; empty: chosen to suit the
  /// duration. The end of the data is always one.
  std::vector<double> times_s;
};

/// What an estimator, or the limit for all of them, came to. Vectors are by image; what is not
/// known (no truth, not yet measured) is kUnknown.
struct ComparedEstimator {
  std::string name;
  std::vector<double> error;       ///< relative error of Z, rms over the points [-]
  std::vector<double> sigma;       ///< sigma_Z / Z claimed, rms over the points [-]
  std::vector<double> difference;  ///< of Z from the reference, relative, rms over the points [-]
  /// The same in 1/Z as medians over the points that are known for a second or longer: where points
  /// come and go, young ones say nothing of an estimator.
  std::vector<double> median_error, median_sigma, median_difference;
  std::vector<double> within_5pct;  ///< share of these points with an error below 5 % [-]
  /// Images from a point's first one until its error stays below 5 %, greatest of the points;
  /// kUnknown: never.
  double frames_to_5pct = kUnknown;
  double coverage_2sigma = kUnknown;  ///< as Metrics::coverage_2sigma
  /// Mean of (chi - chi_true)^2 / sigma_chi^2 of the estimates that count for the coverage; 1 for
  /// an honest sigma.
  double mean_nees = kUnknown;
  double update_s = kUnknown;  ///< wall clock per image, all points; differs from run to run
};

/// Estimators on identical measurements.
struct Comparison {
  std::string name;  ///< of the scenario or the sequence
  std::size_t points = 0;
  /// 1 sigma per axis told to the estimators; kUnknown: what the tracker says of each point [px]
  double pixelNoise_px = kUnknown;
  bool pointsComeAndGo = false;    ///< then medians are shown
  bool hasTruth = false;           ///< without: only sigma and difference
  std::string reference;           ///< the estimator that `difference` refers to
  std::vector<double> time_s;      ///< of the images, from the first
  std::vector<std::size_t> shown;  ///< indices of the images at which figures are given
  std::vector<ComparedEstimator> estimators;
  /// The Cramer-Rao bound for estimators that treat each point alone, and for joint ones (see
  /// CramerRaoBound); with its relative sigma as `error`. Empty without truth, with a moving target
  /// or, for the joint one, unless all points are there from the first image.
  std::vector<ComparedEstimator> limits;
};

/// Runs a scenario once, with its own estimator, and lets every other one observe what was measured
/// then. \param watcher may be null \throw InputError
Comparison compare(const Scenario& scenario, const CompareOptions& options,
                   RunWatcher* watcher = nullptr);

/// Tracks the points of recorded data once, as `replay` does with these options, and lets every
/// estimator observe them. \param watcher may be null \throw InputError
Comparison compare(const Sequence& sequence, const ObservationOptions& observation,
                   const CompareOptions& options, RunWatcher* watcher = nullptr);

/// One JSON object; no wall clock in it.
std::string toJson(const Comparison& comparison);

/// Cost per image of each estimator, as a JSON object, and relative to a cheap one.
std::string timingJson(const Comparison& comparison);

/// What is shown of an estimator: rms over the points or, where they come and go, medians.
using ShownValues = std::vector<double> ComparedEstimator::*;
struct ShownStatistic {
  ShownValues error, sigma, difference;
  std::string ofError, ofSigma, ofDifference;  ///< headings, with quantity and statistic
};
ShownStatistic shownStatistic(const Comparison& comparison);

/// One sentence: which estimator is nearest to the truth and whose sigma is honest or, without
/// truth, who claims least and how far they differ.
std::string verdictOf(const Comparison& comparison);

/// A share in per cent, as comparisons show it. \param unknown shown for what is not finite
std::string percent(double share, const std::string& unknown);

/// The estimator that costs are related to.
const ComparedEstimator& costReference(const Comparison& comparison);

/// Errors and claimed sigmas over time, with the limits.
Figure figureOf(const Comparison& comparison);

/// Writes a folder with compare.json, compare.csv (every curve), timing.json, errors.png (with
/// gnuplot) and report.html; whole or not at all. \return whether the figure was drawn
/// \throw InputError the place is refused (see requireNewRunFolder) or cannot be written to
bool writeComparison(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace depthservo
