#include <fmt/format.h>
#include <gtest/gtest.h>

#include "cli/Tool.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/visp/using.h"
#include "support/Random.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

const PinholeCamera kCamera{320, 240, 300, 300, 159.5, 119.5};

/// Points that stand still but for white noise and a drift.
std::string tracks(double sigma_u, double sigma_v, double drift_px, unsigned seed) {
  Random random(seed);
  std::string rows = "timestamp,id,u,v\n";
  for (int k = 0; k < 300; ++k) {
    for (int id = 0; id < 4; ++id) {
      rows += fmt::format("{},{},{},{}\n", k / 30.0, id,
                          100 + 20 * id + drift_px * k + random.normal(sigma_u),
                          100 - drift_px * k + random.normal(sigma_v));
    }
  }
  return rows;
}

class Noise : public testing::Test {
 protected:
  void write(const std::string& rows) const {
    folder_.write("tracks.csv", rows);
    folder_.write("camera.yaml",
                  "image_width: 320\nimage_height: 240\ncamera_matrix: {rows: 3, cols: 3, data: "
                  "[300, 0, 159.5, 0, 300, 119.5, 0, 0, 1]}\n");
  }
  nlohmann::json measured() const {
    const Result result = depthservo("noise " + folder_.path().string() + " --json");
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result.json();
  }
  TemporaryFolder folder_;
};

/// Four standard deviations of an rms over 4 points, 2 axes and 10 blocks of 28 degrees of freedom.
constexpr double kTolerance = 4 / 1.4142135 / 47.3;

TEST_F(Noise, is_that_of_the_points_whether_they_drift_or_not) {
  const double sigma_px = std::sqrt((0.2 * 0.2 + 0.1 * 0.1) / 2);
  for (const double drift_px : {0.0, 0.01}) {
    write(tracks(0.2, 0.1, drift_px, 1));
    const auto json = measured();
    EXPECT_NEAR(json["pixel_noise"], sigma_px, kTolerance * sigma_px);
    EXPECT_EQ(json["has_moved"], drift_px > 0) << json;
    EXPECT_EQ(json["is_white"], true);
    for (const auto& point : json["points"]) {
      EXPECT_NEAR(point["sigma_u"], 0.2, 4 / std::sqrt(2 * 280) * 0.2);
      EXPECT_NEAR(point["sigma_v"], 0.1, 4 / std::sqrt(2 * 280) * 0.1);
    }
  }
}

TEST_F(Noise, of_a_shaking_camera_is_told_to_be_too_large) {
  Random random(2);
  std::string rows = "timestamp,id,u,v\n";
  for (int k = 0; k < 300; ++k) {
    for (int id = 0; id < 4; ++id) {
      rows += fmt::format("{},{},{},{}\n", k / 30.0, id, 100 + 2 * std::sin(k / 3.0), 100 + id);
    }
  }
  write(rows);
  EXPECT_EQ(measured()["is_white"], false);
  EXPECT_NE(depthservo("noise " + folder_.path().string()).err.find("fast motion"),
            std::string::npos);
}

TEST_F(Noise, is_printed_as_the_key_of_a_sequence) {
  write(tracks(0.2, 0.2, 0, 3));
  const Result result = depthservo("noise " + folder_.path().string());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  ASSERT_EQ(result.out.find("pixel_noise: 0.2"), 0u) << result.out;
  folder_.write("sequence.yaml", "replay: {" + result.out.substr(0, result.out.size() - 1) + "}\n");
  EXPECT_EQ(depthservo("noise " + folder_.path().string()).exitCode, 0);
}

/// The scatter of the dots over images that the tool does not see.
TEST_F(Noise, of_gray_noise_in_images_is_the_scatter_of_the_dots) {
  const DotTarget plate{{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {-0.1, 0.1, 0}, {0.1, 0.1, 0}}, 0.03};
  SyntheticView view;
  view.cMo.translation() = Eigen::Vector3d(0.013, -0.007, 1);
  constexpr int kImages = 150;
  const auto record = [&](const std::string& name, std::uint64_t seed) {
    SyntheticCameraOptions options;
    options.gray_noise = 6;
    options.seed = seed;
    SyntheticCamera camera(kCamera, plate, options);
    SequenceWriter writer(folder_ / name);
    vpImage<unsigned char> image;
    for (int k = 0; k < kImages; ++k) {
      view.frame = static_cast<std::uint64_t>(k);
      camera.render(view, image);
      writer.addImage(k / 30.0, image);
    }
    std::vector<PixelPoint> dots;
    for (int i = 0; i < 4; ++i) {
      const auto centre = *camera.centre(view.cMo, static_cast<std::size_t>(i));
      dots.push_back({i, centre.x(), centre.y()});
    }
    writer.finish({"still", kCamera, plate, dots, {}});
  };
  record("seen", 1);
  record("unseen", 2);
  const Result result = depthservo("noise " + (folder_ / "seen").string() + " --json");
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.json()["has_moved"], false) << result.out;
  EXPECT_EQ(result.json()["is_white"], true) << result.out;

  const std::string out = folder_ / "replay";
  ASSERT_EQ(depthservo("replay " + (folder_ / "unseen").string() + " --motion target --out " + out)
                .exitCode,
            0);
  const auto features = readCsv(out + "/features.csv");
  std::map<std::string, std::vector<double>> positions;
  for (std::size_t i = 0; i < features.at("id").size(); ++i) {
    for (const char* axis : {"u", "v"}) {
      positions[axis + features.at("id")[i]].push_back(std::stod(features.at(axis)[i]));
    }
  }
  double variance = 0;
  for (const auto& [name, values] : positions) {
    ASSERT_EQ(values.size(), static_cast<std::size_t>(kImages)) << name;
    double mean = 0, squares = 0;
    for (const double x : values) mean += x / kImages;
    for (const double x : values) squares += (x - mean) * (x - mean);
    variance += squares / (kImages - 1) / static_cast<double>(positions.size());
  }
  const double scatter_px = std::sqrt(variance);
  // Two rms values of 8 x 150 draws each: four standard deviations of their ratio.
  EXPECT_NEAR(result.json()["pixel_noise"], scatter_px, 4 * scatter_px / std::sqrt(1150.0));
}

TEST_F(Noise, needs_a_second_of_images) {
  write("timestamp,id,u,v\n0,0,1,1\n0.1,0,1,1\n");
  expectRefused(depthservo("noise " + folder_.path().string()), {"15 images"});
  expectRefused(depthservo("noise"), {"SEQUENCE", "--source"});
  expectRefused(depthservo("noise --source none.avi"), {"none.avi", "no such file"});
}

}  // namespace
}  // namespace depthservo::test
