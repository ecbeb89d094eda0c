#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <string>

namespace depthservo::test {
namespace {

/// Lines of `ldd` for a program or a library: what is loaded when it starts.
std::string loadedBy(const std::string& file) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(("ldd '" + file + "'").c_str(), "r"),
                                                   pclose);
  std::string text;
  std::array<char, 4096> line;
  while (pipe && std::fgets(line.data(), line.size(), pipe.get())) text += line.data();
  return text;
}

void expectFew(const std::string& file, long most) {
  const std::string loaded = loadedBy(file);
  const long count = std::count(loaded.begin(), loaded.end(), '\n');
  EXPECT_GT(count, 5) << "is there ldd?";
  EXPECT_LE(count, most) << file << " loads\n" << loaded;
  for (const char* heavy : {"gdal", "avcodec", "hdf5", "opencv_videoio", "opencv_imgcodecs"}) {
    EXPECT_EQ(loaded.find(heavy), std::string::npos) << file << " loads " << heavy;
  }
}

TEST(StartUp, of_the_tool_loads_few_libraries) { expectFew(DEPTHSERVO_TOOL, 80); }
TEST(StartUp, of_a_program_with_the_features_loads_few_libraries) {
  expectFew(DEPTHSERVO_FEATURES, 45);
}

}  // namespace
}  // namespace depthservo::test
