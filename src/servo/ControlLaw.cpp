#include "servo/ControlLaw.h"

#include <visp3/vs/vpServo.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "depthservo/features/FeatureMoments.h"
#include "depthservo/features/TaskFunction.h"
#include "depthservo/pose/PoseRegulation.h"
#include "depthservo/text/InputError.h"
#include "depthservo/tracking/KnownTargetEstimator.h"
#include "depthservo/visp/using.h"
#include "robots/cameraJacobian.h"
#include "servo/ExcitingLaw.h"

namespace depthservo {
namespace {

vpServo::vpServoIteractionMatrixType interactionType(InteractionKind interaction) {
  switch (interaction) {
    case InteractionKind::current:
      return vpServo::CURRENT;
    case InteractionKind::mean:
      return vpServo::MEAN;
    case InteractionKind::desired:
      return vpServo::DESIRED;
  }
  return vpServo::CURRENT;
}

/// A depth with a greater sigma_chi / chi is in doubt.
constexpr double kDoubt = 0.5;

/// An image error above this is a long way, as a fraction of the image's width.
constexpr double kLongWay = 0.1;

std::vector<PointState> desiredPoints(const LawSetup& setup) {
  std::vector<PointState> points;
  for (std::size_t i = 0; i < setup.goal.pixels.size(); ++i) {
    const Eigen::Vector2d s =
        setup.camera.normalise(setup.goal.pixels[i].x(), setup.goal.pixels[i].y());
    points.push_back({s.x(), s.y(), 1 / setup.goal.Z[i]});
  }
  return points;
}

/// The velocities that vpServo computes.
Velocities computed(vpServo& task, const RobotModel& robot) {
  task.set_cVe(robot.cVe());
  task.set_eJe(robot.eJe());
  const vpColVector qdot = task.computeControlLaw();
  return Eigen::Map<const Eigen::VectorXd>(qdot.data, qdot.getRows());
}

void setUp(vpServo& task, const ControlOptions& control) {
  task.setServo(vpServo::EYEINHAND_L_cVe_eJe);
  task.setInteractionMatrixType(interactionType(control.interaction));
  task.setLambda(control.gain);
}

/// vpServo on the points.
class PointLaw : public ControlLaw {
 public:
  PointLaw(const LawSetup& setup, PointFeatures& features)
      : features_(features),
        gain_(setup.control.gain),
        gainInDoubt_(gain_ * setup.control.gain_in_doubt),
        longWay_(kLongWay * setup.camera.width / setup.camera.fx),
        desired_(features.size()) {
    const std::vector<PointState> points = desiredPoints(setup);
    for (std::size_t i = 0; i < features.size(); ++i) {
      desired_[i].buildFrom(points[i].x, points[i].y, setup.goal.Z[i]);
      features[i].setDesiredDepth(setup.goal.Z[i]);
      task_.addFeature(features[i], desired_[i]);
    }
    setUp(task_, setup.control);
  }

  Velocities command(const ControlInput& now) override {
    task_.setLambda(isInDoubt() ? gainInDoubt_ : gain_);
    return computed(task_, now.robot);
  }

 private:
  /// A wrong depth does harm where the way is long.
  bool isInDoubt() const {
    double worst = 0, squared = 0;
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const DepthEstimate& e = features_[i].estimate();
      worst = std::max(worst, e.sigma_chi / e.chi);
      const double dx = features_[i].get_x() - desired_[i].get_x();
      const double dy = features_[i].get_y() - desired_[i].get_y();
      squared += dx * dx + dy * dy;
    }
    const auto n = static_cast<double>(features_.size());
    return worst > kDoubt && squared > n * longWay_ * longWay_;
  }

  const PointFeatures& features_;
  double gain_, gainInDoubt_;
  double longWay_;  // rms distance of the points from their goals, normalised
  std::vector<vpFeaturePoint> desired_;
  vpServo task_;  // after the desired features: its destructor asks them who deallocates them
};

/// vpServo on the moments of all points.
class MomentLaw : public ControlLaw {
 public:
  MomentLaw(const LawSetup& setup, const PointFeatures& points)
      : points_(points),
        moments_(FeatureMoments::scaleFor(desiredPoints(setup), setup.control.size_weight)),
        desired_(moments_) {
    desired_.buildFrom(desiredPoints(setup));
    task_.addFeature(moments_, desired_);
    setUp(task_, setup.control);
  }

  Velocities command(const ControlInput& now) override {
    moments_.update(points_);
    return computed(task_, now.robot);
  }

