#pragma once

#include <string>
#include <vector>

#include "sequence/dataSets.h"

namespace depthservo::detail {

/// Whether the folder has images named as in 7-Scenes and ScanNet, frame-000000.color.png or .jpg.
bool isFrameFolder(const std::string& folder);

/// Such images, `fps` (0: 30) of them per second; depth images frame-000000.depth.png of the same
/// size [mm]; poses frame-000000.pose.txt, 4x4, camera in world. Poses that are not finite are left
/// out, and warned of.
DataSet readFrameFolder(const std::string& folder, double fps);

constexpr double kFrameFolderScale = 1000;  ///< gray levels of its depth images per metre

/// Poses without times, one for each image in order: poses.txt with the 16 numbers of a 4x4 matrix in
/// a line, row by row, or the 12 of its first three rows (KITTI). Throws InputError.
std::vector<CameraPose> readPoseMatrices(const std::string& path,
                                         const std::vector<SequenceFrame>& frames);

}  // namespace depthservo::detail
