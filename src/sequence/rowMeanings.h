#pragma once

#include <vector>

#include "depthservo/motion/OdometryRow.h"
#include "text/Names.h"

namespace depthservo::detail {

inline const std::vector<Choice<RowMeaning>>& rowMeanings() {
  static const std::vector<Choice<RowMeaning>> all = {{RowMeaning::hold, "hold"},
                                                      {RowMeaning::instant, "instant"},
                                                      {RowMeaning::meanBefore, "mean-before"}};
  return all;
}

}  // namespace depthservo::detail
