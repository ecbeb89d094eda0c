#pragma once

#include "depthservo/features/ObservedPoint.h"

namespace depthservo {

/// Whether somebody has set the depth of a feature, its third parameter, as far as ViSP lets one
/// see it: its flag is up until ViSP asks for the interaction matrix, and its default is 1 m.
template <typename VispFeature>
bool hasStatedDepth(const VispFeature& feature) {
  struct Access : VispFeature {
    static bool isZSet(const VispFeature& f) {
      const bool* const flags = f.*(&Access::flags);
      return flags && flags[2];
    }
  };
  return isUsableDepth(feature.get_Z()) && (feature.get_Z() != 1 || Access::isZSet(feature));
}

}  // namespace depthservo