 private:
  const PointFeatures& points_;
  FeatureMoments moments_, desired_;
  vpServo task_;  // after the features
};

/// The task function: only depths at the goal enter.
class TaskLaw : public ControlLaw {
 public:
  TaskLaw(const LawSetup& setup, const PointFeatures& features)
      : features_(features),
        gain_(setup.control.gain),
        task_(desiredPoints(setup),
              setup.mobility == Mobility::full ? TaskFunction::all() : TaskFunction::planar()),
        s_(2 * features.size()) {}

  Velocities command(const ControlInput& now) override {
    for (std::size_t i = 0; i < features_.size(); ++i) {
      s_.segment<2>(static_cast<Eigen::Index>(2 * i)) << features_[i].get_x(), features_[i].get_y();
    }
    return task_.command(s_, cameraJacobian(now.robot), gain_);
  }

 private:
  const PointFeatures& features_;
  double gain_;
  TaskFunction task_;
  Eigen::VectorXd s_;  // the features
};

/// Given velocities, whatever the image shows; each row of odometry has those of its middle, also
/// when an image falls into it.
class ProfileLaw : public ControlLaw {
 public:
  explicit ProfileLaw(const LawSetup& setup)
      : profile_(setup.control.profile), row_s_(setup.rowPeriod_s) {}

  Velocities command(const ControlInput& now) override {
    constexpr double kSlack = 1e-6;  // times are rounded to nanoseconds
    const double row = std::floor(now.time_s / row_s_ + kSlack);
    return velocityAt(profile_, (row + 0.5) * row_s_, now.robot.velocityLimits().size());
  }
  std::optional<Velocities> between(const ControlInput& now) override { return command(now); }
  bool usesFeatures() const override { return false; }

 private:
  VelocityProfile profile_;
  double row_s_;
};

/// Steers by the pose of the target, predicted to each row of odometry (Ibuki et al. 2023).
class RegulationLaw : public ControlLaw {
 public:
  RegulationLaw(const LawSetup& setup, const PointSetEstimator& estimator)
      : regulation_(*setup.goal.cdMo, optionsOf(setup)),
        target_(dynamic_cast<const KnownTargetEstimator&>(estimator)) {}

  Velocities command(const ControlInput& now) override {
    const Twist twist = regulation_.command(target_.observer().cMo(now.odometry, now.time_s));
    const CameraJacobian J = cameraJacobian(now.robot);
    using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 8, 8>;
    const Normal JTJ = J.transpose().lazyProduct(J);
    return JTJ.ldlt().solve(J.transpose().lazyProduct(twist.vector()));
  }
  std::optional<Velocities> between(const ControlInput& now) override { return command(now); }

 private:
  static PoseRegulationOptions optionsOf(const LawSetup& setup) {
    PoseRegulationOptions options;
    options.kc = setup.control.kc;
    options.mobility = setup.mobility;
    return options;
  }

  PoseRegulation regulation_;
  const KnownTargetEstimator& target_;
};

std::unique_ptr<ControlLaw> makePlainLaw(const LawSetup& setup, PointFeatures& features,
                                         const PointSetEstimator& estimator) {
  switch (setup.control.law) {
    case Law::vpServo:
      if (setup.control.features == FeatureKind::moments) {
        return std::make_unique<MomentLaw>(setup, features);
      }
      return std::make_unique<PointLaw>(setup, features);
    case Law::task:
      try {
        return std::make_unique<TaskLaw>(setup, features);
      } catch (const std::invalid_argument& error) {
        throw InputError({setup.place, 0, "control.law"}, std::string("task: ") + error.what());
      }
    case Law::profile:
      return std::make_unique<ProfileLaw>(setup);
    case Law::regulation:
      return std::make_unique<RegulationLaw>(setup, estimator);
  }
  throw std::logic_error("no such law");
}

}  // namespace

const std::vector<detail::Choice<Law>>& lawWords() {
  static const std::vector<detail::Choice<Law>> all = {{Law::vpServo, "vpServo"},
                                                       {Law::task, "task"},
                                                       {Law::profile, "profile"},
                                                       {Law::regulation, "regulation"}};
  return all;
}

std::unique_ptr<ControlLaw> makeControlLaw(const LawSetup& setup, PointFeatures& features,
                                           const PointSetEstimator& estimator) {
  auto law = makePlainLaw(setup, features, estimator);
  if (!setup.control.excite) return law;
  return std::make_unique<ExcitingLaw>(std::move(law), setup, features);
}

}  // namespace depthservo
