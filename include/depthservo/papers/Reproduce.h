#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "depthservo/report/Figure.h"

namespace depthservo {

/// One figure of a paper, theirs against ours.
struct ReproduceRow {
  std::string id;       ///< stable, unique over all papers: paper/experiment/figure
  std::string claim;    ///< what the figure says
  std::string paper;    ///< as the paper prints it; empty when it does not
  double expected = 0;  ///< from an independent computation
  double ours = 0;      ///< measured now; finite
  std::string unit;
  bool pass = false;        ///< ours agrees with expected
  bool reproduces = false;  ///< the paper's claim holds
  std::string note;
};

struct ReproduceOptions {
  bool full = false;  ///< more seeds and finer searches
  unsigned seed = 1;  ///< of the noise
};

/// What running a paper's experiments gives.
struct Reproduction {
  std::vector<ReproduceRow> rows;
  std::vector<Figure> figures;
};

/// Ibuki, Nakano, Shigaki, Hatanaka, "Sampled visual feedback pose estimation and regulation based
/// on camera frame rates", Advanced Robotics 37, 2023: conditions, gain design, both experiments in
/// simulation, frame-rate sweep, noise. A few seconds.
Reproduction reproduceIbuki2023(const ReproduceOptions& options = {});

/// Durand Petiteville, Courdesses, Cadenat, "A new predictor/corrector pair to estimate the visual
/// features depth during a vision-based navigation task in an unknown environment", ICINCO 2010:
/// perfect data, noise, occlusions of 2 s and 13 s, against De Luca's observer; all over 200 seeds,
/// `full`: 1000. A few seconds, `full`: half a minute.
Reproduction reproduceDurand2010(const ReproduceOptions& options = {});

/// De Luca, Oriolo, Robuffo Giordano, "Feature Depth Observation for Image-based Visual Servoing:
/// Theory and Experiments", IJRR 27(10), 2008: depth in the numerical example, focal length there
/// and on the unicycle.
Reproduction reproduceDeLuca2008(const ReproduceOptions& options = {});

/// A paper whose experiments can be run again.
struct Paper {
  const char* name;  ///< as on the command line and in ids
  const char* citation;
  Reproduction (*reproduce)(const ReproduceOptions&);
  /// What an experiment is, by the word after the paper's name in its rows' ids.
  std::map<std::string, std::string> experiments;
};

/// In the order of their names.
const std::vector<Paper>& papers();

/// One JSON array: an object for each row, with the names of its members as keys.
std::string toJson(const std::vector<ReproduceRow>& rows);

struct ReproducedPaper {
  Paper paper;
  Reproduction result;
};

/// Writes a folder with `rows.json`, every figure as `<paper>-<figure>.png` and, in one
/// self-contained file, `report.html`; whole or not at all. \param name of the whole
/// \return whether all figures were drawn (that needs gnuplot)
/// \throw InputError the place is refused (see requireNewRunFolder) or cannot be written to
bool writeReproduction(const std::string& name, const std::vector<ReproducedPaper>& reproduced,
                       const std::filesystem::path& folder);

}  // namespace depthservo
