#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/camera/PinholeCamera.h"
#include "depthservo/motion/OdometryRow.h"
#include "depthservo/motion/RpyPose.h"
#include "depthservo/sequence/ClockCheck.h"
#include "depthservo/sequence/DepthMap.h"
#include "depthservo/target/AprilTagTarget.h"
#include "depthservo/target/BoardTarget.h"
#include "depthservo/target/DotTarget.h"
#include "depthservo/target/TaughtImage.h"
#include "depthservo/text/InputError.h"
#include "depthservo/visp/GrayImage.h"

namespace depthservo {

namespace detail {
class ImageFile;
class ImageStore;
struct DataSet;
struct ImageSize;
struct YamlValue;
}  // namespace detail

/// A point in an image, by its id.
struct PixelPoint {
  int id = 0;
  double u = 0, v = 0;  ///< [px]
};

/// The true depth of a point.
struct TrueDepth {
  int id = 0;
  double Z = 0;  ///< [m]
};

/// One instant of a sequence.
struct SequenceFrame {
  double time_s = 0;
  std::string image;               ///< path; empty when there are no images
  std::vector<PixelPoint> tracks;  ///< points measured, by id; a point that is not here is hidden
  std::vector<TrueDepth> truth;    ///< by id
  std::string depthImage{};  ///< path of the depth image of this time; empty when there is none
};

/// Pose of the camera in the world.
struct CameraPose {
  double time_s = 0;
  Eigen::Isometry3d wMc = Eigen::Isometry3d::Identity();
};

/// An image and its time, as listed in rgb.txt and depth.txt.
struct ListedImage {
  double time_s = 0;
  std::string path;
};

/// Images and times of a table such as rgb.txt; paths relative to its folder. Throws InputError.
DEPTHSERVO_API std::vector<ListedImage> readImageList(const std::string& path);

/// The camera of a camera_info file, of the sensor.yaml of a EuRoC camera, or a preset: tum-fr1 |
/// tum-fr2 | tum-fr3 | icl. Throws InputError.
DEPTHSERVO_API PinholeCamera loadCamera(const std::string& fileOrPreset);

/// The constant twists that lead from pose to pose (logarithm of SE(3)); the last one is repeated
/// at the last pose. Empty for fewer than two poses. Times must increase.
DEPTHSERVO_API std::vector<OdometryRow> odometryFromPoses(const std::vector<CameraPose>& poses);

/// Time without poses, longer than ground truth usually leaves (see holesOf): how the camera moved
/// in it is not known, only where it went.
DEPTHSERVO_API std::vector<TimeSpan> gapsOf(const std::vector<CameraPose>& poses);

/// What a file says of how to observe depth ("replay" in sequence.yaml), as it was written: what it
/// means, observationOf knows.
struct ReplaySection {
  std::string file;                                ///< for messages
  std::shared_ptr<const detail::YamlValue> value;  ///< null: there is none
};

/// What is to be tracked, as sequence.yaml tells it.
struct SequenceTarget {
  DotTarget target;  ///< no points: not named; of tags and boards the corners, if sizes are given
  std::optional<AprilTagTarget> tags{};  ///< empty when the target is of another type
  std::vector<PixelPoint>
      dots{};  ///< start positions in the first image, ids 0, 1, ...; may be empty
  /// Natural corners by the image in which they were shown; null: none.
  std::shared_ptr<const TaughtImage> taught{};
  ReplaySection replay{};
  std::optional<RowMeaning> rows{};    ///< what the rows of odometry mean; none: nothing is said
  std::optional<BoardTarget> board{};  ///< empty when the target is of another type

  /// Points are corners, found by what is printed round them: not dots.
  bool hasCorners() const { return tags || board; }
};

/// `target`, `dots` and `replay` of a file with the keys of sequence.yaml. Throws InputError; so it
/// does when the file names neither.
DEPTHSERVO_API SequenceTarget readTarget(const std::string& path);

struct SequenceOptions {
  /// A camera_info file, the sensor.yaml of a EuRoC camera or one of tum-fr1 | tum-fr2 | tum-fr3 |
  /// icl, instead of camera.yaml.
  std::string camera;
  /// Images per second of a numbered image folder, or of numbered frames in associations.txt [Hz];
  /// 0: not given.
  double fps = 0;
  /// Of a bag: image=/camera/image_raw, camera_info=, odometry=, poses=; `=none` for none, `@FRAME`
  /// behind it where messages tell no frame. One that is not named must be the only one of its
  /// kind.
  std::vector<std::string> topics{};
  /// Pose of the camera (z forward) in the frame whose twists the rows of odometry are: they become
  /// those of the camera. None: rows are the camera's; of a bag: by its transforms.
  std::optional<RpyPose> cameraInBase{};
  /// File with `target`, `dots`, `rows` and `replay`, instead of those of sequence.yaml.
  std::string target{};
};

/// Whether it is a ROS bag: .bag, .mcap, .db3, or the folder of a ROS 2 recording.
DEPTHSERVO_API bool isBag(const std::string& path);

/// Recorded data: a folder in the layout of TUM RGB-D with our additions; one of ICL-NUIM
/// (associations.txt, *.gt.freiburg) or EuRoC (mav0/cam0, state_groundtruth_estimate0) as
/// downloaded; a ROS bag; or a folder of numbered images ("image.0001.pgm"; then `options` must
/// give the camera and the rate). doc/formats.md has the layouts.
///
/// With a negative fy (ICL-NUIM) the camera frame has y up, and poses and twists are told in that
/// left-handed frame: every relation between them, pixels and depths is the same as ever.
///
/// All files are checked by the constructor, images when they are read. Frames are the images;
/// without images every time in tracks.csv and truth.csv.
class DEPTHSERVO_API Sequence {
 public:
  /// \param folder or bag \throw InputError
  explicit Sequence(const std::string& folder, const SequenceOptions& options = {});

