// Recordings with the usual mistakes in their odometry: the diagnosis names the mistake.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <fstream>
#include <functional>
#include <sstream>

#include "depthservo/rig/RecordedRig.h"
#include "depthservo/scenario/run.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using Cause = ConsistencyMonitor::Cause;

class ExplainMotion : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    record(Scenario::load(DEPTHSERVO_DATA "/scenarios/free-general.yaml",
                          {"sensing.source=geometry", "duration=6", "expect=null"}),
           *folder_ / "good");
  }
  static void TearDownTestSuite() { delete folder_; }

  using Row = std::vector<double>;
  /// A copy of the recording in which the rows of a file are changed, and other files are gone.
  static RunLog replayChanged(const std::string& file, const std::string& without,
                              const std::function<void(Row&)>& change, double pixelNoise_px = 0.2) {
    const test::TemporaryFolder copy;
    const std::filesystem::path place = copy / "bad";
    std::filesystem::copy(*folder_ / "good", place, std::filesystem::copy_options::recursive);
    if (!without.empty()) std::filesystem::remove(place / without);
    std::ifstream in(place / file);
    std::ostringstream out;
    out.precision(12);
    const char separator = file == "twist.csv" ? ',' : ' ';
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || !std::isdigit(static_cast<unsigned char>(line[0]))) {
        out << line << '\n';
        continue;
      }
      Row row;
      std::istringstream cells(line);
      for (std::string cell; std::getline(cells, cell, separator);) row.push_back(std::stod(cell));
      change(row);
      for (std::size_t i = 0; i < row.size(); ++i) {
        out << (i ? std::string(1, separator) : "") << std::fixed << row[i];
      }
      out << '\n';
    }
    std::ofstream(place / file) << out.str();
    const Sequence sequence(place.string());
    ObservationOptions options;
    options.depth.initial = 2;
    options.pixelNoise_px = pixelNoise_px;
    return replay(sequence, options);
  }

  static test::TemporaryFolder* folder_;
};

test::TemporaryFolder* ExplainMotion::folder_ = nullptr;

void expectNamed(const RunLog& log, Cause cause, const std::string& words) {
  ASSERT_TRUE(log.diagnosis);
  EXPECT_EQ(log.diagnosis->latest.cause, cause) << log.diagnosis->message();
  EXPECT_NE(log.diagnosis->message().find("does not explain the images"), std::string::npos)
      << log.diagnosis->message();
  EXPECT_NE(log.diagnosis->message().find(words), std::string::npos) << log.diagnosis->message();
  for (const FeatureRecord& feature : log.frames.back().features) {
    EXPECT_NE(feature.estimate.status, DepthStatus::valid) << feature.id;
  }
}

TEST_F(ExplainMotion, is_not_needed_where_all_is_right) {
  const RunLog log = replayChanged("twist.csv", "", [](Row&) {});
  EXPECT_FALSE(log.diagnosis->isFault()) << log.diagnosis->message();
  EXPECT_NE(log.diagnosis->message().find("agree"), std::string::npos);
}

TEST_F(ExplainMotion, names_robot_axes) {
  const RunLog log = replayChanged(
      "twist.csv", "", [](Row& r) { r = {r[0], r[3], -r[1], -r[2], r[6], -r[4], -r[5]}; });
  expectNamed(log, Cause::frame, "robot axes");
}

TEST_F(ExplainMotion, names_a_sign) {
  const RunLog log = replayChanged("twist.csv", "", [](Row& r) {
    for (std::size_t i = 1; i < 7; ++i) r[i] = -r[i];
  });
  expectNamed(log, Cause::frame, "opposite sign");
}

TEST_F(ExplainMotion, names_degrees) {
  const RunLog log = replayChanged("twist.csv", "", [](Row& r) {
    for (std::size_t i = 4; i < 7; ++i) r[i] *= 180 / M_PI;
  });
  expectNamed(log, Cause::unit, "degrees per second");
}

TEST_F(ExplainMotion, names_a_clock_with_its_offset) {
  const RunLog log = replayChanged("twist.csv", "", [](Row& r) { r[0] -= 0.6; });
  expectNamed(log, Cause::clock, "clock");
  EXPECT_NEAR(log.diagnosis->latest.size, 0.6, 0.03);
}

Eigen::Isometry3d poseOf(const std::vector<double>& r) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(r[7], r[4], r[5], r[6]).toRotationMatrix();
  pose.translation() << r[1], r[2], r[3];
  return pose;
}

std::vector<double> rowOf(double time_s, const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d t = pose.translation();
  return {time_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

TEST_F(ExplainMotion, names_inverted_poses) {
  const RunLog log = replayChanged("groundtruth.txt", "twist.csv",
                                   [](Row& r) { r = rowOf(r[0], poseOf(r).inverse()); });
  expectNamed(log, Cause::poseConvention, "invert");
}

TEST_F(ExplainMotion, names_quaternions_with_w_first) {
  const RunLog log = replayChanged("groundtruth.txt", "twist.csv", [](Row& r) {
    r = {r[0], r[1], r[2], r[3], r[7], r[4], r[5], r[6]};
  });
  expectNamed(log, Cause::poseConvention, "w first");
}

TEST_F(ExplainMotion, blames_the_pixel_noise_where_it_was_declared_too_small) {
  for (const auto& [declared_px, factor] : {std::pair(0.09, "2 times"), {0.05, "5 times"}}) {
    const std::string message = replayChanged(
                                    "twist.csv", "", [](Row&) {}, declared_px)
                                    .diagnosis->message();
    EXPECT_NE(message.find("pixel noise is " + std::string(factor)), std::string::npos) << message;
    EXPECT_EQ(message.find("No usual mistake"), std::string::npos) << message;
  }
}

TEST_F(ExplainMotion, says_so_when_nothing_explains_them) {
  int k = 0;
  const RunLog log = replayChanged("twist.csv", "", [&](Row& r) {
    ++k;
    for (std::size_t i = 1; i < 7; ++i) r[i] = std::sin(1.7 * k * double(i) + double(i));
  });
  expectNamed(log, Cause::motion, "No usual mistake");
}

}  // namespace
}  // namespace depthservo
