#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/motion/RpyPose.h"
#include "depthservo/motion/VelocityProfile.h"
#include "depthservo/target/AprilTagTarget.h"
#include "depthservo/target/BoardTarget.h"
#include "depthservo/target/DotTarget.h"

namespace depthservo {

/// What the camera looks at: dots | apriltag | wall | chessboard | charuco.
enum class TargetKind { dots, apriltag, wall, chessboard, charuco };

constexpr std::size_t kMostTargetPoints = 64;

/// An AprilTag on the target.
struct TagOptions {
  int id = 0;
  double size = 0.16;                  ///< side of the square between the corners, as it is [m]
  std::optional<double> assumed_size;  ///< as the user believes [m]; none: unknown
  RpyPose pose;                        ///< in the object frame
};

/// A textured wall: every cell has a gray level of its own.
struct WallOptions {
  double width = 2, height = 1.5;  ///< [m]
  double cell = 0.03;              ///< side of a cell, about [m]
  unsigned seed = 1;               ///< of the gray levels
  RpyPose pose;                    ///< of its middle in the object frame: x right, y down, z away
};

/// A chessboard or a ChArUco board in the object frame; its words are those of BoardTarget.
struct BoardOptions {
  int columns = 7, rows = 4;
  double square = 0.04;               ///< [m]
  double marker = 0.03;               ///< of a ChArUco board [m]
  std::string dictionary = "4x4_50";  ///< of a ChArUco board
};

struct DEPTHSERVO_API TargetOptions {
  TargetKind type = TargetKind::dots;
  /// Centres of the dots, or the corners of tags or board (not read then, but worked out) [m],
  /// object frame.
  std::vector<Eigen::Vector3d> points;
  double radius = 0.02;          ///< of the dots [m]
  std::string family = "36h11";  ///< of the tags
  std::vector<TagOptions> tags;
  std::vector<WallOptions> walls;
  BoardOptions board;
  /// wMo. The default faces the -x direction of the world: object x is world -y, y is world -z
  /// and z is world x.
  RpyPose pose{{0, 0, 0.13}, {-1.5707963267948966, 0, -1.5707963267948966}};
  VelocityProfile twist;  ///< of the target in its own frame; empty: it stands still

  /// What is known of the points: of tags only if their sizes are assumed.
  DotTarget dots() const;
  std::vector<GrayPatch> patches() const;  ///< as they are: tags, walls or a board
  bool hasBoard() const;                   ///< chessboard or charuco
  BoardTarget boardTarget() const;
  /// Where no points are given: the corners of tags or board; of each wall four points half way to
  /// its corners.
  std::vector<Eigen::Vector3d> ownPoints() const;
  AprilTagTarget trueTags() const;     ///< with the sizes that they have
  AprilTagTarget assumedTags() const;  ///< with the sizes that are assumed
};

/// Points or tags that do not fit together, or the type of target. \param refuse hears key and
/// reason
DEPTHSERVO_API void check(
    const TargetOptions& target,
    const std::function<void(const std::string& key, const std::string& why)>& refuse);

}  // namespace depthservo
