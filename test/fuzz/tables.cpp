// Tables of folders of recorded data: our own, TUM RGB-D, EuRoC, ICL-NUIM, 7-Scenes, KITTI's poses.
// The first line says which: "tum/groundtruth.txt".
#include <cmath>

#include "Target.h"
#include "depthservo/sequence/RecordingInfo.h"
#include "support/depthPng.h"

namespace depthservo::fuzz {
namespace {

using Files = std::map<std::string, std::string>;

const std::string kSmallCamera =
    "image_width: 4\nimage_height: 3\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
    "  data: [10, 0, 1.5, 0, 11, 1, 0, 0, 1]\ndistortion_coefficients: {rows: 1, cols: 2, data: [0, 0]}\n";
const std::string kSmallImage = "P5\n4 3\n255\n0123456789ab";
const std::string kPose = "1 0 0 0.1\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

const std::map<std::string, Files>& layouts() {
  static const std::map<std::string, Files> all{
      {"own",
       {{"camera.yaml", kSmallCamera},
        {"sequence.yaml",
         "name: small\nrows: hold\ndepth_scale: 5000\n"
         "target: {type: dots, points: [[0, 0, 0], [0.1, 0, 0]], radius: 0.01}\ndots: [[1, 2], [3, 1]]\n"
         "replay: {depth: {estimator: joint, initial: 2}, pixel_noise: 0.5}\n"},
        {"tracks.csv", "timestamp,id,u,v\n100.1,1,3,2\n100.1,0,1,2\n100.2,1,3.5,1\n"},
        {"truth.csv", "timestamp,id,Z\n100.1,0,2\n100.2,0,1.9\n"},
        {"twist.csv", "timestamp,vx,vy,vz,wx,wy,wz\n100,1,2,3,4,5,6\n100.05,0,0,0,0,0,0\n"}}},
      {"tum",
       {{"camera.yaml", kSmallCamera},
        {"rgb.txt", "# timestamp filename\n100.1 rgb/1.pgm\n100.2 rgb/2.pgm\n"},
        {"rgb/1.pgm", kSmallImage},
        {"rgb/2.pgm", kSmallImage},
        {"depth.txt", "# t\n100.1 depth/1.png\n100.2 depth/1.png\n"},
        {"depth/1.png", test::depthPng()},
        {"groundtruth.txt", "# t\n100 1 2 3 0 0 0 1\n100.1 1 2 3 0.5 -0.5 0.5 0.5\n100.2 1 2 4 0 0 0 1\n"}}},
      {"numbered",
       {{"camera.yaml", kSmallCamera},
        {"sequence.yaml", "images: {folder: rgb, pattern: '%d.pgm', rate: 10}\n"},
        {"rgb/1.pgm", kSmallImage},
        {"rgb/2.pgm", kSmallImage}}},
      {"euroc",
       {{"mav0/cam0/data.csv", "#timestamp [ns],filename\n1403636579763555584,1.pgm\n"
                               "1403636579813555456,1.pgm\n"},
        {"mav0/cam0/data/1.pgm", kSmallImage},
        {"mav0/cam0/sensor.yaml",
         "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
         "  data: [0, -1, 0, 0.1, 1, 0, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1]\nrate_hz: 20\n"
         "resolution: [4, 3]\ncamera_model: pinhole\nintrinsics: [10, 11, 1.5, 1]\n"
         "distortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n"},
        {"mav0/state_groundtruth_estimate0/sensor.yaml",
         "sensor_type: visual-inertial\nT_BS:\n  cols: 4\n  rows: 4\n"
         "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"},
        {"mav0/state_groundtruth_estimate0/data.csv",
         "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
         "1403636579763555584,1,2,3,1,0,0,0\n1403636579813555456,1,2,3.1,1,0,0,0\n"}}},
      {"icl",
       {{"camera.yaml", kSmallCamera},
        {"associations.txt", "1 depth/1.png 1 rgb/1.pgm\n2 depth/1.png 2 rgb/1.pgm\n"},
        {"depth/1.png", test::depthPng()},
        {"rgb/1.pgm", kSmallImage},
        {"office.gt.freiburg", "1 0 0 -2.25 0 0 0 1\n2 0 0.1 -2.25 0 0 0 1\n"}}},
      {"frames",
       {{"camera.yaml", kSmallCamera},
        {"frame-000000.color.png", test::depthPng()},
        {"frame-000000.depth.png", test::depthPng()},
        {"frame-000000.pose.txt", kPose},
        {"frame-000001.color.png", test::depthPng()},
        {"frame-000001.pose.txt", kPose}}},
      {"kitti",
       {{"camera.yaml", kSmallCamera},
        {"rgb.txt", "1 rgb/1.pgm\n2 rgb/1.pgm\n"},
        {"rgb/1.pgm", kSmallImage},
        {"poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.1 0 1 0 0 0 0 1 0\n"}}}};
  return all;
}

const Target kTables("tables", [](const std::string& bytes) {
  const std::size_t slash = bytes.substr(0, bytes.find('\n')).find('/');
  const auto layout = layouts().find(bytes.substr(0, slash));
  if (slash == std::string::npos || layout == layouts().end()) return;
  const std::string folder = folderWith(layout->first, layout->second, bytes.substr(slash + 1));
  describeRecording(folder, {});
  const Sequence sequence(folder);
  for (const OdometryRow& row : sequence.odometry()) {
    require(std::isfinite(row.time_s) && row.twist.isFinite(), "finite odometry");
  }
  for (const CameraPose& pose : sequence.poses()) {
    require(std::isfinite(pose.time_s) && pose.wMc.matrix().allFinite(), "finite poses");
  }
  for (const OdometryRow& row : odometryFromPoses(sequence.poses())) {
    require(row.twist.isFinite(), "finite odometry of poses");
  }
  for (std::size_t k = 0; k < sequence.frames().size() && k < 3; ++k) {
    const SequenceFrame& frame = sequence.frames()[k];
    for (const PixelPoint& point : frame.tracks) {
      require(std::isfinite(point.u + point.v), "finite tracks");
    }
    if (sequence.hasImages()) sequence.readImage(k);
    sequence.readDepth(k);
  }
});

}  // namespace
}  // namespace depthservo::fuzz
