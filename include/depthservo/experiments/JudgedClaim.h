#pragma once

#include <string>

namespace depthservo {

/// One figure, as claimed and as measured.
struct JudgedClaim {
  std::string id;       ///< stable, unique over all papers: paper/experiment/figure
  std::string claim;    ///< what the figure says
  std::string paper;    ///< as the paper prints it; empty when it does not
  double expected = 0;  ///< from an independent computation
  double ours = 0;      ///< measured now; finite
  std::string unit;
  std::string tolerance;    ///< within which ours agrees: "2 %", "0.1 s", "factor 1.5", "exact"
  bool pass = false;        ///< ours agrees with expected
  bool reproduces = false;  ///< the paper's claim holds
  std::string note;
};

}  // namespace depthservo
