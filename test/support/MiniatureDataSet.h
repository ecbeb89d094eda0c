#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/target/DotTarget.h"

namespace depthservo::test {

/// A second and a half of a camera swaying and advancing before a plate with four dots and a wall
/// behind it, written in the layouts of public data sets. Images and depth images come from
/// SyntheticCamera and from the planes' equations; lens distortion is OpenCV's.
class MiniatureDataSet {
 public:
  /// \param start_s time of the first image
  explicit MiniatureDataSet(const PinholeCamera& camera, double start_s = 1305031102.175304);

  /// As our own sequences are: camera.yaml, rgb.txt, depth.txt, groundtruth.txt, sequence.yaml.
  /// \param poseFrom first image with a pose
  void writeOwn(const std::filesystem::path& folder, std::size_t poseFrom = 0) const;

  /// As downloaded from the TUM RGB-D benchmark: colour images, depth 6 ms after them; with our
  /// sequence.yaml beside.
  void writeTum(const std::filesystem::path& folder) const;

  /// As downloaded from ICL-NUIM: frame numbers for times, depth before image in
  /// associations.txt, no pose for image 0, and everything in a frame with y up.
  void writeIcl(const std::filesystem::path& folder) const;

  /// As downloaded from EuRoC: mav0/cam0 with distorted gray images, poses of the body.
  void writeEuroc(const std::filesystem::path& folder) const;

  const PinholeCamera& camera() const { return camera_; }
  std::size_t size() const { return times_.size(); }
  double time_s(std::size_t k) const { return times_[k]; }

  /// True depth of dot `id` in image k [m].
  double trueDepth(std::size_t k, std::size_t id) const;

 private:
  Eigen::Isometry3d wMc(double time_s) const;
  Eigen::Isometry3d cMo(std::size_t k) const;
  cv::Mat gray(std::size_t k) const;
  cv::Mat depth(std::size_t k) const;
  std::vector<double> poseTimes() const;
  void writeSettings(const std::filesystem::path& folder) const;

  PinholeCamera camera_;
  DotTarget target_;
  Eigen::Isometry3d wMo_;
  std::vector<double> times_;  // of the images, as files hold them [s]
  cv::Mat map_;  // from pixels of the lens to those of a wide camera without; empty: none
  PinholeCamera wide_;
};

}  // namespace depthservo::test
