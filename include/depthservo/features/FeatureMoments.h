#pragma once

#include <visp3/visual_features/vpBasicFeature.h>

#include <Eigen/Core>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/features/ObservedPlane.h"
#include "depthservo/visp/visp.h"

namespace depthservo {

/// What the interaction matrix of FeatureMoments rests on.
using MomentsPlane = PlaneStatus;

/// Three features of a planar set of n points, for vpServo beside (or instead of) FeaturePoint:
///
///     s = (x_g, y_g, scale / sqrt(a)),   a = mu20 + mu02 = sum (x_i - x_g)^2 + (y_i - y_g)^2,
///
/// all in normalised coordinates: where the object is, and how far away (Chaumette 2004; De Luca,
/// Oriolo, Robuffo Giordano 2008, sec. 7.3). The interaction matrix is exact for points on the
/// plane 1/Z = A x + B y + C, an ObservedPlane fitted to the observed points at every image.
///
///     FeaturePointGroup points(ObjectDepthObserver(4), 4);
///     FeatureMoments s(0.2), sd(0.2);
///     sd.buildFrom(pointsAtTheGoal);
///     task.addFeature(s, sd);                    // the points themselves need not be in the task
///     ...
///     points.observe(v, dt);                     // after their x and y were set
///     s.update(points);
///     v = task.computeControlLaw();
///
/// The weight of the third feature is `scale`, the same for s and sd: `scaleFor(sd's points, 1)`
/// makes it 1 at the goal, `scaleFor(..., Z*)` makes it Z* sqrt(a*/a), about the depth. (Left in
/// pixels it has next to no weight against x_g and y_g.)
///
/// All n points belong to the features, always: a hidden one takes part where its estimate says.
/// Like all features they must outlive the task. Real-time: `update` does not allocate, throw, lock
/// or print; `interaction` allocates the matrix it returns. What reaches ViSP is finite.
class DEPTHSERVO_API FeatureMoments : public DEPTHSERVO_VISP vpBasicFeature {
 public:
  /// \param scale of the third feature, > 0 and finite [-]
  explicit FeatureMoments(double scale = 0.2);

  FeatureMoments(const FeatureMoments& other);
  FeatureMoments& operator=(const FeatureMoments& other);

  /// The scale that gives the third feature this value at these points.
  static double scaleFor(const std::vector<PointState>& points, double value = 1);

  /// From points whose depths are known equally well, e.g. those at the goal. \rtsafe
  void buildFrom(const std::vector<PointState>& points);

  /// From the points of a group as its last `observe` left them, at the depths that a task is given
  /// (FeaturePoint::setServoDepth). Before their first `observe`: as
  /// set by the user. \rtsafe
  void update(const PointFeatures& points);

  /// From estimates as they are, however vague, weighted by their sigma_chi. \rtsafe
  void update(const std::vector<DepthEstimate>& points);

  double get_xg() const { return s[0]; }
  double get_yg() const { return s[1]; }
  double get_size() const { return s[2]; }  ///< scale / sqrt(a)
  double area() const { return area_; }     ///< a [-]

  /// (A, B, C) of 1/Z = A x + B y + C [1/m].
  const Eigen::Vector3d& plane() const { return plane_.abc(); }
  MomentsPlane planeStatus() const { return plane_.status(); }
  const ObservedPlane& observedPlane() const { return plane_; }

  /// Depth of the plane at the barycentre [m].
  double Z() const { return 1 / plane_.chiAt(s[0], s[1]); }

  /// Bits for vpServo::addFeature.
  static unsigned selectXg() { return FEATURE_LINE[0]; }
  static unsigned selectYg() { return FEATURE_LINE[1]; }
  static unsigned selectSize() { return FEATURE_LINE[2]; }

  void init() override;
  FeatureMoments* duplicate() const override;
  DEPTHSERVO_VISP vpMatrix interaction(unsigned int select = FEATURE_ALL) override;
  void print(unsigned int select = FEATURE_ALL) const override;
  void display(const DEPTHSERVO_VISP vpCameraParameters& cam,
               const DEPTHSERVO_VISP vpImage<unsigned char>& I,
               const DEPTHSERVO_VISP vpColor& color = DEPTHSERVO_VISP vpColor::green,
               unsigned int thickness = 1) const override;
  void display(const DEPTHSERVO_VISP vpCameraParameters& cam,
               const DEPTHSERVO_VISP vpImage<DEPTHSERVO_VISP vpRGBa>& I,
               const DEPTHSERVO_VISP vpColor& color = DEPTHSERVO_VISP vpColor::green,
               unsigned int thickness = 1) const override;

 private:
  template <typename Points>
  void compute(const Points& points);

  double scale_;
  double area_ = 0;
  ObservedPlane plane_;
  Eigen::Matrix<double, 3, 6> L_ = Eigen::Matrix<double, 3, 6>::Zero();  // of the three features
};

}  // namespace depthservo
