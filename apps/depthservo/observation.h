#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/report/Metrics.h"
#include "depthservo/report/RunRecorder.h"
#include "depthservo/rig/RecordedRig.h"

namespace depthservo {

/// How to observe depth, whatever the estimator: for replay, live and compare.
struct ObservationArguments {
  std::string estimator;  ///< only where there is one
  std::string prior, tagFamily, errors, rows;
  int corners = 0;
  double pixelNoise_px = 0;
  std::vector<double> odometryNoise;
  std::optional<double> odometryScaleSigma, focalSigma, ke;
  std::vector<std::string> joint;
};

void addEstimatorOption(CLI::App& command, ObservationArguments& arguments);
void addObservationOptions(CLI::App& command, ObservationArguments& arguments);

/// Puts what was given into the options. \param hasTags the target names its AprilTags
/// \throw InputError
void apply(const ObservationArguments& arguments, bool hasTags, ObservationOptions& options);

/// Recorded data and what is made of them: for replay and compare.
struct SequenceArguments {
  std::string tracker = "auto", motion = "auto";
  SequenceOptions source;
  ObservationArguments observation;
};

/// `--camera-in-base`.
void addCameraInBase(CLI::App& command, std::optional<RpyPose>& cameraInBase);

/// `--camera`, `--fps`, `--topics`, `--camera-in-base`, `--target`.
void addSourceOptions(CLI::App& command, SequenceOptions& source);

/// All but `--estimator`.
void addSequenceOptions(CLI::App& command, SequenceArguments& arguments);

/// As the sequence asks for, unless the arguments say otherwise. \throw InputError
ObservationOptions optionsOf(const SequenceArguments& arguments, const Sequence& sequence);

/// `--mcap` and `--tum`.
void addRecordingOptions(CLI::App& command, RecordingFiles& files);

/// The camera that `--camera` names. \throw InputError none is given, or it is none
PinholeCamera requiredCamera(const std::string& name);

/// OpenCV and FFmpeg tell what they think of a camera or a file on stderr; what matters of it is
/// told by the tool.
void silenceImageLibraries();

/// One line per point on stderr: where it is believed to be, how well that is known, and how far it
/// is from the truth. \param log what is known of the run as a whole
void printTable(const RunLog& log, const Metrics& metrics);

/// Whether nothing was ever measured; says so on stderr.
bool foundNothing(const RunLog& log, const Metrics& metrics);

[[noreturn]] void refuseOption(const std::string& option, const std::string& message);

/// Refuses a word that is not one of those valid for an option, with the nearest.
[[noreturn]] void refuseWord(const std::string& option, const std::string& word,
                             const std::vector<std::string>& valid);

}  // namespace depthservo
