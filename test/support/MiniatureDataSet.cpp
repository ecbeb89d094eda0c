#include "support/MiniatureDataSet.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/visp/using.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

constexpr double kRate = 30;       // images per second
constexpr double kPoseRate = 100;  // poses per second, where they do not come with the images
constexpr double kScale = 5000;    // gray levels per metre
constexpr std::size_t kImages = 45;

/// Half sizes of the plate, and how far the wall is behind it [m].
constexpr double kPlate = 0.25, kWall = 1;

/// Where cam0 sits on the MAV of EuRoC: T_BS of its sensor.yaml.
const char* const kT_BS =
    "[0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,\n"
    "         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,\n"
    "        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,\n"
    "         0.0, 0.0, 0.0, 1.0]";

Eigen::Isometry3d bodyFromCamera() {
  Eigen::Matrix4d T;
  T << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008,
      0.0149672133247, 0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797,
      0.999660727178, 0.00981073058949, 0, 0, 0, 1;
  Eigen::Isometry3d pose(T);
  pose.linear() = Eigen::Quaterniond(pose.linear().eval()).normalized().toRotationMatrix();
  return pose;
}

std::string poseText(const Eigen::Isometry3d& pose, const char* format) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d t = pose.translation();
  return fmt::format(fmt::runtime(format), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

void writeImage(const fs::path& file, const cv::Mat& image) {
  fs::create_directories(file.parent_path());
  constexpr int kFastCompression = 1;
  cv::imwrite(file.string(), image, {cv::IMWRITE_PNG_COMPRESSION, kFastCompression});
}

}  // namespace

MiniatureDataSet::MiniatureDataSet(const PinholeCamera& camera, double start_s) : camera_(camera) {
  for (const double y : {-0.1, 0.1}) {
    for (const double x : {-0.1, 0.1}) target_.points.emplace_back(x, y, 0);
  }
  target_.radius = 0.022;
  wMo_ = Eigen::Translation3d(0.02, -0.03, 1.3) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY());
  for (std::size_t k = 0; k < kImages; ++k) {
    times_.push_back(fileTime(start_s + static_cast<double>(k) / kRate));
  }
  if (camera.distortion.isNone()) return;

  const LensDistortion& d = camera.distortion;
  const cv::Matx33d K(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Mat coefficients = (cv::Mat_<double>(1, 5) << d.k1(), d.k2(), d.p1(), d.p2(), d.k3());
  wide_ = {3 * camera.width,
           3 * camera.height,
           2 * camera.fx,
           2 * camera.fy,
           3 * camera.cx,
           3 * camera.cy,
           {}};
  const cv::Matx33d wideK(wide_.fx, 0, wide_.cx, 0, wide_.fy, wide_.cy, 0, 0, 1);
  cv::Mat pixels(camera.height * camera.width, 1, CV_64FC2), ideal;
  for (int i = 0; i < pixels.rows; ++i) {
    pixels.at<cv::Vec2d>(i) = {double(i % camera.width), double(i / camera.width)};
  }
  cv::undistortPoints(pixels, ideal, K, coefficients, cv::noArray(), wideK,
                      {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-10});
  ideal.reshape(2, camera.height).convertTo(map_, CV_32FC2);
}

Eigen::Isometry3d MiniatureDataSet::wMc(double time_s) const {
  const double t = time_s - times_[0];
  return Eigen::Translation3d(0.12 * std::sin(2 * t), 0.06 * std::sin(3 * t + 1), 0.12 * t) *
         Eigen::AngleAxisd(0.1 * std::sin(2.5 * t), Eigen::Vector3d(0.6, 0, 0.8)) *
         Eigen::AngleAxisd(-0.06 * t, Eigen::Vector3d::UnitY());
}

Eigen::Isometry3d MiniatureDataSet::cMo(std::size_t k) const {
  return wMc(times_[k]).inverse() * wMo_;
}

double MiniatureDataSet::trueDepth(std::size_t k, std::size_t id) const {
  return (cMo(k) * target_.points[id]).z();
}

