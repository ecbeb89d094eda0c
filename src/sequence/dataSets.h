#pragma once

#include <optional>
#include <string>
#include <vector>

#include "depthservo/sequence/Sequence.h"

namespace depthservo::detail {

/// What a public data set says in its own layout.
struct DataSet {
  std::vector<ListedImage> images;
  std::vector<ListedImage> depthImages;
  std::vector<CameraPose> poses;
  std::optional<PinholeCamera> camera;
  std::vector<std::string> warnings;
};

/// What to do with poses that cannot be used: NaN, a quaternion of zeros, a time again.
enum class UnusablePoses {
  refuse,
  skip,  ///< and warn of, as the tools of the TUM RGB-D benchmark do; the last of a time counts
};

/// Poses of the camera in the world, TUM style. \param unit_s length of one unit of time [s]
std::vector<CameraPose> readPoses(const std::string& path, UnusablePoses unusable, double unit_s,
                                  std::vector<std::string>& warnings);

/// Whether the folder lists its images in associations.txt alone, as ICL-NUIM does.
bool isAssociated(const std::string& folder);

/// Images and depth images as associated, poses from the one *.gt.freiburg (groundtruth.txt is left
/// to the caller). Where all times are whole they number frames, `fps` (0: 30) of them per second.
DataSet readAssociated(const std::string& folder, double fps);

/// The mav0 folder of a EuRoC recording: in this folder, or this folder itself.
std::optional<std::string> eurocFolder(const std::string& folder);

/// Camera cam0 and its poses, from those of the body and where the camera sits on it.
DataSet readEuroc(const std::string& mav0);

}  // namespace depthservo::detail
