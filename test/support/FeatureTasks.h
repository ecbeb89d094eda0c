#pragma once

#include <visp3/core/vpCircle.h>
#include <visp3/core/vpExponentialMap.h>
#include <visp3/core/vpLine.h>
#include <visp3/core/vpMomentCommon.h>
#include <visp3/core/vpSphere.h>
#include <visp3/visual_features/vpFeatureMomentCommon.h>
#include <visp3/visual_features/vpFeatureThetaU.h>

#include <cmath>
#include <memory>
#include <vector>

#include "depthservo/depth/ObjectDepthObserver.h"
#include "depthservo/features/FeatureDepth.h"
#include "depthservo/features/FeatureEllipse.h"
#include "depthservo/features/FeatureLine.h"
#include "depthservo/features/FeatureLuminance.h"
#include "depthservo/features/FeaturePoint.h"
#include "depthservo/features/FeaturePointGroup.h"
#include "depthservo/features/FeaturePointPolar.h"
#include "depthservo/features/FeatureSegment.h"
#include "support/FourPointScene.h"
#include "support/Random.h"

namespace depthservo::test {

/// A servo task of one kind of feature, set from the true pose of its target. Depths come from the
/// truth, from a guess that stays, or from `observe`.
class FeatureTask {
 public:
  enum class Parameter { truth, constant, observed };
  static constexpr double kFocal_px = 600, kGoal = .5;

  virtual ~FeatureTask() = default;

  /// Adds its features, with those desired, to a task; once.
  virtual void addTo(vpServo& task) = 0;
  /// What the image shows, with noise [-].
  virtual void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) = 0;
  /// Sets the 3D parameters to the truth, its depths times this factor.
  virtual void setParameters(const vpHomogeneousMatrix& cMo, double factor) = 0;
  virtual void observe(const vpColVector& v, double dt) = 0;
  /// What a program has to do besides, observed or not, before the control law.
  virtual void update() {}
  /// Of the error's largest component at the goal.
  virtual double tolerance() const { return 4 / kFocal_px; }

  static vpHomogeneousMatrix goal() { return vpHomogeneousMatrix(0, 0, kGoal, 0, 0, 0); }
};

inline double clean(double value, Random& random, double noise) {
  return noise > 0 ? value + random.normal(noise) : value;
}

class PolarTask : public FeatureTask {
 public:
  void addTo(vpServo& task) override {
    for (std::size_t i = 0; i < 4; ++i) {
      vpFeatureBuilder::create(desired_[i], FourPointScene::at(i, aside()));
      task.addFeature(s_[i], desired_[i]);
    }
  }
  void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) override {
    for (std::size_t i = 0; i < 4; ++i) {
      const vpPoint p = FourPointScene::at(i, cMo);
      const double x = clean(p.get_x(), random, noise), y = clean(p.get_y(), random, noise);
      s_[i].set_rho(std::hypot(x, y));
      s_[i].set_theta(std::atan2(y, x));
    }
  }
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    for (std::size_t i = 0; i < 4; ++i) s_[i].set_Z(factor * FourPointScene::at(i, cMo).get_Z());
  }
  void observe(const vpColVector& v, double dt) override {
    for (auto& s : s_) s.observe(v, dt);
  }

 private:
  static vpHomogeneousMatrix aside() { return goal(); }
  std::vector<FeaturePointPolar> s_{4};
  std::vector<vpFeaturePointPolar> desired_{4};
};

