#pragma once

#include <functional>
#include <string>
#include <vector>

#include "depthservo/experiments/Sweep.h"

namespace depthservo {

/// One value of an axis: what stands in its columns, and what it sets.
struct SweptValue {
  std::vector<std::string> cells, settings;
};

/// An axis with all its values.
struct SweptAxis {
  std::vector<std::string> columns;  ///< its name first
  std::vector<SweptValue> values;    ///< at least one
};

/// What an axis must know of its sweep.
struct AxisContext {
  std::string file;
  unsigned seed;
  std::function<Scenario()> scenario;  ///< before any axis
};

/// \throw InputError
SweptAxis sweptAxis(const SweepAxis& axis, const AxisContext& context);

}  // namespace depthservo
