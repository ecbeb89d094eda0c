#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/experiments/JudgedClaim.h"
#include "depthservo/report/Figure.h"

namespace depthservo {

struct ReproduceOptions {
  bool full = false;  ///< more seeds and finer searches
  unsigned seed = 1;  ///< of the noise
};

/// What running a paper's experiments gives.
struct Reproduction {
  std::vector<JudgedClaim> rows;
  std::vector<Figure> figures;
};

/// A paper whose experiments can be run again.
struct Paper {
  std::string name;  ///< as on the command line and in ids
  std::string citation;
  /// Word after the paper's name in the ids of an experiment's rows, and what it is; in order.
  std::vector<std::pair<std::string, std::string>> experiments;
};

/// De Luca, Oriolo, Robuffo Giordano 2008; Durand Petiteville, Courdesses, Cadenat 2010; Ibuki,
/// Nakano, Shigaki, Hatanaka 2023: in the order of their names.
const std::vector<Paper>& papers();
std::vector<std::string> paperNames();

/// Runs a paper's experiments and judges them by its claims, data/papers/NAME.yaml. Some seconds;
/// with `full` minutes. \throw std::out_of_range there is no such paper
Reproduction reproduce(const std::string& name, const ReproduceOptions& options = {});

/// How many rows there are, and of how many it is so.
struct ReproductionCount {
  std::size_t rows = 0, agreeing = 0;  ///< ours with the independent computation
  std::size_t printed = 0, met = 0;    ///< claims with a figure or a statement in the paper itself

  explicit ReproductionCount(const std::vector<JudgedClaim>& rows);
  /// "77 of the 93 claims that the papers print hold, 17 % of all rows; 557 of 557 rows agree ...".
  std::string text() const;
};

/// One JSON array: an object for each row, with the names of its members as keys.
std::string toJson(const std::vector<JudgedClaim>& rows);

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
