#include <gtest/gtest.h>

#include "depthservo/sequence/Sequence.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"
#include "support/TextMutator.h"

namespace depthservo {
namespace {

struct File {
  const char* name;
  const char* content;
};
const File kFiles[] = {
    {"camera.yaml",
     "image_width: 8\nimage_height: 6\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [10, 0, 3.5, "
     "0, "
     "11, 2.5, 0, 0, 1]\ndistortion_coefficients: {rows: 1, cols: 2, data: [0, 0]}\n"},
    {"sequence.yaml",
     "name: small\ntarget: {type: dots, points: [[0, 0, 0], [0.1, 0, 0]], radius: 0.01}\ndots: "
     "[[1, "
     "2], [3, 4]]\n"},
    {"tracks.csv", "timestamp,id,u,v\n100.1,1,3,4\n100.1,0,1,2\n100.2,1,3.5,4\n"},
    {"truth.csv", "timestamp,id,Z\n100.1,0,2\n100.2,0,1.9\n"},
    {"twist.csv", "timestamp,vx,vy,vz,wx,wy,wz\n100,1,2,3,4,5,6\n100.05,0,0,0,0,0,0\n"},
    {"groundtruth.txt", "# t\n100 1 2 3 0 0 0 1\n100.1 1 2 3 0.5 -0.5 0.5 0.5\n"},
    {"depth.txt", "# t\n100 a.png\n100.1 b.png\n"},
};

TEST(MutationTest, any_text_gives_a_sane_sequence_or_an_input_error) {
  test::TemporaryFolder folder;
  for (const File& file : kFiles) folder.write(file.name, file.content);
  ASSERT_NO_THROW(Sequence{folder.path()});
  test::Random random(11);
  int accepted = 0, refused = 0;
  for (int round = 0; round < 100; ++round) {
    for (const File& file : kFiles) {
      const std::string text = test::mutated(file.content, random);
      folder.write(file.name, text);
      try {
        const Sequence sequence(folder.path());
        ++accepted;
        EXPECT_GT(sequence.camera().width, 0);
        for (const auto& frame : sequence.frames()) {
          EXPECT_TRUE(std::isfinite(frame.time_s));
          for (const auto& point : frame.tracks) EXPECT_TRUE(std::isfinite(point.u + point.v));
        }
        for (const auto& row : sequence.odometry()) EXPECT_TRUE(row.twist.isFinite());
      } catch (const InputError& e) {
        ++refused;
        EXPECT_TRUE(test::isRefusal(e.what(), {file.name})) << text;
      }
      folder.write(file.name, file.content);
    }
  }
  EXPECT_GT(accepted, 20);
  EXPECT_GT(refused, 200);
}

}  // namespace
}  // namespace depthservo
