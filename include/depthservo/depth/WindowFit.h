#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>

#include "depthservo/api.h"
#include "depthservo/depth/DepthEstimate.h"
#include "depthservo/motion/Flow.h"

namespace depthservo {

/// An inverse depth measured directly, e.g. by a range sensor.
struct DEPTHSERVO_API DirectDepth {
  double chi = 0;                                          ///< [1/m]
  double sigma = std::numeric_limits<double>::infinity();  ///< [1/m]; infinite: none

  bool isKnown() const { return sigma < std::numeric_limits<double>::infinity(); }
  DirectDepth fusedWith(const DirectDepth& other) const;  ///< by inverse variances
};

/// An image of the window: what was measured in it, and the way there from the camera's place now.
struct WindowImage {
  PointMeasurement point;
  Motion toThere;     ///< p_there = R p_now + t; the identity for the newest image
  DirectDepth depth;  ///< measured there, if at all
};

/// The images of one still point: the newest, and n earlier ones in any order.
struct WindowImages {
  const WindowImage& newest;
  const WindowImage* earlier;
  std::size_t n;
};

/// Why images do not determine a depth.
enum class WindowDegeneracy {
  none,
  noBaseline,  ///< the camera has not moved across the line of sight: one image, rotation about the
               ///< optical centre, or a point on the line of the translation
  behind,      ///< poses and images contradict each other: the point would be behind a camera
  infinity,    ///< the best inverse depth is not positive: too far, or the noise too strong
};
DEPTHSERVO_API const char* toString(WindowDegeneracy degeneracy);

/// The point that fits all images of a window, in the frame of the newest.
struct WindowFit {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();             ///< (x, y, chi); chi may be <= 0
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();        ///< of `point`
  WindowDegeneracy degeneracy = WindowDegeneracy::noBaseline;  ///< unless none: for diagnosis only
  /// Sum of squared residuals over sigma^2, weighed; chi-square with `dof` if all is well.
  double cost = 0;
  int dof = 0;  ///< 0: no cost (least squares)

  double chi() const { return point.z(); }
  double sigma_chi() const { return std::sqrt(covariance(2, 2)); }
};

/// Linear least squares in chi (Durand Petiteville, Courdesses, Cadenat, "A new predictor/corrector
/// pair to estimate the visual features depth", ICINCO 2010, eq. 21-23), for any robot: with
/// (R, t) the pose of camera j in the newest, u = (x_j, y_j, 1),
///     m = A_j + B_j chi,   A = (R u)_12 / (R u)_3,   B = t_12 - A t_3
///     chi = sum B_j.(m - A_j) / S,   S = sum |B_j|^2
/// (x, y) is the newest measurement. All residuals share its noise, which more images do not
/// average out: the covariance accounts for it. Direct depths are weighed in by their variances.
/// \rtsafe
DEPTHSERVO_API WindowFit fitLeastSquares(const WindowImages& images);

/// Maximum likelihood: minimises the distances to all images, the newest included, over (x, y,
/// chi), by two Gauss-Newton steps from the least squares (2e-6 of the distance is left). About
/// half the error of least squares. \rtsafe
DEPTHSERVO_API WindowFit fitMaximumLikelihood(const WindowImages& images);

/// The same with every image weighed by its residual: three Huber passes (2 sigma), then ten of
/// Tukey's (4.685 sigma). Withstands outliers, in the newest image too; costs 4 % of accuracy
/// without them and four times the time. \rtsafe
DEPTHSERVO_API WindowFit fitRobustly(const WindowImages& images);

}  // namespace depthservo