/// 2 1/2 D: a point, log(Z/Z*) of it, and the rotation to the goal.
class DepthTask : public FeatureTask {
 public:
  DepthTask() : rotation_(vpFeatureThetaU::cdRc), noRotation_(vpFeatureThetaU::cdRc) {}
  void addTo(vpServo& task) override {
    vpPoint p = FourPointScene::at(0, goal());
    vpFeatureBuilder::create(pointDesired_, p);
    depth_.setDesiredDepth(kGoal);
    task.addFeature(point_, pointDesired_);
    task.addFeature(depth_, depthDesired_);
    task.addFeature(rotation_, noRotation_);
  }
  void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) override {
    const vpPoint p = FourPointScene::at(0, cMo);
    const double x = clean(p.get_x(), random, noise), y = clean(p.get_y(), random, noise);
    point_.set_x(x);
    point_.set_y(y);
    depth_.set_x(x);
    depth_.set_y(y);
    const vpHomogeneousMatrix cdMc = goal() * cMo.inverse();
    vpThetaUVector thetaU{vpRotationMatrix(cdMc)};
    rotation_.buildFrom(thetaU);
  }
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    const double Z = factor * FourPointScene::at(0, cMo).get_Z();
    point_.set_Z(Z);
    depth_.set_Z(Z);
    depth_.set_LogZoverZstar(std::log(Z / kGoal));
  }
  void observe(const vpColVector& v, double dt) override {
    point_.observe(v, dt);
    depth_.observe(v, dt);
  }
  double tolerance() const override { return .02; }  // of log Z: 2 %

 private:
  FeaturePoint point_;
  vpFeaturePoint pointDesired_;
  FeatureDepth depth_;
  vpFeatureDepth depthDesired_;
  vpFeatureThetaU rotation_, noRotation_;
};

class SegmentTask : public FeatureTask {
 public:
  void addTo(vpServo& task) override {
    for (std::size_t i = 0; i < 2; ++i) {
      vpPoint a = FourPointScene::at(2 * i, goal()), b = FourPointScene::at(2 * i + 1, goal());
      vpFeatureBuilder::create(desired_[i], a, b);
      task.addFeature(s_[i], desired_[i]);
    }
  }
  void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) override {
    for (std::size_t i = 0; i < 2; ++i) {
      const vpPoint a = FourPointScene::at(2 * i, cMo), b = FourPointScene::at(2 * i + 1, cMo);
      const double x1 = clean(a.get_x(), random, noise), y1 = clean(a.get_y(), random, noise);
      const double x2 = clean(b.get_x(), random, noise), y2 = clean(b.get_y(), random, noise);
      s_[i].setXc((x1 + x2) / 2);
      s_[i].setYc((y1 + y2) / 2);
      s_[i].setL(std::hypot(x1 - x2, y1 - y2));
      s_[i].setAlpha(std::atan2(y1 - y2, x1 - x2));
    }
  }
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    for (std::size_t i = 0; i < 2; ++i) {
      s_[i].setZ1(factor * FourPointScene::at(2 * i, cMo).get_Z());
      s_[i].setZ2(factor * FourPointScene::at(2 * i + 1, cMo).get_Z());
    }
  }
  void observe(const vpColVector& v, double dt) override {
    for (auto& s : s_) s.observe(v, dt);
  }

 private:
  std::vector<FeatureSegment> s_ = std::vector<FeatureSegment>(2);
  std::vector<vpFeatureSegment> desired_ = std::vector<vpFeatureSegment>(2);
};

