#include "depthservo/sequence/Sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "depthservo/motion/Motion.h"
#include "depthservo/text/didYouMean.h"
#include "sequence/FrameTable.h"
#include "sequence/ImageFile.h"
#include "sequence/ImageFolder.h"
#include "sequence/ImageStore.h"
#include "sequence/associate.h"
#include "sequence/cameraFiles.h"
#include "sequence/dataSets.h"
#include "sequence/frameFolder.h"
#include "sequence/sequenceSettings.h"
#include "text/StrictYaml.h"
#include "text/TextTable.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using detail::Range;
using detail::StrictMapping;
using detail::TextTable;

constexpr Range kPixels{-1e6, 1e6};              // px
constexpr Range kDepths = Range::above(0, 1e6);  // m
constexpr Range kSpeeds{-1e3, 1e3};              // m/s or rad/s
constexpr Range kRates = Range::above(0, 1e5);   // Hz

bool exists(const std::string& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

/// Times of images, rows or poses.
template <class Timed>
std::vector<double> timesOf(const std::vector<Timed>& list) {
  std::vector<double> times;
  for (const Timed& timed : list) times.push_back(timed.time_s);
  return times;
}

}  // namespace

std::vector<ListedImage> readImageList(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  std::vector<ListedImage> images;
  TextTable table(path, TextTable::Style::spaces, {"timestamp", "path"});
  while (table.next()) {
    images.push_back({table.time(), (folder / std::string(table.text(1))).string()});
  }
  return images;
}

PinholeCamera loadCamera(const std::string& fileOrPreset) {
  if (const auto preset = detail::cameraPreset(fileOrPreset)) return *preset;
  if (!exists(fileOrPreset)) {
    throw InputError({fileOrPreset, 0, ""},
                     "there is no such file and no such preset; the nearest preset is " +
                         nearestWord(fileOrPreset, detail::cameraPresetNames()));
  }
  return detail::readCamera(fileOrPreset).camera;
}

std::vector<OdometryRow> odometryFromPoses(const std::vector<CameraPose>& poses) {
  std::vector<OdometryRow> rows;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Motion motion =
        Motion::fromPoses(poses[i - 1].wMc, poses[i].wMc, poses[i].time_s - poses[i - 1].time_s);
    rows.push_back({poses[i - 1].time_s, motion.twist()});
  }
  if (!rows.empty()) rows.push_back({poses.back().time_s, rows.back().twist});
  return rows;
}

std::vector<TimeSpan> gapsOf(const std::vector<CameraPose>& poses) {
  return holesOf(timesOf(poses));
}

Sequence::Sequence(const std::string& folder, const SequenceOptions& options)
    : folder_(folder),
      settingsFile_(options.target.empty() ? inFolder("sequence.yaml") : options.target) {
  if (isBag(folder)) {
    readBag(options);
  } else {
    readFolder(options);
  }
  checkClocks();
}

void Sequence::readFolder(const SequenceOptions& options) {
  requireFolder(options);
  const std::string settings = inFolder("sequence.yaml"), tracks = inFolder("tracks.csv"),
                    truth = inFolder("truth.csv"), depth = inFolder("depth.txt");
  if (detail::isFrameFolder(folder_)) depthScale_ = detail::kFrameFolderScale;
  if (exists(settings)) readSettings(settings, options);
  if (!options.target.empty()) useTarget(readTarget(options.target));
  detail::DataSet set = findImages(options);
  warnings_ = set.warnings;
  readCamera(options, set.camera);
  if (hasImages_) checkImages();
  if (exists(tracks)) readTracks(tracks);
  if (exists(truth)) readTruth(truth);
  if (!set.depthImages.empty()) {
    useDepth(std::move(set.depthImages), inFolder("associations.txt"));
  } else if (exists(depth)) {
    useDepth(readImageList(depth), depth);
  }
  readRows(options);
  poses_ = std::move(set.poses);
  readPoses();
}

