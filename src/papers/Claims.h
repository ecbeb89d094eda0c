#pragma once

#include <map>
#include <string>
#include <vector>

#include "depthservo/papers/Reproduce.h"
#include "experiments/Claim.h"

namespace depthservo {

struct Claims {
  Paper paper;
  std::vector<Claim> all;
  struct Words {
    std::string title, caption;
  };
  std::map<std::string, Words> figures;  ///< by name
};

/// What running a paper's experiments gives, not yet judged.
struct Experiments {
  Measurements measured;
  std::vector<Figure> figures;
};

/// The claims of a paper, as they are compiled in. \param full of a full reproduction
Claims claimsOf(const std::string& paper, bool full = false);

/// The same from YAML. \throw InputError
Claims readClaims(const std::string& yaml, const std::string& paper, bool full);

/// Every claim against what was measured; a figure that was not measured does not agree.
std::vector<JudgedClaim> judge(const Claims& claims, const Measurements& measured);

/// Gives figures their titles and captions. \throw std::out_of_range there are none of a figure
void describe(std::vector<Figure>& figures, const Claims& claims);

}  // namespace depthservo
