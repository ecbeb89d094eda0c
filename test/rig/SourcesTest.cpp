#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "depthservo/report/Metrics.h"
#include "depthservo/rig/RecordedRig.h"
#include "depthservo/scenario/run.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/simulation/SyntheticCamera.h"
#include "depthservo/visp/using.h"
#include "support/TemporaryFolder.h"

namespace depthservo {
namespace {

using test::TemporaryFolder;

const PinholeCamera kCamera{640, 480, 600, 600, 319.5, 239.5};
constexpr double kRate = 30;

/// A recording of a scene by a camera that moves with a constant twist. \param prepare changes the
/// view of image k
template <class Prepare>
Sequence recorded(const std::string& folder, const SyntheticCamera& scene, int frames,
                  const Eigen::Isometry3d& cMo, const Twist& twist, SequenceSettings settings,
                  const Prepare& prepare) {
  auto& camera = const_cast<SyntheticCamera&>(scene);
  SequenceWriter writer(folder);
  vpImage<unsigned char> image;
  for (int k = 0; k < frames; ++k) {
    const double time_s = fileTime(k / kRate);
    const Motion motion = Motion::fromTwist(twist, time_s);
    SyntheticView view;
    view.cMo.linear() = motion.R * cMo.linear();
    view.cMo.translation() = motion.R * cMo.translation() + motion.t;
    view.frame = static_cast<std::uint64_t>(k);
    prepare(k, view);
    camera.render(view, image);
    writer.addImage(time_s, image);
    writer.addOdometry(time_s, twist);
  }
  settings.camera = kCamera;
  writer.finish(settings);
  return Sequence(folder);
}

Eigen::Isometry3d at(double x, double y, double z, const Eigen::Vector3d& r = {0, 0, 0}) {
  Eigen::Isometry3d M = Eigen::Isometry3d::Identity();
  if (r.norm() > 0) M.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).matrix();
  M.translation() = Eigen::Vector3d(x, y, z);
  return M;
}

ObservationOptions with(TrackerKind tracker) {
  ObservationOptions options;
  options.tracker = tracker;
  options.odometryNoise = OdometryNoise::none();
  options.depth.initial = 2;
  return options;
}

// AprilTags -------------------------------------------------------------------------------------

constexpr double kTagSize = 0.16;
const Twist kTagTwist{{0.06, 0.03, 0.05}, {0.01, -0.03, 0.02}};
const Eigen::Isometry3d kTagPose = at(-0.02, 0.01, 1, {0.3, 0.2, 0.1});
constexpr int kTagFrames = 75;

AprilTagTarget tag(std::optional<double> size) {
  return {"36h11", {{9, size, Eigen::Isometry3d::Identity()}}};
}

/// Depth of a corner in image k, from the motion.
double trueDepth(int corner, double time_s) {
  const Motion motion = Motion::fromTwist(kTagTwist, time_s);
  const Eigen::Vector3d P = tag(kTagSize).corners()[static_cast<std::size_t>(corner)];
  return (motion.R * (kTagPose * P) + motion.t).z();
}

template <class Prepare>
RunLog replayedTag(std::optional<double> believedSize, const Prepare& prepare,
                   ObservationOptions options = with(TrackerKind::automatic)) {
  const TemporaryFolder folder;
  SyntheticCameraOptions noise;
  noise.gray_noise = 3;
  const SyntheticCamera scene(kCamera, tag(kTagSize).patches(), noise);
  SequenceSettings settings;
  settings.tags = tag(believedSize);
  return replay(recorded(folder / "tag", scene, kTagFrames, kTagPose, kTagTwist, settings, prepare),
                options);
}
RunLog replayedTag(std::optional<double> believedSize) {
  return replayedTag(believedSize, [](int, SyntheticView&) {});
}

TEST(AprilTagReplay, depth_of_a_tag_of_unknown_size_is_observed_and_with_it_its_size) {
  const RunLog log = replayedTag(std::nullopt);
  std::size_t judged = 0, within = 0;
  for (const FrameRecord& frame : log.frames) {
    ASSERT_EQ(frame.features.size(), 4u);
    for (const FeatureRecord& f : frame.features) {
      EXPECT_TRUE(std::isnan(f.Z_true));
      const double chi = 1 / trueDepth(f.id, frame.time_s);
      ++judged;
      within += std::abs(f.estimate.chi - chi) <= 2 * f.estimate.sigma_chi;
    }
  }
  for (const FeatureRecord& f : log.frames.back().features) {
    EXPECT_EQ(f.estimate.status, DepthStatus::valid);
    const double Z = trueDepth(f.id, log.frames.back().time_s);
    EXPECT_NEAR(f.estimate.Z(), Z, 0.005 * Z);
    EXPECT_LT(f.estimate.sigma_Z(), 0.005 * Z);
    EXPECT_LT(std::abs(f.estimate.Z() - Z), 3.5 * f.estimate.sigma_Z());
  }
  // Four errors that live on for many images: 95 % are not expected of one run, most of them are.
  EXPECT_GT(within, judged * 8 / 10);
  ASSERT_EQ(log.tags.size(), 1u);
  EXPECT_EQ(log.tags[0].id, 9);
  EXPECT_NEAR(log.tags[0].observed_size, kTagSize, 0.005 * kTagSize);
  EXPECT_LT(std::abs(log.tags[0].observed_size - kTagSize), 3 * log.tags[0].sigma);
  EXPECT_FALSE(log.tags[0].disagrees);
  EXPECT_TRUE(log.events.empty());
}

TEST(AprilTagReplay, the_pose_of_a_tag_of_known_size_is_the_reference) {
  const RunLog log = replayedTag(kTagSize);
  for (const FrameRecord& frame : log.frames) {
    for (const FeatureRecord& f : frame.features) {
      EXPECT_NEAR(f.Z_true, trueDepth(f.id, frame.time_s), 0.01);
    }
  }
  EXPECT_FALSE(log.tags[0].disagrees);
  EXPECT_LT(computeMetrics(log).final_depth_error_max, 0.01);
}

class WrongTagSize : public testing::TestWithParam<double> {};

TEST_P(WrongTagSize, of_ten_percent_is_said) {
  const RunLog log = replayedTag(GetParam() * kTagSize);
  ASSERT_EQ(log.tags.size(), 1u);
  EXPECT_TRUE(log.tags[0].disagrees);
  ASSERT_EQ(log.events.size(), 1u);
  EXPECT_NE(log.events[0].what.find("tag 9"), std::string::npos);
  EXPECT_NE(log.events[0].what.find("0.16"), std::string::npos) << log.events[0].what;
  const auto json = nlohmann::json::parse(toJson(log));
  EXPECT_TRUE(json["tags"][0]["disagrees"].get<bool>());
}
INSTANTIATE_TEST_SUITE_P(Sizes, WrongTagSize, testing::Values(0.9, 1.1));

TEST(AprilTagReplay, a_tag_hidden_for_a_second_coasts_and_is_found_again) {
  const auto hide = [](int k, SyntheticView& view) {
    if (k >= 30 && k < 60) view.occluders.push_back({0, 0, 640, 480, 100});
  };
  const RunLog log = replayedTag(std::nullopt, hide);
  for (std::size_t k = 0; k < log.frames.size(); ++k) {
    ASSERT_EQ(log.frames[k].features.size(), 4u);
    for (const FeatureRecord& f : log.frames[k].features) {
      EXPECT_EQ(f.measured, k < 30 || k >= 60) << k;
      if (!f.measured) {
        EXPECT_EQ(f.estimate.status, DepthStatus::coasting);
      }
    }
  }
  for (const FeatureRecord& f : log.frames.back().features) {
    const double Z = trueDepth(f.id, log.frames.back().time_s);
    EXPECT_NEAR(f.estimate.Z(), Z, 0.01 * Z);
  }
}

TEST(AprilTagReplay, tags_nobody_named_are_found_by_their_family) {
  const TemporaryFolder folder;
  const SyntheticCamera scene(kCamera, tag(kTagSize).patches());
  const Sequence sequence =
      recorded(folder / "tag", scene, 40, kTagPose, kTagTwist, {}, [](int, SyntheticView&) {});
  const RunLog log = replay(sequence, with(TrackerKind::apriltag));
  ASSERT_EQ(log.frames.back().features.size(), 4u);
  for (int j = 0; j < 4; ++j) {
    EXPECT_EQ(log.frames.back().features[static_cast<std::size_t>(j)].id, 4 * 9 + j);
  }
  ASSERT_EQ(log.tags.size(), 1u);
  EXPECT_EQ(log.tags[0].id, 9);
  EXPECT_NEAR(log.tags[0].observed_size, kTagSize, 0.02 * kTagSize);
}

// Natural corners -------------------------------------------------------------------------------

struct Room {
  std::vector<GrayPatch> patches;
  Room() {
    GrayPatch back = GrayPatch::random(4, 3, 130, 100, 1),
              side = GrayPatch::random(3, 3, 90, 100, 2),
              box = GrayPatch::random(0.35, 0.25, 22, 16, 3);
    back.oMp = at(0.1, 0, 1.4, {0.1, 0.25, 0});
    side.oMp = at(-0.7, 0, 1.2, {0, 1, 0});
    box.oMp = at(0.15, 0.08, 0.8, {0.1, -0.2, 0.3});
    patches = {back, side, box};
  }
};

const Twist kSideways{{0.05, 0, 0}, {0, 0, 0}};  // 5 cm/s

/// Relative depth errors of the valid points of the last image.
std::vector<double> finalErrors(const RunLog& log, const SyntheticCamera& scene,
                                const SyntheticView& view) {
  std::vector<double> errors;
  for (const FeatureRecord& f : log.frames.back().features) {
    const auto Z = scene.depthAt(view, f.u, f.v);
    if (!Z || !f.measured || f.estimate.status != DepthStatus::valid) continue;
    errors.push_back(std::abs(f.estimate.Z() - *Z) / *Z);
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

SyntheticView viewAt(const Twist& twist, double time_s) {
  const Motion motion = Motion::fromTwist(twist, time_s);
  SyntheticView view;
  view.cMo.linear() = motion.R;
  view.cMo.translation() = motion.t;
  return view;
}

TEST(KltReplay, the_median_depth_error_is_below_one_percent_after_two_seconds_at_5_cm_s) {
  for (const Twist& twist : {kSideways, Twist{{0.03, 0.02, 0.035}, {0, 0.02, 0.01}}}) {
    const TemporaryFolder folder;
    SyntheticCameraOptions noise;
    noise.gray_noise = 2;
    const SyntheticCamera scene(kCamera, Room().patches, noise);
    const Sequence sequence = recorded(folder / "room", scene, 61, Eigen::Isometry3d::Identity(),
                                       twist, {}, [](int, SyntheticView&) {});
    const RunLog log = replay(sequence, with(TrackerKind::klt));
    const auto errors = finalErrors(log, scene, viewAt(twist, log.frames.back().time_s));
    ASSERT_GE(errors.size(), 150u);
    EXPECT_LT(errors[errors.size() / 2], 0.01);
    EXPECT_LT(errors[errors.size() * 9 / 10], 0.05);
  }
}

TEST(KltReplay, what_moves_by_itself_ends_up_flagged_and_not_averaged_in) {
  const TemporaryFolder folder;
  std::vector<GrayPatch> patches = Room().patches;
  const std::size_t mover = patches.size() - 1;
  SyntheticCameraOptions noise;
  noise.gray_noise = 2;
  const SyntheticCamera scene(kCamera, patches, noise);
  const auto poseOfMover = [&](double time_s) {  // 5 cm/s upwards
    Eigen::Isometry3d oMp = patches[mover].oMp;
    oMp.translation().y() -= 0.05 * time_s;
    return oMp;
  };
  const auto move = [&](double time_s, SyntheticView& view) {
    for (const GrayPatch& patch : patches) view.patchPoses.push_back(patch.oMp);
    view.patchPoses[mover] = poseOfMover(time_s);
  };
  const Sequence sequence =
      recorded(folder / "room", scene, 61, Eigen::Isometry3d::Identity(), kSideways, {},
               [&](int k, SyntheticView& view) { move(k / kRate, view); });
  const RunLog log = replay(sequence, with(TrackerKind::klt));

  // Points by what they were on when they were first seen, well inside it.
  const auto isOnMover = [&](const SyntheticView& view, const FeatureRecord& f) {
    const auto Z = scene.depthAt(view, f.u, f.v);
    const Eigen::Vector2d s = kCamera.normalise(f.u, f.v);
    const Eigen::Vector3d p = (view.cMo * view.patchPoses[mover]).inverse() *
                              (Eigen::Vector3d(s.x(), s.y(), 1) * Z.value_or(0));
    return Z && std::abs(p.z()) < 1e-6 && std::abs(p.x()) < 0.155 && std::abs(p.y()) < 0.105;
  };
  std::set<int> known, moving;
  std::map<int, FeatureRecord> last;
  std::map<int, std::size_t> age;
  for (const FrameRecord& frame : log.frames) {
    SyntheticView view = viewAt(kSideways, frame.time_s);
    move(frame.time_s, view);
    for (const FeatureRecord& f : frame.features) {
      if (known.insert(f.id).second && isOnMover(view, f)) moving.insert(f.id);
      last[f.id] = f;
      ++age[f.id];
    }
  }
  std::size_t flagged = 0, judged = 0;
  for (const int id : moving) {
    if (age[id] < 10) continue;  // has not been there for long
    ++judged;
    const DepthStatus status = last[id].estimate.status;
    EXPECT_NE(status, DepthStatus::valid) << id;
    flagged += status == DepthStatus::rejected || status == DepthStatus::lost;
  }
  ASSERT_GE(judged, 8u);
  EXPECT_GE(flagged, judged * 8 / 10);
  const Metrics metrics = computeMetrics(log);
  EXPECT_GE(metrics.rejected_points + metrics.points_gone(), flagged);
  EXPECT_GT(metrics.rejected_measurements, 5 * flagged);

  // And the still ones are no worse for it.
  SyntheticView end = viewAt(kSideways, log.frames.back().time_s);
  move(log.frames.back().time_s, end);
  const auto errors = finalErrors(log, scene, end);
  ASSERT_GE(errors.size(), 120u);
  EXPECT_LT(errors[errors.size() / 2], 0.01);
}

// Scenario --------------------------------------------------------------------------------------

TEST(AprilTagScenario, drives_a_unicycle_to_a_tag_of_unknown_size) {
  const std::string file = DEPTHSERVO_DATA "/scenarios/unicycle-apriltag.yaml";
  const RunLog log = run(Scenario::load(file));
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  EXPECT_LT(computeMetrics(log).final_depth_error_max, 0.01);
  ASSERT_EQ(log.tags.size(), 1u);
  EXPECT_TRUE(std::isnan(log.tags[0].size));
  EXPECT_NEAR(log.tags[0].observed_size, 0.2, 0.002);
}

TEST(AprilTagScenario, its_effective_configuration_is_a_scenario_again) {
  const TemporaryFolder folder;
  const std::string file = DEPTHSERVO_DATA "/scenarios/unicycle-apriltag.yaml";
  const Scenario scenario = Scenario::load(file, {"target.tags=[{id: 1, size: 0.1, pose: {xyz: "
                                                  "[0.01, 0, 0]}}, {id: 2, size: 0.2}]"});
  folder.write("again.yaml", scenario.toJson());
  EXPECT_EQ(Scenario::load(folder / "again.yaml").toJson(), scenario.toJson());
}

TEST(AprilTagScenario, a_tag_hidden_for_a_second_does_not_stop_the_robot) {
  const std::string file = DEPTHSERVO_DATA "/scenarios/unicycle-apriltag.yaml";
  const Scenario scenario = Scenario::load(file, {"sensing.hidden=[[4, 5]]"});
  const RunLog log = run(scenario);
  EXPECT_EQ(log.outcome, Outcome::converged) << log.reason;
  EXPECT_NEAR(computeMetrics(log).max_gap_s, 1, 0.1);
}

struct BadTag {
  const char* name;
  const char* override;
  const char* message;
};
class BadTagScenario : public testing::TestWithParam<BadTag> {};

TEST_P(BadTagScenario, is_refused_with_the_reason) {
  const std::string file = DEPTHSERVO_DATA "/scenarios/unicycle-apriltag.yaml";
  try {
    Scenario::load(file, {GetParam().override});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().message), std::string::npos)
        << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Scenarios, BadTagScenario,
    testing::Values(BadTag{"family", "target.family=36h12", "36h11"},
                    BadTag{"id", "target.tags=[{id: 587, size: 0.1}]", "0 to 586"},
                    BadTag{"twice", "target.tags=[{id: 1, size: 0.1}, {id: 1, size: 0.1}]",
                           "twice"},
                    BadTag{"none", "target.tags=[]", "1 to 16 tags"},
                    BadTag{"size", "target.tags=[{id: 1, size: 0}]", "size"},
                    BadTag{"points", "target.points=[[0, 0, 0]]", "corners"},
                    BadTag{"tracker", "sensing.tracker=dots", "apriltag"},
                    BadTag{"inverted", "sensing.light_on_dark=true", "dark on light"},
                    BadTag{"pose", "depth.estimator=pose", "assumed_size"},
                    BadTag{"dots", "target.type=dots", "points"}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace depthservo
