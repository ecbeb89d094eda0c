#include "servo/ControlLaw.h"

#include <visp3/vs/vpServo.h>

#include <Eigen/Cholesky>
#include <stdexcept>

#include "depthservo/depth/PoseRegulation.h"
#include "depthservo/features/FeatureMoments.h"
#include "depthservo/features/TaskFunction.h"
#include "depthservo/tracking/KnownTargetEstimator.h"

#ifdef VISP_NAMESPACE_NAME
using namespace VISP_NAMESPACE_NAME;
#endif

namespace depthservo {
namespace {

vpServo::vpServoIteractionMatrixType interactionType(Scenario::Interaction interaction) {
  switch (interaction) {
    case Scenario::Interaction::current:
      return vpServo::CURRENT;
    case Scenario::Interaction::mean:
      return vpServo::MEAN;
    case Scenario::Interaction::desired:
      return vpServo::DESIRED;
  }
  return vpServo::CURRENT;
}

std::vector<PointState> desiredPoints(const Scenario& scenario, const ServoGoal& goal) {
  std::vector<PointState> points;
  for (std::size_t i = 0; i < goal.pixels.size(); ++i) {
    const Eigen::Vector2d s =
        scenario.camera.pinhole().normalise(goal.pixels[i].x(), goal.pixels[i].y());
    points.push_back({s.x(), s.y(), 1 / goal.Z[i]});
  }
  return points;
}

/// The velocities that vpServo computes.
Eigen::VectorXd computed(vpServo& task, const CameraRobot& robot) {
  task.set_cVe(robot.cVe());
  task.set_eJe(robot.eJe());
  const vpColVector qdot = task.computeControlLaw();
  return Eigen::Map<const Eigen::VectorXd>(qdot.data, qdot.getRows());
}

void setUp(vpServo& task, const Scenario::Control& control) {
  task.setServo(vpServo::EYEINHAND_L_cVe_eJe);
  task.setInteractionMatrixType(interactionType(control.interaction));
  task.setLambda(control.gain);
}

/// vpServo on the points.
class PointLaw : public ControlLaw {
 public:
  PointLaw(const Scenario& scenario, const ServoGoal& goal, FeaturePointGroup& features)
      : desired_(features.size()) {
    const std::vector<PointState> points = desiredPoints(scenario, goal);
    for (std::size_t i = 0; i < features.size(); ++i) {
      desired_[i].buildFrom(points[i].x, points[i].y, goal.Z[i]);
      task_.addFeature(features[i], desired_[i]);
    }
    setUp(task_, scenario.control);
  }

  Eigen::VectorXd command(const ControlInput& now) override { return computed(task_, now.robot); }

 private:
  std::vector<vpFeaturePoint> desired_;
  vpServo task_;  // after the desired features: its destructor asks them who deallocates them
};

/// vpServo on the moments of all points.
class MomentLaw : public ControlLaw {
 public:
  MomentLaw(const Scenario& scenario, const ServoGoal& goal, const FeaturePointGroup& points)
      : points_(points),
        moments_(
            FeatureMoments::scaleFor(desiredPoints(scenario, goal), scenario.control.size_weight)),
        desired_(moments_) {
    desired_.buildFrom(desiredPoints(scenario, goal));
    task_.addFeature(moments_, desired_);
    setUp(task_, scenario.control);
  }

  Eigen::VectorXd command(const ControlInput& now) override {
    moments_.update(points_);
    return computed(task_, now.robot);
  }

 private:
  const FeaturePointGroup& points_;
  FeatureMoments moments_, desired_;
  vpServo task_;  // after the features
};

/// The task function: only depths at the goal enter.
class TaskLaw : public ControlLaw {
 public:
  TaskLaw(const Scenario& scenario, const ServoGoal& goal, const FeaturePointGroup& features)
      : features_(features),
        gain_(scenario.control.gain),
        task_(desiredPoints(scenario, goal), scenario.robot.type == RobotKind::free
                                                 ? TaskFunction::all()
                                                 : TaskFunction::planar()) {}

  Eigen::VectorXd command(const ControlInput& now) override {
    Eigen::VectorXd s(2 * features_.size());
    for (std::size_t i = 0; i < features_.size(); ++i) {
      s.segment<2>(static_cast<Eigen::Index>(2 * i)) << features_[i].get_x(), features_[i].get_y();
    }
    const vpMatrix J = vpMatrix(now.robot.cVe()) * now.robot.eJe();
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    return task_.command(s, Eigen::Map<const RowMajor>(J.data, J.getRows(), J.getCols()), gain_);
  }

 private:
  const FeaturePointGroup& features_;
  double gain_;
  TaskFunction task_;
};

/// Given velocities, whatever the image shows; each row of odometry has those of its middle.
class ProfileLaw : public ControlLaw {
 public:
  explicit ProfileLaw(const Scenario& scenario)
      : profile_(scenario.control.profile), halfRow_s_(0.5 / scenario.odometry.rate) {}

  Eigen::VectorXd command(const ControlInput& now) override {
    return velocityAt(profile_, now.time_s + halfRow_s_, now.robot.velocity().size());
  }
  std::optional<Eigen::VectorXd> between(const ControlInput& now) override { return command(now); }
  bool usesFeatures() const override { return false; }

 private:
  VelocityProfile profile_;
  double halfRow_s_;
};

/// Steers by the pose of the target, predicted to each row of odometry (Ibuki et al. 2023).
class RegulationLaw : public ControlLaw {
 public:
  RegulationLaw(const Scenario& scenario, const Eigen::Isometry3d& cdMo,
                const FeaturePointGroup& features)
      : regulation_(cdMo, optionsOf(scenario)),
        target_(dynamic_cast<const KnownTargetEstimator&>(features.estimator())) {}

  Eigen::VectorXd command(const ControlInput& now) override {
    const Twist twist = regulation_.command(target_.observer().cMo(now.odometry, now.time_s));
    Vector6d v;
    v << twist.linear, twist.angular;
    const vpMatrix cVe_eJe = vpMatrix(now.robot.cVe()) * now.robot.eJe();
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const RowMajor> J(cVe_eJe.data, cVe_eJe.getRows(), cVe_eJe.getCols());
    return (J.transpose() * J).ldlt().solve(J.transpose() * v);
  }
  std::optional<Eigen::VectorXd> between(const ControlInput& now) override { return command(now); }

 private:
  static PoseRegulationOptions optionsOf(const Scenario& scenario) {
    PoseRegulationOptions options;
    options.kc = scenario.control.kc;
    if (scenario.robot.type != RobotKind::free) options.mobility = Mobility::planar;
    return options;
  }

  PoseRegulation regulation_;
  const KnownTargetEstimator& target_;
};

}  // namespace

std::unique_ptr<ControlLaw> makeControlLaw(const Scenario& scenario, const ServoGoal& goal,
                                           FeaturePointGroup& features) {
  switch (scenario.control.law) {
    case Law::vpServo:
      if (scenario.control.features == FeatureKind::moments) {
        return std::make_unique<MomentLaw>(scenario, goal, features);
      }
      return std::make_unique<PointLaw>(scenario, goal, features);
    case Law::task:
      try {
        return std::make_unique<TaskLaw>(scenario, goal, features);
      } catch (const std::invalid_argument& error) {
        throw InputError({scenario.file, 0, "control.law"}, std::string("task: ") + error.what());
      }
    case Law::profile:
      return std::make_unique<ProfileLaw>(scenario);
    case Law::regulation:
      return std::make_unique<RegulationLaw>(scenario, *goal.cdMo, features);
  }
  throw std::logic_error("no such law");
}

}  // namespace depthservo