void Sequence::requireFolder(const SequenceOptions& options) {
  std::error_code error;
  if (!fs::is_directory(folder_, error)) {
    throw InputError({folder_, 0, ""},
                     exists(folder_) ? "is neither a folder nor a bag"
                                     : "there is no such folder or bag" + didYouMeanFile(folder_));
  }
  if (options.fps != 0 && !kRates.contains(options.fps)) {
    throw InputError({folder_, 0, "--fps"},
                     detail::expectedNumber(kRates, "Hz", fmt::format("{}", options.fps)));
  }
  if (!options.topics.empty()) {
    throw InputError({folder_, 0, "--topics"}, "is for bags; this is a folder");
  }
  fs::path normal = fs::absolute(folder_).lexically_normal();
  if (!normal.has_filename()) normal = normal.parent_path();
  name_ = normal.filename().string();
}

/// The images, by whichever layout the folder has, with what a data set says besides.
detail::DataSet Sequence::findImages(const SequenceOptions& options) {
  const std::string listName = exists(inFolder("rgb.txt")) ? "rgb.txt" : "images.txt",
                    list = inFolder(listName);
  detail::DataSet set;
  if (exists(list)) {
    if (hasImages_) {
      throw InputError({inFolder("sequence.yaml"), 0, "images"},
                       fmt::format("the folder has {} as well; remove one", listName));
    }
    if (options.fps > 0) {
      throw InputError({list, 0, "--fps"},
                       "is for folders of numbered images; " + listName + " has times");
    }
    set.images = readImageList(list);
  } else if (hasImages_) {
    return set;
  } else if (const auto mav0 = detail::eurocFolder(folder_)) {
    if (options.fps > 0) {
      throw InputError({*mav0, 0, "--fps"}, "is for folders of numbered images; cam0 has times");
    }
    set = detail::readEuroc(*mav0);
  } else if (detail::isAssociated(folder_)) {
    set = detail::readAssociated(folder_, options.fps);
  } else if (detail::isFrameFolder(folder_)) {
    set = detail::readFrameFolder(folder_, options.fps);
  } else if (exists(inFolder("tracks.csv"))) {
    return set;
  } else {
    useImages(detail::plainImageFolder(folder_, options.fps));
    return set;
  }
  useImages(set.images);
  return set;
}

/// twist.csv.
void Sequence::readRows(const SequenceOptions& options) {
  if (exists(inFolder("twist.csv"))) readOdometry(inFolder("twist.csv"));
  if (!options.cameraInBase) return;
  if (odometry_.empty()) {
    throw InputError({folder_, 0, "--camera-in-base"},
                     "is for rows of a base's twists, and there is no twist.csv");
  }
  const Eigen::Isometry3d bMc = options.cameraInBase->isometry();
  for (OdometryRow& row : odometry_) row.twist = twistOfCamera(bMc, row.twist);
}

/// Where the images have brought none: groundtruth.txt or poses.txt.
void Sequence::readPoses() {
  const std::string truth = inFolder("groundtruth.txt"), settings = inFolder("sequence.yaml");
  if (poses_.empty() && exists(truth)) {
    const bool isDownloaded = !exists(inFolder("camera.yaml"));
    poses_ = detail::readPoses(
        truth, isDownloaded ? detail::UnusablePoses::skip : detail::UnusablePoses::refuse, 1,
        warnings_);
  } else if (poses_.empty() && exists(inFolder("poses.txt"))) {
    poses_ = detail::readPoseMatrices(inFolder("poses.txt"), frames_);
  }
  if (!exists(settings)) return;
  const Eigen::Isometry3d handFromCamera = detail::handEyeIn(settings);
  for (CameraPose& pose : poses_) pose.wMc = pose.wMc * handFromCamera;
}

void Sequence::checkClocks() {
  const bool hasTwists = !odometry_.empty();
  if (!hasTwists && poses_.size() < 2) return;
  clocks_ = describeClocks(timesOf(frames_), hasTwists ? timesOf(odometry_) : timesOf(poses_),
                           hasTwists ? "odometry" : "ground truth");
  if (clocks_->overlaps) {
    warnings_.insert(warnings_.end(), clocks_->findings.begin(), clocks_->findings.end());
    return;
  }
  throw InputError({hasTwists && !store_ ? inFolder("twist.csv") : folder_, 0, "timestamp"},
                   clocks_->findings.back());
}

std::string Sequence::inFolder(const std::string& file) const {
  return (fs::path(folder_) / file).string();
}

