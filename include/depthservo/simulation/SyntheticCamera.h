#pragma once

#include <visp3/core/vpImage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/Ellipse.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/motion/Twist.h"
#include "depthservo/target/DotTarget.h"
#include "depthservo/target/GrayPatch.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

namespace detail {
class PatchPainter;
}

struct SyntheticCameraOptions {
  double background = 220;  ///< gray level 0..255; swap with `dot` for light dots on a dark plate
  double dot = 20;          ///< gray level 0..255
  double gray_noise = 0;    ///< standard deviation [gray levels], white; 0 switches it off
  double exposure_s = 0;    ///< [s]; > 0 blurs by the motion during the exposure
  double vignetting = 0;    ///< relative loss of light in the farthest corner, 0..1, growing as r^2
  std::uint64_t seed = 1;   ///< of the gray noise
};

/// A rectangle of pixels in front of everything; parts outside the image are cut off.
struct Occluder {
  int left = 0, top = 0, width = 0, height = 0;  ///< [px]
  double gray = 128;                             ///< gray level 0..255
};

/// What the camera looks at while it takes one image.
struct SyntheticView {
  Eigen::Isometry3d cMo = Eigen::Isometry3d::Identity();  ///< plate in the camera at mid-exposure
  Twist twist;                                ///< of the camera relative to the plate, for the blur
  std::vector<Eigen::Vector2d> displacement;  ///< of dot i in the image [px]; empty: none
  std::vector<Occluder> occluders;
  std::uint64_t frame = 0;  ///< image number: the noise depends on nothing but (seed, frame)
  /// oMp of patch i at this time, for objects that move; empty: as constructed.
  std::vector<Eigen::Isometry3d> patchPoses = {};
  /// Homography (3x3, pixels to pixels) that is put after the projection of patch i; empty: none.
  std::vector<Eigen::Matrix3d> patchWarps = {};
};

/// Takes gray images of a plate with dots, or of flat patches of gray cells (tags, textured walls).
///
/// A disc of radius r in the plane of the plate, with H (3x3) the homography from that plane,
/// centred at the disc, to pixels, is seen as the ellipse of dual conic H diag(r^2, r^2, -1) H^T:
/// exact, also off the axis and tilted. A pixel is covered by clamp(1/2 - d), d the distance to the
/// ellipse to first order, (q - 1)/|grad q| with q^2 = p^T shape^-1 p; by 8 x 8 samples where the
/// ellipse is thinner than two pixels. Patches are integrated over the square of each pixel exactly
/// (PolygonCoverage), whatever the perspective; the nearer one (by its middle) hides the farther,
/// and dots are printed on top. Cells that reach behind the camera, and patches seen from behind,
/// are not drawn.
///
/// The time of an image is the middle of its exposure: a constant velocity moves the centre of a
/// blurred dot by nothing. Discs that reach behind the camera, or are seen edge-on, are not drawn.
///
/// The same options and view give the same bytes. `render` allocates only when it meets an image of
/// another size or a larger dot than before. One thread per object.
class DEPTHSERVO_API SyntheticCamera {
 public:
  /// \throws std::invalid_argument no size, no focal length, no radius, or an option out of range
  SyntheticCamera(const PinholeCamera& camera, const DotTarget& target,
                  const SyntheticCameraOptions& options = {});

  /// \throws std::invalid_argument a patch without size or whose cells are not columns x rows, and
  /// as above
  SyntheticCamera(const PinholeCamera& camera, std::vector<GrayPatch> patches,
                  const SyntheticCameraOptions& options = {});

  SyntheticCamera(SyntheticCamera&&) noexcept;
  ~SyntheticCamera();

  void render(const SyntheticView& view, DEPTHSERVO_VISP vpImage<unsigned char>& image);

  /// The outline of dot i. Its centre is where a perfect centroid lies: not the projection of the
  /// disc's centre, but (r_px^2/f) sin(t) cos(t) off for a disc tilted by t. Empty when the disc is
  /// not drawn.
  std::optional<Ellipse> ellipse(const Eigen::Isometry3d& cMo, std::size_t i) const;

  /// Projection of the centre of dot i [px]; empty behind the camera.
  std::optional<Eigen::Vector2d> centre(const Eigen::Isometry3d& cMo, std::size_t i) const;

  /// A square that hides dot i with at least `margin_px` to spare; empty when the dot is not drawn.
  std::optional<Occluder> occluderOf(const Eigen::Isometry3d& cMo, std::size_t i,
                                     int margin_px = 6) const;

  /// Depth of the patch that is seen at (u, v) [m], measured along the optical axis; empty where
  /// none is.
  std::optional<double> depthAt(const SyntheticView& view, double u, double v) const;

  const PinholeCamera& camera() const { return camera_; }
  const DotTarget& target() const { return target_; }
  const std::vector<GrayPatch>& patches() const { return patches_; }

 private:
  template <typename Pixel>
  void draw(const SyntheticView& view, Pixel* pixels);
  template <typename Pixel>
  void drawDot(const SyntheticView& view, std::size_t i, Pixel* pixels);
  template <typename Pixel>
  void drawPatch(const SyntheticView& view, std::size_t i, Pixel* pixels);
  std::vector<std::size_t> farthestFirst(const SyntheticView& view) const;
  Eigen::Isometry3d patchInCamera(const SyntheticView& view, std::size_t i) const;
  void prepare();

  PinholeCamera camera_;
  DotTarget target_;
  std::vector<GrayPatch> patches_;
  SyntheticCameraOptions options_;
  std::unique_ptr<detail::PatchPainter> painter_;  // null: no patches
  std::vector<Ellipse> exposed_;                   // the dot at hand at instants of the exposure
  std::vector<float> coverage_;                    // of the dot at hand, row-major over its box
  std::vector<float> light_;           // the image before noise and rounding; empty when not needed
  std::vector<float> gain_;            // vignetting by pixel; empty when off
  std::vector<float> noiseQuantiles_;  // equally likely values of the noise; empty when off
};

}  // namespace depthservo
