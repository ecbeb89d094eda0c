#include "depthservo/target/GrayPatch.h"

#include <algorithm>
#include <random>

namespace depthservo {

GrayPatch GrayPatch::random(double width, double height, int columns, int rows, std::uint64_t seed,
                            unsigned char dark, unsigned char light) {
  GrayPatch patch{Eigen::Isometry3d::Identity(), width, height, columns, rows, {}};
  patch.gray.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::mt19937_64 random(seed);
  const std::uint64_t levels = std::uint64_t{light} - dark + 1u;
  std::generate(patch.gray.begin(), patch.gray.end(), [&] {
    return static_cast<unsigned char>(dark + random() % levels);  // same on every platform
  });
  return patch;
}

}  // namespace depthservo