/// The four sides of the square.
class LineTask : public FeatureTask {
 public:
  void addTo(vpServo& task) override {
    for (std::size_t i = 0; i < 4; ++i) {
      const vpLine line = side(i, goal());
      vpFeatureBuilder::create(desired_[i], line);
      s_[i].setDesiredDepth(kGoal);
      s_[i].setNoise(.25 / kFocal_px, 1e-3);
      task.addFeature(s_[i], desired_[i]);
    }
  }
  void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) override {
    for (std::size_t i = 0; i < 4; ++i) {
      const vpLine line = side(i, cMo);
      s_[i].setRhoTheta(clean(line.getRho(), random, noise),
                        clean(line.getTheta(), random, 2.4 * noise));
    }
  }
  /// The plane of the square; of the lines' own two only one has it in the target's plane.
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    double D = 0;
    for (unsigned j = 0; j < 3; ++j) D -= cMo[j][2] * cMo[j][3];
    for (auto& s : s_) s.setABCD(cMo[0][2], cMo[1][2], cMo[2][2], factor * D);
  }
  void observe(const vpColVector& v, double dt) override {
    for (auto& s : s_) s.observe(v, dt);
  }
  double tolerance() const override { return .01; }  // half a degree

  static vpLine side(std::size_t i, const vpHomogeneousMatrix& cMo) {
    const double h = .08;
    vpLine line;  // of the plane z = 0 and one across it
    const double a = i == 0 ? 1 : i == 1 ? -1 : 0, b = i == 2 ? 1 : i == 3 ? -1 : 0;
    line.setWorldCoordinates(a, b, 0, h, 0, 0, 1, 0);
    line.track(cMo);
    return line;
  }

 private:
  std::vector<FeatureLine> s_{4};
  std::vector<vpFeatureLine> desired_{4};
};

/// A circle or a sphere of 8 cm radius.
template <EllipseShape kShape>
class EllipseTask : public FeatureTask {
 public:
  EllipseTask() : s_(kShape) {
    s_.setDesiredDepth(kGoal);
    s_.setNoise(.25, vpCameraParameters(kFocal_px, kFocal_px, 320, 240));
  }
  void addTo(vpServo& task) override {
    create(desired_, goal());
    task.addFeature(s_, desired_);
  }
  void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) override {
    vpFeatureEllipse seen;
    create(seen, cMo);
    const double a = std::sqrt(seen.get_n20()), b = std::sqrt(seen.get_n02());
    s_.buildFrom(clean(seen.get_x(), random, noise), clean(seen.get_y(), random, noise),
                 clean(seen.get_n20(), random, noise * a),
                 clean(seen.get_n11(), random, noise * std::hypot(a, b) / 2),
                 clean(seen.get_n02(), random, noise * b));
  }
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    const Eigen::Vector3d abc = plane(cMo) / factor;
    s_.setABC(abc[0], abc[1], abc[2]);
  }
  void observe(const vpColVector& v, double dt) override { s_.observe(v, dt); }

  static Eigen::Vector3d plane(const vpHomogeneousMatrix& cMo) {
    const Eigen::Vector3d X(cMo[0][3], cMo[1][3], cMo[2][3]), n(cMo[0][2], cMo[1][2], cMo[2][2]);
    if (kShape == EllipseShape::sphere) return X / (X.squaredNorm() - .08 * .08);
    return n / n.dot(X);
  }
  static void create(vpFeatureEllipse& s, const vpHomogeneousMatrix& cMo) {
    if constexpr (kShape == EllipseShape::sphere) {
      vpSphere sphere(0, 0, 0, .08);
      sphere.track(cMo);
      vpFeatureBuilder::create(s, sphere);
    } else {
      vpCircle circle(0, 0, 1, 0, 0, 0, .08);
      circle.track(cMo);
      vpFeatureBuilder::create(s, circle);
    }
  }

 private:
  FeatureEllipse s_;
  vpFeatureEllipse desired_;
};

