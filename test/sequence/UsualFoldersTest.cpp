// Folders and files that others' tools write.

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "depthservo/sequence/Sequence.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::inputErrorOf;
using test::isRefusal;

const char* const kCamera = R"(image_width: 8
image_height: 6
camera_matrix: {rows: 3, cols: 3, data: [10, 0, 3.5, 0, 10, 2.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
)";

class UsualFoldersTest : public testing::Test {
 protected:
  UsualFoldersTest() { folder_.write("camera.yaml", kCamera); }

  void writeFrame(int k, const std::string& pose) const {
    const std::string stem = cv::format("frame-%06d", k);
    cv::imwrite(folder_ / (stem + ".color.png"), cv::Mat(6, 8, CV_8UC3, cv::Scalar(k, k, k)));
    cv::Mat depth(6, 8, CV_16U, cv::Scalar(1250));
    if (k == 1) depth = cv::Scalar(65535);
    cv::imwrite(folder_ / (stem + ".depth.png"), depth);
    if (!pose.empty()) folder_.write(stem + ".pose.txt", pose);
  }

  /// Turned by 90 degrees about z, at (x, 2, 3).
  static std::string turned(double x) {
    return "0 -1 0 " + std::to_string(x) + "\n1 0 0 2\n0 0 1 3\n0 0 0 1\n";
  }

  test::TemporaryFolder folder_;
};

TEST_F(UsualFoldersTest, seven_scenes_has_images_depths_and_poses) {
  for (int k = 0; k < 3; ++k) writeFrame(k, turned(0.5 * k));
  const Sequence sequence(folder_.path(), {"", 0});
  ASSERT_EQ(sequence.frames().size(), 3u);
  EXPECT_DOUBLE_EQ(sequence.frames()[2].time_s, 0.066666667);
  EXPECT_EQ(sequence.readImage(2)[0][0], 2);
  EXPECT_DOUBLE_EQ(sequence.readDepth(0)->at(4, 3).value(), 1.25);
  EXPECT_FALSE(sequence.readDepth(1)->at(4, 3)) << "65535 is unknown";
  ASSERT_EQ(sequence.poses().size(), 3u);
  EXPECT_TRUE(sequence.poses()[2].wMc.translation().isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE((sequence.poses()[0].wMc.linear() * Eigen::Vector3d::UnitX())
                  .isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_DOUBLE_EQ(Sequence(folder_.path(), {"", 10}).frames()[2].time_s, 0.2);
}

TEST_F(UsualFoldersTest, seven_scenes_image_that_is_missing_leaves_the_others_their_times) {
  for (const int k : {3, 4, 6}) writeFrame(k, turned(k));
  const Sequence sequence(folder_.path(), {"", 10});
  ASSERT_EQ(sequence.frames().size(), 3u);
  EXPECT_DOUBLE_EQ(sequence.frames()[2].time_s, 0.3);
}

TEST_F(UsualFoldersTest, scannet_poses_that_are_not_finite_are_left_out_and_told) {
  writeFrame(0, turned(0));
  writeFrame(1, "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n0 0 0 1\n");
  writeFrame(2, turned(1));
  const Sequence sequence(folder_.path());
  EXPECT_EQ(sequence.poses().size(), 2u);
  ASSERT_FALSE(sequence.warnings().empty());
  EXPECT_NE(sequence.warnings()[0].find("1 of 3 poses"), std::string::npos);
}

TEST_F(UsualFoldersTest, pose_that_is_none_is_refused) {
  const auto refusalOf = [&](const std::string& pose) {
    writeFrame(0, turned(0));
    writeFrame(1, pose);
    return inputErrorOf([&] { Sequence{folder_.path()}; });
  };
  EXPECT_TRUE(isRefusal(refusalOf("1 0 0\n"), {"frame-000001.pose.txt", "16 numbers", "3"}));
  EXPECT_TRUE(isRefusal(refusalOf("2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), {"rotation"}));
  EXPECT_TRUE(isRefusal(refusalOf("-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), {"rotation"}));
  EXPECT_TRUE(isRefusal(refusalOf("1 0 0 0 0 1 0 0 0 0 1 0 x 0 0 1"), {"'x'", "number"}));
}

class ListedImagesTest : public UsualFoldersTest {
 protected:
  ListedImagesTest() {
    for (const char* name : {"a.png", "b.png"}) {
      cv::imwrite(folder_ / name, cv::Mat(6, 8, CV_8U, cv::Scalar(7)));
    }
    folder_.write("images.txt", "1.5 a.png\n2.5 b.png\n");
  }
};

TEST_F(ListedImagesTest, images_txt_is_read_as_rgb_txt) {
  const Sequence sequence(folder_.path());
  ASSERT_EQ(sequence.frames().size(), 2u);
  EXPECT_EQ(sequence.frames()[1].time_s, 2.5);
  folder_.write("rgb.txt", "1.5 a.png\n");
  EXPECT_EQ(Sequence(folder_.path()).frames().size(), 1u) << "rgb.txt goes before";
}

TEST_F(ListedImagesTest, poses_of_one_matrix_per_line) {
  for (const char* last : {"", " 0 0 0 1"}) {
    folder_.write("poses.txt", std::string("# KITTI\n1 0 0 0 0 1 0 0 0 0 1 0") + last +
                                   "\n0 -1 0 1 1 0 0 2 0 0 1 3" + last + "\n");
    const Sequence sequence(folder_.path());
    ASSERT_EQ(sequence.poses().size(), 2u);
    EXPECT_EQ(sequence.poses()[1].time_s, 2.5);
    EXPECT_TRUE(sequence.poses()[1].wMc.translation().isApprox(Eigen::Vector3d(1, 2, 3)));
  }
  folder_.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { Sequence{folder_.path()}; }),
                        {"poses.txt", "each of the 2 images", "1"}));
  folder_.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 nan\n");
  EXPECT_TRUE(
      isRefusal(inputErrorOf([&] { Sequence{folder_.path()}; }), {"poses.txt:1", "finite"}));
}

/// The flange of an arm turned by 90 degrees about its z; the camera 0.1 m along its x, looking
/// back.
TEST_F(ListedImagesTest, hand_eye_takes_poses_of_the_hand_to_the_camera) {
  const double h = std::sqrt(0.5);
  folder_.write("groundtruth.txt",
                cv::format("1.5 1 0 0 0 0 %.17g %.17g\n2.5 2 0 0 0 0 0 1\n", h, h));
  folder_.write("sequence.yaml", "hand_eye: {xyz: [0.1, 0, 0], quaternion: [0, 1, 0, 0]}\n");
  const Sequence sequence(folder_.path());
  ASSERT_EQ(sequence.poses().size(), 2u);
  EXPECT_TRUE(sequence.poses()[0].wMc.translation().isApprox(Eigen::Vector3d(1, 0.1, 0)));
  EXPECT_TRUE(sequence.poses()[1].wMc.translation().isApprox(Eigen::Vector3d(2.1, 0, 0)));
  EXPECT_TRUE((sequence.poses()[1].wMc.linear() * Eigen::Vector3d::UnitZ())
                  .isApprox(-Eigen::Vector3d::UnitZ()));
  folder_.write("sequence.yaml", "hand_eye: {xyz: [0.1, 0, 0], quaternion: [0, 2, 0, 0]}\n");
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { Sequence{folder_.path()}; }), {"hand_eye.quaternion"}));
}

std::string vispXml(
    const std::string& models,
    const std::string& size = "<image_width>640</image_width><image_height>480</image_height>") {
  return "<?xml version=\"1.0\"?>\n<root><camera><name>Camera</name>" + size + models +
         "</camera></root>\n";
}

const std::string kPlain =
    "<model><type>perspectiveProjWithoutDistortion</type><px>600</px><py>601</py>"
    "<u0>320</u0><v0>240</v0></model>";
const std::string kDistorted =
    "<model><type>perspectiveProjWithDistortion</type><px>610</px><py>611</py>"
    "<u0>321</u0><v0>241</v0><kud>-0.19</kud><kdu>0.2</kdu></model>";

TEST_F(UsualFoldersTest, camera_as_visp_writes_it) {
  folder_.write("camera.xml", vispXml(kPlain));
  PinholeCamera camera = loadCamera(folder_ / "camera.xml");
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_EQ(camera.fx, 600);
  EXPECT_EQ(camera.fy, 601);
  EXPECT_EQ(camera.cx, 320);
  EXPECT_EQ(camera.cy, 240);
  EXPECT_TRUE(camera.distortion.isNone());

  // u = u0 + px x (1 + kud r^2)
  folder_.write("camera.xml", vispXml(kPlain + kDistorted));
  camera = loadCamera(folder_ / "camera.xml");
  const double x = 0.3, y = -0.2, q = 1 - 0.19 * (x * x + y * y);
  EXPECT_NEAR(camera.toPixel(x, y).x(), 321 + 610 * x * q, 1e-9);
  EXPECT_NEAR(camera.toPixel(x, y).y(), 241 + 611 * y * q, 1e-9);
}

TEST_F(UsualFoldersTest, camera_of_visp_that_cannot_be_used_is_refused) {
  const auto refusalOf = [&](const std::string& text) {
    folder_.write("camera.xml", text);
    testing::internal::CaptureStderr();
    const std::string message = inputErrorOf([&] { loadCamera(folder_ / "camera.xml"); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    return message;
  };
  EXPECT_TRUE(isRefusal(refusalOf("<root></root>"), {"camera.xml", "one camera"}));
  EXPECT_TRUE(isRefusal(refusalOf(vispXml(kPlain) + vispXml(kPlain)), {"got 2"}));
  EXPECT_TRUE(isRefusal(refusalOf(vispXml("")), {"model"}));
  EXPECT_TRUE(isRefusal(refusalOf(vispXml(kPlain, "")), {"image_width"}));
  EXPECT_TRUE(isRefusal(refusalOf(vispXml("<model><type>perspectiveProjWithoutDistortion</type>"
                                          "<px>-1</px><py>1</py><u0>0</u0><v0>0</v0></model>")),
                        {"px"}));
  EXPECT_TRUE(isRefusal(refusalOf(vispXml("<model><type>perspectiveProjWithDistortion</type>"
                                          "<px>300</px><py>300</py><u0>320</u0><v0>240</v0>"
                                          "<kud>-2</kud><kdu>1</kdu></model>")),
                        {"kud", "folds"}));
}

}  // namespace
}  // namespace depthservo
