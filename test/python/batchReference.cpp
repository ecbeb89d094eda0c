// The estimates and the time of InverseDepthFilterBatch alone, for the Python package to be
// compared with.
//
//   batch_reference IN OUT     IN: doubles images, points, dt [s], sigma, twist (6), xy (images,
//   points, 2)
//                              OUT: doubles z, sigma_z of every point after the last image
// Prints the least time of several passes [s], of predict and correct alone.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

#include "depthservo/depth/InverseDepthFilterBatch.h"

namespace {

std::vector<double> read(const char* file) {
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  std::vector<double> values(bytes.size() / sizeof(double));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(values.data()));
  return values;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace depthservo;
  if (argc != 3) return 2;
  const std::vector<double> in = read(argv[1]);
  const auto images = static_cast<std::size_t>(in[0]), points = static_cast<std::size_t>(in[1]);
  const Twist twist{{in[4], in[5], in[6]}, {in[7], in[8], in[9]}};
  const Motion motion = Motion::fromTwist(twist, in[2]);
  std::vector<double> x(images * points), y(images * points);
  for (std::size_t i = 0; i < images * points; ++i) {
    x[i] = in[10 + 2 * i];
    y[i] = in[11 + 2 * i];
  }
  const std::vector<double> sigma(points, in[3]);

  constexpr int kPasses = 25;
  double least_s = 1e9;
  std::vector<double> out(2 * points);
  for (int pass = 0; pass < kPasses; ++pass) {
    InverseDepthFilterBatch filter(points);
    for (std::size_t i = 0; i < points; ++i) filter.reset(i, {x[i], y[i], sigma[i]}, {1.0});
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t k = 1; k < images; ++k) {
      filter.predict(motion);
      filter.correct(&x[k * points], &y[k * points], sigma.data());
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    least_s = std::min(least_s, took.count());
    for (std::size_t i = 0; i < points; ++i) {
      out[i] = filter.estimate(i).Z();
      out[points + i] = filter.estimate(i).sigma_Z();
    }
  }
  std::ofstream stream(argv[2], std::ios::binary);
  stream.write(reinterpret_cast<const char*>(out.data()),
               static_cast<std::streamsize>(out.size() * sizeof(double)));
  std::printf("%.9g\n", least_s);
}