/// ViSP's own moments of eight points, as its example servoMomentPoints has them: gravity centre
/// and area, normalised, two invariants of order 3, and the angle.
class MomentsTask : public FeatureTask {
 public:
  MomentsTask() : object_(6), objectDesired_(6), points_(ObjectDepthObserver(kCount), kCount) {
    object_.setType(vpMomentObject::DISCRETE);
    objectDesired_.setType(vpMomentObject::DISCRETE);
    see(goal(), objectDesired_);
    for (auto* moments : {&moments_, &momentsDesired_}) {
      *moments = std::make_unique<vpMomentCommon>(vpMomentCommon::getSurface(objectDesired_),
                                                  vpMomentCommon::getMu3(objectDesired_),
                                                  vpMomentCommon::getAlpha(objectDesired_), kGoal);
      (*moments)->updateAll(objectDesired_);
    }
    features_ = std::make_unique<vpFeatureMomentCommon>(*moments_, 0, 0, 1 / kGoal);
    desired_ = std::make_unique<vpFeatureMomentCommon>(*momentsDesired_, 0, 0, 1 / kGoal);
    setPlane(goal(), 1);
    plane_.applyTo(*desired_);
  }
  void addTo(vpServo& task) override {
    task.addFeature(features_->getFeatureGravityNormalized(),
                    desired_->getFeatureGravityNormalized());
    task.addFeature(features_->getFeatureAn(), desired_->getFeatureAn());
    task.addFeature(features_->getFeatureCInvariant(), desired_->getFeatureCInvariant(),
                    (1 << 3) | (1 << 5));
    task.addFeature(features_->getFeatureAlpha(), desired_->getFeatureAlpha());
  }
  void measure(const vpHomogeneousMatrix& cMo, Random& random, double noise) override {
    std::vector<vpPoint> seen = see(cMo, object_);
    for (std::size_t i = 0; i < kCount; ++i) {
      seen[i].set_x(clean(seen[i].get_x(), random, noise));
      seen[i].set_y(clean(seen[i].get_y(), random, noise));
      points_[i].set_x(seen[i].get_x());
      points_[i].set_y(seen[i].get_y());
    }
    object_.fromVector(seen);
    moments_->updateAll(object_);
  }
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    setPlane(cMo, factor);
    for (std::size_t i = 0; i < kCount; ++i) points_[i].set_Z(factor * at(i, cMo).get_Z());
  }
  void observe(const vpColVector& v, double dt) override {
    points_.observe(v, dt);
    plane_.update(points_);
  }
  void update() override { plane_.applyTo(*features_); }
  double tolerance() const override { return .1; }  // of the invariants: 4 sigma of their noise

 private:
  static constexpr std::size_t kCount = 8;

  static vpPoint at(std::size_t i, const vpHomogeneousMatrix& cMo) {
    constexpr double kX[]{1, 3, 4, -1, -3, -2, -1, 1}, kY[]{0, 1, 4, 4, -2, -2, 1, 0};
    vpPoint p(kX[i] / 25, kY[i] / 25, 0);
    p.track(cMo);
    return p;
  }
  static std::vector<vpPoint> see(const vpHomogeneousMatrix& cMo, vpMomentObject& object) {
    std::vector<vpPoint> seen;
    for (std::size_t i = 0; i < kCount; ++i) seen.push_back(at(i, cMo));
    object.fromVector(seen);
    return seen;
  }
  void setPlane(const vpHomogeneousMatrix& cMo, double factor) {
    std::vector<PointState> points;
    for (std::size_t i = 0; i < kCount; ++i) {
      const vpPoint p = at(i, cMo);
      points.push_back({p.get_x(), p.get_y(), 1 / (factor * p.get_Z())});
    }
    plane_.buildFrom(points);
  }

  vpMomentObject object_, objectDesired_;
  std::unique_ptr<vpMomentCommon> moments_, momentsDesired_;
  std::unique_ptr<vpFeatureMomentCommon> features_, desired_;
  FeaturePointGroup points_;
  ObservedPlane plane_;
};