cv::Mat MiniatureDataSet::gray(std::size_t k) const {
  SyntheticView view;
  view.cMo = cMo(k);
  vpImage<unsigned char> image;
  SyntheticCamera(map_.empty() ? camera_ : wide_, target_).render(view, image);
  const cv::Mat pixels(static_cast<int>(image.getHeight()), static_cast<int>(image.getWidth()),
                       CV_8U, image.bitmap);
  if (map_.empty()) return pixels.clone();
  cv::Mat distorted;
  cv::remap(pixels, distorted, map_, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return distorted;
}

/// By the equations of the plate's plane and the wall's. (Without lens distortion.)
cv::Mat MiniatureDataSet::depth(std::size_t k) const {
  cv::Mat levels(camera_.height, camera_.width, CV_16U);
  const Eigen::Isometry3d cMo = this->cMo(k), oMc = cMo.inverse();
  for (int v = 0; v < levels.rows; ++v) {
    for (int u = 0; u < levels.cols; ++u) {
      const Eigen::Vector3d ray((u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1);
      const double perDepth = (oMc.linear() * ray).z();
      double Z = -oMc.translation().z() / perDepth;
      const Eigen::Vector3d hit = oMc * (Z * ray);
      if (hit.head<2>().lpNorm<Eigen::Infinity>() > kPlate) {
        Z = (kWall - oMc.translation().z()) / perDepth;
      }
      levels.at<unsigned short>(v, u) = cv::saturate_cast<unsigned short>(kScale * Z);
    }
  }
  return levels;
}

/// From half a second before the first image to after the last.
std::vector<double> MiniatureDataSet::poseTimes() const {
  std::vector<double> times;
  for (int i = -50; times.empty() || times.back() < times_.back() + 0.1; ++i) {
    times.push_back(fileTime(times_[0] + 0.0007 + i / kPoseRate));
  }
  return times;
}

void MiniatureDataSet::writeSettings(const fs::path& folder) const {
  std::string dots;
  for (const Eigen::Vector3d& point : target_.points) {
    const Eigen::Vector3d p = cMo(0) * point;
    const cv::Matx33d K(camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1);
    const LensDistortion& d = camera_.distortion;
    const std::vector<double> coefficients = {d.k1(), d.k2(), d.p1(), d.p2(), d.k3()};
    std::vector<cv::Point2d> pixel;
    cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(), cv::Vec3d(), K,
                      coefficients, pixel);
    dots += fmt::format("{}[{:.3f}, {:.3f}]", dots.empty() ? "" : ", ", pixel[0].x, pixel[0].y);
  }
  write(folder / "sequence.yaml", "name: miniature\ndots: [" + dots + "]\nreplay: {prior: 2}\n");
}

void MiniatureDataSet::writeOwn(const fs::path& folder, std::size_t poseFrom) const {
  const LensDistortion& d = camera_.distortion;
  write(folder / "camera.yaml",
        fmt::format("image_width: {}\nimage_height: {}\n"
                    "camera_matrix: {{rows: 3, cols: 3, data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]}}\n"
                    "distortion_model: plumb_bob\n"
                    "distortion_coefficients: {{rows: 1, cols: 5, data: [{}, {}, {}, {}, {}]}}\n",
                    camera_.width, camera_.height, camera_.fx, camera_.cx, camera_.fy, camera_.cy,
                    d.k1(), d.k2(), d.p1(), d.p2(), d.k3()));
  writeSettings(folder);
  std::string rgb, depths, poses;
  for (std::size_t k = 0; k < size(); ++k) {
    rgb += fmt::format("{:.9f} rgb/{}.png\n", times_[k], k);
    writeImage(folder / fmt::format("rgb/{}.png", k), gray(k));
    if (k >= poseFrom && poseFrom > 0) {
      poses +=
          fmt::format("{:.9f}{}\n", times_[k], poseText(wMc(times_[k]), " {} {} {} {} {} {} {}"));
    }
    if (!map_.empty()) continue;
    depths += fmt::format("{:.9f} depth/{}.png\n", times_[k], k);
    writeImage(folder / fmt::format("depth/{}.png", k), depth(k));
  }
  for (const double t : poseTimes()) {
    if (poseFrom > 0) break;
    poses += fmt::format("{:.9f}{}\n", t, poseText(wMc(t), " {} {} {} {} {} {} {}"));
  }
  write(folder / "rgb.txt", rgb);
  if (!depths.empty()) write(folder / "depth.txt", depths);
  write(folder / "groundtruth.txt", poses);
}

void MiniatureDataSet::writeTum(const fs::path& folder) const {
  constexpr double kDepthLater_s = 0.006;
  writeSettings(folder);
  std::string rgb =
      "# color images\n# file: 'rgbd_dataset_freiburg3_miniature.bag'\n"
      "# timestamp filename\n";
  std::string depths =
      "# depth maps\n# file: 'rgbd_dataset_freiburg3_miniature.bag'\n"
      "# timestamp filename\n";
  for (std::size_t k = 0; k < size(); ++k) {
    cv::Mat colour;
    cv::cvtColor(gray(k), colour, cv::COLOR_GRAY2BGR);
    rgb += fmt::format("{:.9f} rgb/{:.6f}.png\n", times_[k], times_[k]);
    writeImage(folder / fmt::format("rgb/{:.6f}.png", times_[k]), colour);
    const double later = times_[k] + kDepthLater_s;
    depths += fmt::format("{:.6f} depth/{:.6f}.png\n", later, later);
    writeImage(folder / fmt::format("depth/{:.6f}.png", later), depth(k));
  }
  std::string poses =
      "# ground truth trajectory\n# file: 'rgbd_dataset_freiburg3_miniature.bag'\n"
      "# timestamp tx ty tz qx qy qz qw\n";
  for (const double t : poseTimes()) {
    poses += fmt::format("{:.9f}{}\n", t, poseText(wMc(t), " {} {} {} {} {} {} {}"));
  }
  write(folder / "rgb.txt", rgb);
  write(folder / "depth.txt", depths);
  write(folder / "groundtruth.txt", poses);
}

void MiniatureDataSet::writeIcl(const fs::path& folder) const {
  writeSettings(folder);
  const Eigen::Vector3d up(1, -1, 1);
  std::string associations, poses;
  for (std::size_t k = 0; k < size(); ++k) {
    associations += fmt::format("{0} depth/{0}.png {0} rgb/{0}.png\n", k);
    cv::Mat colour;
    cv::cvtColor(gray(k), colour, cv::COLOR_GRAY2BGR);
    writeImage(folder / fmt::format("rgb/{}.png", k), colour);
    writeImage(folder / fmt::format("depth/{}.png", k), depth(k));
    if (k == 0) continue;
    Eigen::Isometry3d pose = wMc(times_[k]);
    pose.linear() = up.asDiagonal() * pose.linear() * up.asDiagonal();
    pose.translation() = up.asDiagonal() * pose.translation();
    poses += fmt::format("{}{}\n", k, poseText(pose, " {} {} {} {} {} {} {}"));
  }
  write(folder / "associations.txt", associations);
  write(folder / "livingRoom2.gt.freiburg", poses);
}

void MiniatureDataSet::writeEuroc(const fs::path& folder) const {
  writeSettings(folder);
  const fs::path camera = folder / "mav0/cam0", truth = folder / "mav0/state_groundtruth_estimate0";
  const LensDistortion& d = camera_.distortion;
  const auto nanoseconds = [](double time_s) {
    std::string digits = fmt::format("{:.9f}", time_s);
    return digits.erase(digits.find('.'), 1);
  };
  std::string images = "#timestamp [ns],filename\r\n";
  for (std::size_t k = 0; k < size(); ++k) {
    const std::string name = nanoseconds(times_[k]);
    images += name + "," + name + ".png\r\n";
    writeImage(camera / "data" / (name + ".png"), gray(k));
  }
  write(camera / "data.csv", images);
  write(
      camera / "sensor.yaml",
      fmt::format("# General sensor definitions.\nsensor_type: camera\n"
                  "comment: VI-Sensor cam0 (MT9M034)\n\n# Sensor extrinsics wrt. the body-frame.\n"
                  "T_BS:\n  cols: 4\n  rows: 4\n  data: {}\n\n# Camera specific definitions.\n"
                  "rate_hz: 20\nresolution: [{}, {}]\ncamera_model: pinhole\n"
                  "intrinsics: [{}, {}, {}, {}] #fu, fv, cu, cv\n"
                  "distortion_model: radial-tangential\n"
                  "distortion_coefficients: [{}, {}, {}, {}]\n",
                  kT_BS, camera_.width, camera_.height, camera_.fx, camera_.fy, camera_.cx,
                  camera_.cy, d.k1(), d.k2(), d.p1(), d.p2()));
  const Eigen::Isometry3d cMb = bodyFromCamera().inverse();
  std::string states =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1]\n";
  for (const double t : poseTimes()) {
    const Eigen::Isometry3d pose = wMc(t) * cMb;
    states += nanoseconds(t) + poseText(pose, ",{0},{1},{2},{6},{3},{4},{5},0,0,0\n");
  }
  write(truth / "data.csv", states);
  write(truth / "sensor.yaml",
        "sensor_type: visual-inertial\ncomment: ground truth\nT_BS:\n  cols: 4\n  rows: 4\n"
        "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  write(folder / "mav0/imu0/data.csv", "#timestamp [ns],w_RS_S_x [rad s^-1]\n1,nan\n");
}

}  // namespace depthservo::test