void Sequence::readSettings(const std::string& path, const SequenceOptions& options) {
  const detail::YamlValue root = detail::loadYaml(path);
  const StrictMapping settings(root, path, "", detail::settingsKeys());
  if (settings.has("name")) name_ = settings.text("name");
  if (settings.has("depth_scale")) {
    depthScale_ = settings.number("depth_scale", Range::above(0, 1e6), "1/m");
  }
  if (settings.has("image_bits")) {
    imageBits_ = static_cast<int>(settings.integer("image_bits", {8, 16}, ""));
  }
  useTarget(detail::targetOf(settings));
  if (settings.has("taught")) readTaught(settings.text("taught"));
  if (settings.has("images")) {
    const StrictMapping images = settings.mapping("images", {"folder", "pattern", "rate"});
    const std::string name = images.text("folder"), pattern = images.text("pattern");
    const double rate = options.fps > 0 ? options.fps : images.number("rate", kRates, "Hz");
    const auto numbered = detail::NumberedName::parse(pattern);
    if (!numbered) images.fail("pattern", "expected a file name with one %d or %04d");
    const std::string found = detail::findImageFolder(name, folder_);
    if (found.empty()) {
      images.fail("folder", fmt::format("there is no folder {} in the sequence's folder, below "
                                        "VISP_INPUT_IMAGE_PATH or among ViSP's images; install "
                                        "visp-images-data",
                                        detail::quoted(name)));
    }
    useImages(
        detail::numberedSeries(found, *numbered, rate,
                               InputError({path, images.value("pattern").line, "images.pattern"},
                                          fmt::format("no file like {} in {}", pattern, found))));
  }
}

void Sequence::useTarget(SequenceTarget seen) {
  target_ = std::move(seen.target);
  tags_ = std::move(seen.tags);
  board_ = std::move(seen.board);
  dots_ = std::move(seen.dots);
  replay_ = std::move(seen.replay);
  if (seen.rows) rowMeaning_ = seen.rows;
}

void Sequence::useImages(std::vector<ListedImage> images) {
  hasImages_ = true;
  for (auto& image : images) frames_.push_back({image.time_s, std::move(image.path), {}, {}});
}

void Sequence::readCamera(const SequenceOptions& options,
                          const std::optional<PinholeCamera>& known) {
  cameraSource_ = options.camera.empty() ? inFolder("camera.yaml") : options.camera;
  if (options.camera.empty() && known) {
    camera_ = *known;
    cameraSource_ = inFolder("mav0/cam0/sensor.yaml");
  } else if (options.camera.empty() && !exists(cameraSource_)) {
    throw InputError({cameraSource_, 0, ""},
                     "missing; give --camera FILE|tum-fr1|tum-fr2|tum-fr3|icl");
  } else {
    camera_ = loadCamera(cameraSource_);
  }
}

void Sequence::readTaught(const std::string& folder) {
  const Sequence shown(inFolder(folder));
  if (shown.frames().size() != 1 || !shown.hasImages()) {
    throw InputError({shown.folder(), 0, ""},
                     "expected a sequence of one image, as teach writes it");
  }
  auto taught = std::make_shared<TaughtImage>();
  taught->image = shown.readImage(0);
  for (const PixelPoint& point : shown.frames()[0].tracks) {
    if (point.id != static_cast<int>(taught->points.size())) {
      throw InputError({shown.folder() + "/tracks.csv", 0, "id"}, "expected 0, 1, ...");
    }
    taught->points.emplace_back(point.u, point.v);
  }
  taught_ = std::move(taught);
}

/// A first image that cannot be read matters only to those who read images.
void Sequence::checkImages() {
  try {
    requireSize(imageFile(0).size(), frames_[0].image);
  } catch (const InputError& error) {
    if (error.file() == cameraSource_) throw;
    return;
  }
  if (imageBits_ > 0) return;
  imageBits_ = detail::usedBits(frames_.size(), [&](std::size_t i) { return imageFile(i); });
  if (imageBits_ > 0 && imageBits_ < 16) {
    warnings_.push_back(
        fmt::format("{}: has 16 bits, of which {} are used (nothing but black, taken as they are): "
                    "{} is white; "
                    "with image_bits: 16 in sequence.yaml it is 65535",
                    frames_[0].image, imageBits_, (1 << imageBits_) - 1));
  }
}