  const std::string& folder() const { return folder_; }  ///< or the bag
  const std::string& name() const { return name_; }
  /// Where target and start positions stand.
  const std::string& settingsFile() const { return settingsFile_; }
  const PinholeCamera& camera() const { return camera_; }
  const std::vector<SequenceFrame>& frames() const { return frames_; }
  const std::vector<OdometryRow>& odometry() const { return odometry_; }  ///< twist.csv
  const std::vector<CameraPose>& poses() const { return poses_; }         ///< groundtruth.txt
  const std::vector<ListedImage>& depthImages() const { return depthImages_; }
  double depthScale() const { return depthScale_; }  ///< gray levels per metre of depth images

  /// No points when the sequence does not name its target. Of AprilTags and boards the corners, if
  /// all sizes are given.
  const DotTarget& target() const { return target_; }
  /// The tags of the target; empty when it is of another type.
  const std::optional<AprilTagTarget>& tags() const { return tags_; }
  /// Where the dots are in the first image, in the order of the target's points; the index is the
  /// id.
  const std::vector<PixelPoint>& dots() const { return dots_; }

  /// What could tell the camera's motion and is not there, for messages.
  std::string motionSources() const;

  const ReplaySection& replaySection() const { return replay_; }

  /// All of these in one, and what was taught.
  SequenceTarget seen() const {
    return {target_, tags_, dots_, taught_, replay_, rowMeaning_, board_};
  }

  /// How the times of the images and those of the odometry, or of the poses when there is none, fit
  /// together; empty when there are neither. (That they do not overlap at all is refused.)
  const std::optional<ClockCheck>& clocks() const { return clocks_; }

  bool hasImages() const { return hasImages_; }

  /// What was ignored or assumed, one sentence each.
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// Gray image of a frame, colours converted (0.299 R + 0.587 G + 0.114 B). Throws InputError:
  /// missing, truncated, not an image, to be shown turned (EXIF), or of another size than the
  /// camera's. Of images with 16 bits the levels are stretched to white as their format says, or
  /// as `image_bits` says, or as many bits as some images of the sequence use.
  GrayImage readImage(std::size_t frame) const;

  /// Depth image of a frame; none when no depth image is close enough in time. Throws InputError:
  /// missing, damaged, not a 16-bit gray PNG, or of another size than the camera's.
  std::optional<DepthMap> readDepth(std::size_t frame) const;

 private:
  void readSettings(const std::string& path, const SequenceOptions& options);
  void readFolder(const SequenceOptions& options);
  void requireFolder(const SequenceOptions& options);
  detail::DataSet findImages(const SequenceOptions& options);
  void readRows(const SequenceOptions& options);
  void readPoses();
  void readBag(const SequenceOptions& options);
  void useTarget(SequenceTarget seen);
  void readTaught(const std::string& folder);
  void readCamera(const SequenceOptions& options, const std::optional<PinholeCamera>& known);
  void useImages(std::vector<ListedImage> images);
  void checkImages();
  detail::ImageFile imageFile(std::size_t frame) const;
  void requireSize(detail::ImageSize size, const std::string& image) const;
  void readTracks(const std::string& path);
  void readTruth(const std::string& path);
  void readOdometry(const std::string& path);
  void useDepth(std::vector<ListedImage> images, const std::string& source);
  void checkClocks();
  std::string inFolder(const std::string& file) const;

  std::string folder_, name_, settingsFile_;
  std::string cameraSource_;  // where the camera's size was read, for messages
  PinholeCamera camera_;
  std::vector<SequenceFrame> frames_;
  std::vector<OdometryRow> odometry_;
  std::optional<RowMeaning> rowMeaning_;
  std::vector<CameraPose> poses_;
  std::vector<ListedImage> depthImages_;
  double depthScale_ = 5000;
  DotTarget target_;
  std::optional<AprilTagTarget> tags_;
  std::optional<BoardTarget> board_;
  std::vector<PixelPoint> dots_;
  std::shared_ptr<const TaughtImage> taught_;
  ReplaySection replay_;
  std::shared_ptr<const detail::ImageStore> store_;  // of images in a bag; null: they are files
  bool hasImages_ = false;
  int imageBits_ = 0;  // used by images of 16; 0: not known
  std::optional<ClockCheck> clocks_;
  std::vector<std::string> warnings_;
};

}  // namespace depthservo
