#include <gtest/gtest.h>

#include <filesystem>

#include "cli/Tool.h"
#include "support/PdfPage.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

constexpr double kResolution_mm = 0.003;  // cairo rounds to 1/256 of a point

class Target : public testing::Test {
 protected:
  Result draw(const std::string& arguments) const {
    return depthservo("target " + arguments + " --out " + file());
  }
  std::string file() const { return folder_ / "target.pdf"; }
  TemporaryFolder folder_;
};

/// Filled shapes in the order in which they were drawn, without text.
void expectBox(const PdfBox& box, double left, double top, double right, double bottom) {
  EXPECT_NEAR(box.left_mm, left, kResolution_mm);
  EXPECT_NEAR(box.top_mm, top, kResolution_mm);
  EXPECT_NEAR(box.right_mm, right, kResolution_mm);
  EXPECT_NEAR(box.bottom_mm, bottom, kResolution_mm);
}

TEST_F(Target, dots_have_their_exact_size_on_a4) {
  const Result result = draw("dots --size 0.12 --radius 0.02");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const PdfPage page = readPdfPage(file());
  EXPECT_NEAR(page.width_mm, 210, kResolution_mm);
  EXPECT_NEAR(page.height_mm, 297, kResolution_mm);
  ASSERT_EQ(page.shapes.size(), 5u) << "four dots and the ruler";
  const double x = 105, y = (297 - 32) / 2.0;
  expectBox(page.shapes[0], x - 80, y - 80, x - 40, y - 40);
  expectBox(page.shapes[1], x + 40, y - 80, x + 80, y - 40);
  expectBox(page.shapes[2], x + 40, y + 40, x + 80, y + 80);
  expectBox(page.shapes[3], x - 80, y + 40, x - 40, y + 80);
  EXPECT_NE(
      result.out.find("[[-0.06, -0.06, 0], [0.06, -0.06, 0], [0.06, 0.06, 0], [-0.06, 0.06, 0]]"),
      std::string::npos)
      << "round, as in the scenarios: " << result.out;
  EXPECT_NEAR(page.shapes[4].right_mm - page.shapes[4].left_mm, 100, kResolution_mm);
}

TEST_F(Target, dots_have_their_exact_size_on_letter) {
  const Result result = draw("dots --paper letter --columns 3 --rows 2 --size 0.1");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const PdfPage page = readPdfPage(file());
  EXPECT_NEAR(page.width_mm, 215.9, kResolution_mm);
  EXPECT_NEAR(page.height_mm, 279.4, kResolution_mm);
  ASSERT_EQ(page.shapes.size(), 7u);
  EXPECT_NEAR(page.shapes[2].right_mm - page.shapes[0].left_mm, 100 + 2 * 7.5, kResolution_mm);
}

TEST_F(Target, a_tag_has_its_exact_size_from_corner_to_corner) {
  const Result result = draw("apriltag --size 0.15 --id 3");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const PdfPage page = readPdfPage(file());
  ASSERT_EQ(page.shapes.size(), 2u) << "the black cells are one shape";
  const double y = (297 - 32) / 2.0;
  expectBox(page.shapes[0], 105 - 75, y - 75, 105 + 75, y + 75);
}

TEST_F(Target, a_board_has_its_exact_size_and_begins_with_black) {
  const Result result = draw("chessboard --columns 4 --rows 3 --square 0.03");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const PdfPage page = readPdfPage(file());
  ASSERT_EQ(page.shapes.size(), 10u + 1) << "black squares and the ruler";
  const double left = 105 - 75, top = (297 - 32) / 2.0 - 60;
  expectBox(page.shapes[0], left, top, left + 30, top + 30);
  expectBox(page.shapes[1], left + 60, top, left + 90, top + 30);
  expectBox(page.shapes[3], left + 30, top + 30, left + 60, top + 60);
  expectBox(page.shapes[9], left + 90, top + 90, left + 120, top + 120);
  std::filesystem::remove(file());
  expectRefused(draw("chessboard --columns 2"), {"3 to 24 inner corners"});
  expectRefused(draw("charuco --dictionary 4x5_50"), {"--dictionary", "4x4_50"});
  expectRefused(draw("charuco --marker 0.03"), {"0.3 to 0.95"});
  expectRefused(draw("chessboard --square 0.05"), {"--square", "paper has room"});
}

TEST_F(Target, prints_lines_that_a_sequence_takes) {
  for (const char* kind : {"dots --columns 3 --rows 3 --size 0.15", "apriltag --id 5 --size 0.1",
                           "chessboard", "charuco --columns 5 --dictionary 6x6_250"}) {
    SCOPED_TRACE(kind);
    std::filesystem::remove(file());
    const Result result = draw(kind);
    ASSERT_EQ(result.exitCode, 0) << result.err;
    EXPECT_EQ(result.out.find("target:\n  type: "), 0u) << result.out;
    folder_.write("target.yaml", result.out);
    // Refused for its source, which comes after the target.
    expectRefused(depthservo("live --source none.avi --motion target --camera icl --target " +
                             (folder_ / "target.yaml").string()),
                  {"none.avi"});
  }
}

TEST_F(Target, is_the_same_file_every_time) {
  ASSERT_EQ(draw("dots").exitCode, 0);
  const std::string bytes = folder_.read("target.pdf");
  std::filesystem::remove(file());
  ASSERT_EQ(draw("dots").exitCode, 0);
  EXPECT_EQ(folder_.read("target.pdf"), bytes);
}

TEST_F(Target, refuses_what_cannot_be_printed) {
  expectRefused(draw("dots --size 0.3"), {"--size", "room for 194 x 249 mm"});
  expectRefused(draw("apriltag --size 0.17"), {"--size", "times as large"});
  expectRefused(draw("dots --radius 0.06"), {"--radius", "white"});
  expectRefused(draw("dots --paper a5"), {"--paper", "a4 or letter"});
  expectRefused(draw("apriltag --family 36h12"), {"--family", "'36h11'"});
  expectRefused(draw("apriltag --id 587"), {"--id", "0 to 586"});
  expectRefused(draw("circles"), {"circles", "dots, apriltag, chessboard or charuco"});
  folder_.write("target.pdf", "mine");
  expectRefused(draw("dots"), {"target.pdf", "exists"});
  EXPECT_EQ(folder_.read("target.pdf"), "mine");
  expectRefused(depthservo("target dots --out /proc/nowhere/t.pdf"), {"/proc/nowhere/t.pdf"});
}

}  // namespace
}  // namespace depthservo::test
