#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/target/GrayPatch.h"

namespace depthservo {

/// The families of libapriltag, as users name them: 36h11, 25h9, 16h5, Standard41h12, ...
DEPTHSERVO_API std::vector<std::string> aprilTagFamilies();

/// How many tags a family has. \throws std::invalid_argument no such family
DEPTHSERVO_API int aprilTagCount(const std::string& family);

/// AprilTags on one rigid object.
///
/// Tag frame: origin in the middle, x right, y down as the tag is printed, z away from the viewer.
/// The size is the side of the square whose corners the detector gives: of the black square for
/// 36h11, 25h9 and 16h5, of the edge between the black and the white square for Standard41h12 and
/// the like.
///
/// Points are corners: corner 0 is bottom left, 1 bottom right, 2 top right, 3 top left; corner j
/// of the tag at index i of `tags` has the id 4 i + j.
struct DEPTHSERVO_API AprilTagTarget {
  struct Tag {
    int id = 0;                                             ///< as coded in the tag
    std::optional<double> size;                             ///< [m]; empty: unknown
    Eigen::Isometry3d oMt = Eigen::Isometry3d::Identity();  ///< tag in the object frame
  };
  std::string family = "36h11";
  std::vector<Tag> tags;

  bool hasSizes() const;  ///< of all tags

  /// The corners of a tag of side 1 in its frame, in order.
  static std::array<Eigen::Vector3d, 4> unitCorners();

  /// All corners in the object frame [m], index by id. Needs the sizes. \throws std::logic_error
  std::vector<Eigen::Vector3d> corners() const;

  /// The printed tags, from the library's own bitmaps, with their white margin. Needs the sizes.
  /// \param ink, paper gray levels \throws std::invalid_argument no such family or id
  std::vector<GrayPatch> patches(unsigned char ink = 20, unsigned char paper = 220) const;
};

/// Bitmap of a tag with its margin: `gray` 0 or 255, columns = rows; width and height [m] are of
/// the whole bitmap when the tag has this size. \throws std::invalid_argument no such family or id
DEPTHSERVO_API GrayPatch aprilTagBitmap(const std::string& family, int id, double size = 1);

}  // namespace depthservo