void Sequence::requireSize(detail::ImageSize size, const std::string& image) const {
  if (size.width == camera_.width && size.height == camera_.height) return;
  throw InputError({cameraSource_, 0, ""},
                   fmt::format("the camera has {}x{} pixels, the image {} has {}x{}", camera_.width,
                               camera_.height, image, size.width, size.height));
}

detail::ImageFile Sequence::imageFile(std::size_t frame) const {
  return store_ ? store_->image(frame, frames_[frame].image)
                : detail::ImageFile(frames_[frame].image);
}

GrayImage Sequence::readImage(std::size_t frame) const {
  const std::string& path = frames_[frame].image;
  const detail::ImageFile file = imageFile(frame);
  requireSize(file.size(), path);
  if (file.isWhiteUnknown() && imageBits_ == 0) {
    throw InputError({path, 0, ""},
                     "has 16 bits, the first image has 8 or cannot be read; say in sequence.yaml "
                     "how many bits 16-bit images use: image_bits: 16");
  }
  return file.gray(imageBits_);
}

std::optional<DepthMap> Sequence::readDepth(std::size_t frame) const {
  const std::string& path = frames_[frame].depthImage;
  if (path.empty()) return std::nullopt;
  DepthMap map(path, depthScale_);
  if (map.width() != camera_.width || map.height() != camera_.height) {
    throw InputError({path, 0, ""},
                     fmt::format("has {}x{} pixels, the camera has {}x{}", map.width(),
                                 map.height(), camera_.width, camera_.height));
  }
  return map;
}

void Sequence::useDepth(std::vector<ListedImage> images, const std::string& source) {
  depthImages_ = std::move(images);
  const auto partners = detail::associate(timesOf(frames_), timesOf(depthImages_));
  std::size_t alone = 0;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (partners[i]) {
      frames_[i].depthImage = depthImages_[*partners[i]].path;
    } else {
      ++alone;
    }
  }
  if (alone == frames_.size()) {
    throw InputError({source, 0, "timestamp"}, "no time is within 0.02 s of an image's");
  }
  if (alone > 0) {
    warnings_.push_back(fmt::format("{}: {} of {} images have no depth image within 0.02 s", source,
                                    alone, frames_.size()));
  }
}

void Sequence::readTracks(const std::string& path) {
  TextTable table(path, TextTable::Style::csv, {"timestamp", "id", "u", "v"},
                  TextTable::Order::notDecreasing);
  auto groups = detail::readGroups<PixelPoint>(table, [&](int id) {
    const PixelPoint point{id, table.number(2, kPixels, "px"), table.number(3, kPixels, "px")};
    if (!camera_.canNormalise(point.u, point.v)) {
      table.fail(
          2, fmt::format("no ray of light reaches ({}, {}) through this lens (distortion of {})",
                         point.u, point.v, cameraSource_));
    }
    return point;
  });
  detail::assignGroups(std::move(groups), &SequenceFrame::tracks, hasImages_, path, frames_,
                       warnings_);
}

void Sequence::readTruth(const std::string& path) {
  TextTable table(path, TextTable::Style::csv, {"timestamp", "id", "Z"},
                  TextTable::Order::notDecreasing);
  auto groups = detail::readGroups<TrueDepth>(table, [&](int id) {
    return TrueDepth{id, table.number(2, kDepths, "m")};
  });
  detail::assignGroups(std::move(groups), &SequenceFrame::truth, hasImages_, path, frames_,
                       warnings_);
}

void Sequence::readOdometry(const std::string& path) {
  TextTable table(path, TextTable::Style::csv, {"timestamp", "vx", "vy", "vz", "wx", "wy", "wz"});
  while (table.next()) {
    OdometryRow row;
    row.time_s = table.time();
    for (int i = 0; i < 3; ++i) {
      row.twist.linear(i) = table.number(static_cast<std::size_t>(1 + i), kSpeeds, "m/s");
      row.twist.angular(i) = table.number(static_cast<std::size_t>(4 + i), kSpeeds, "rad/s");
    }
    odometry_.push_back(row);
  }
}

}  // namespace depthservo