/// A wall with soft blobs.
class LuminanceTask : public FeatureTask {
 public:
  static constexpr unsigned kRows = 60, kColumns = 80;
  LuminanceTask() : cam_(100, 100, 39.5, 29.5), image_(kRows, kColumns) {
    s_.init(kRows, kColumns, kGoal);
    s_.setCameraParameters(cam_);
    s_.setDesiredDepth(kGoal);
    desired_.init(kRows, kColumns, kGoal);
    desired_.setCameraParameters(cam_);
    render(goal());
    desired_.buildFrom(image_);
  }
  void addTo(vpServo& task) override { task.addFeature(s_, desired_); }
  void measure(const vpHomogeneousMatrix& cMo, Random&, double) override {
    render(cMo);
    s_.buildFrom(image_);
  }
  void setParameters(const vpHomogeneousMatrix& cMo, double factor) override {
    const Eigen::Vector3d n(cMo[0][2], cMo[1][2], cMo[2][2]);
    const Eigen::Vector3d abc =
        n / (factor * n.dot(Eigen::Vector3d(cMo[0][3], cMo[1][3], cMo[2][3])));
    std::vector<PointState> points;
    for (const double x : {-.3, .3}) {
      for (const double y : {-.2, .2}) points.push_back({x, y, abc.dot(Eigen::Vector3d(x, y, 1))});
    }
    ObservedPlane plane;
    plane.buildFrom(points);
    s_.set_Z(1 / abc.z());
    s_.update(plane);
  }
  void observe(const vpColVector& v, double dt) override { s_.observe(v, dt); }
  double tolerance() const override { return 6; }  // gray levels, of any pixel

  const FeatureLuminance& feature() const { return s_; }

 private:
  void render(const vpHomogeneousMatrix& cMo) {
    const vpHomogeneousMatrix oMc = cMo.inverse();
    for (unsigned i = 0; i < kRows; ++i) {
      for (unsigned j = 0; j < kColumns; ++j) {
        const double x = (j - cam_.get_u0()) / cam_.get_px(),
                     y = (i - cam_.get_v0()) / cam_.get_py();
        const double d[3]{oMc[0][0] * x + oMc[0][1] * y + oMc[0][2],
                          oMc[1][0] * x + oMc[1][1] * y + oMc[1][2],
                          oMc[2][0] * x + oMc[2][1] * y + oMc[2][2]};
        const double k = -oMc[2][3] / d[2];
        const double X = oMc[0][3] + k * d[0], Y = oMc[1][3] + k * d[1];
        const double gray = 128 + 50 * std::sin(11 * X + 3 * Y) +
                            40 * std::sin(13 * Y - 4 * X + 1) + 20 * std::sin(17 * X * Y + 9 * X);
        image_[i][j] = static_cast<unsigned char>(std::lround(std::clamp(gray, 0., 255.)));
      }
    }
  }

  vpCameraParameters cam_;
  vpImage<unsigned char> image_;
  FeatureLuminance s_;
  vpFeatureLuminance desired_;
};

/// Whether the task ends, and stays, within its tolerance in 12 s at 30 Hz. \param start of the
/// target in the camera \param factor of the guess against the truth at the start
inline bool succeeds(FeatureTask& features, const vpHomogeneousMatrix& start,
                     FeatureTask::Parameter parameter, double factor, unsigned seed) {
  constexpr int kImages = 360, kToStay = 30;
  constexpr double kNoise = .25 / FeatureTask::kFocal_px;
  Random random(seed);
  FourPointScene scene(start.inverse());
  vpServo task;
  task.setServo(vpServo::EYEINHAND_CAMERA);
  task.setInteractionMatrixType(vpServo::CURRENT);
  task.setLambda(.8);
  features.addTo(task);
  if (parameter != FeatureTask::Parameter::truth) features.setParameters(start, factor);
  vpColVector v(6, 0.);
  for (int k = 0; k < kImages; ++k) {
    const vpHomogeneousMatrix cMo = scene.cMo();
    if (!(cMo[2][3] > .1 && cMo[2][3] < 5)) return false;
    features.measure(cMo, random, kNoise);
    if (parameter == FeatureTask::Parameter::truth) features.setParameters(cMo, 1);
    if (parameter == FeatureTask::Parameter::observed) features.observe(v, kPeriod_s);
    features.update();
    v = scene.apply(task.computeControlLaw());
    if (k < kImages - kToStay) continue;
    for (unsigned i = 0; i < task.getError().size(); ++i) {
      if (!(std::abs(task.getError()[i]) < features.tolerance())) return false;
    }
  }
  return true;
}

}  // namespace depthservo::test
