#include "depthservo/sequence/Sequence.h"

#include <fmt/format.h>
#include <visp3/core/vpIoTools.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "depthservo/motion/Motion.h"
#include "depthservo/text/didYouMean.h"
#include "sequence/GrayImage.h"
#include "sequence/associate.h"
#include "sequence/cameraFiles.h"
#include "sequence/dataSets.h"
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
constexpr double kSameTime_s = 1e-6;             // a double holds epoch seconds to 0.24 us

/// Numbered image files "<before><digits><after>".
struct NumberedName {
  std::string before, after;

  std::optional<long> number(const std::string& file) const {
    if (file.size() <= before.size() + after.size() ||
        file.compare(0, before.size(), before) != 0 ||
        file.compare(file.size() - after.size(), after.size(), after) != 0) {
      return std::nullopt;
    }
    const std::string digits =
        file.substr(before.size(), file.size() - before.size() - after.size());
    if (digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos) {
      return std::nullopt;
    }
    return std::stol(digits);
  }
};

/// From a pattern such as image.%04d.pgm; nothing unless it has exactly one %d or %0Nd.
std::optional<NumberedName> parsePattern(const std::string& pattern) {
  const std::size_t percent = pattern.find('%');
  if (percent == std::string::npos || pattern.find('/') != std::string::npos) return std::nullopt;
  std::size_t end = percent + 1;
  while (end < pattern.size() && pattern[end] >= '0' && pattern[end] <= '9') ++end;
  if (end >= pattern.size() || pattern[end] != 'd' || end > percent + 3) return std::nullopt;
  if (pattern.find('%', end) != std::string::npos) return std::nullopt;
  return NumberedName{pattern.substr(0, percent), pattern.substr(end + 1)};
}

/// "image.0001.pgm": the last digits before the extension of an image file.
std::optional<NumberedName> numberedImage(const std::string& file) {
  std::string extension = fs::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static const std::set<std::string> images = {".pgm", ".ppm", ".png", ".jpg", ".jpeg"};
  if (images.count(extension) == 0) return std::nullopt;
  const std::size_t stem = file.size() - extension.size();
  const std::size_t last = file.find_last_of("0123456789", stem - 1);
  if (stem == 0 || last == std::string::npos) return std::nullopt;
  const std::size_t before = file.find_last_not_of("0123456789", last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  return NumberedName{file.substr(0, first), file.substr(last + 1)};
}

/// "tags" of a target: family, and a list of {id, size, xyz, quaternion}.
AprilTagTarget readTags(const StrictMapping& target) {
  AprilTagTarget tags;
  if (target.has("family")) tags.family = target.text("family");
  const std::vector<std::string> families = aprilTagFamilies();
  if (std::find(families.begin(), families.end(), tags.family) == families.end()) {
    target.fail("family",
                fmt::format("there is no AprilTag family {}; the nearest is '{}'",
                            detail::quoted(tags.family), nearestWord(tags.family, families)));
  }
  const int count = aprilTagCount(tags.family);
  std::set<int> ids;
  for (const detail::YamlValue& item : target.list("tags").items) {
    const StrictMapping read(item, target.file(), target.pathOf("tags"),
                             {"id", "size", "xyz", "quaternion"});
    AprilTagTarget::Tag tag;
    tag.id = static_cast<int>(read.integer("id", {0, count - 1.0}, ""));
    if (!ids.insert(tag.id).second) read.fail("id", fmt::format("tag {} is there twice", tag.id));
    if (read.has("size")) tag.size = read.number("size", Range::above(0, 10), "m");
    if (read.has("xyz")) {
      const std::vector<double> p = read.numbers("xyz", 3, {-100, 100}, "m");
      tag.oMt.translation() = Eigen::Vector3d(p[0], p[1], p[2]);
    }
    if (read.has("quaternion")) {
      const std::vector<double> q = read.numbers("quaternion", 4, {-1.1, 1.1}, "");
      const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
      if (!(std::abs(rotation.norm() - 1) < 0.02)) {
        read.fail("quaternion",
                  fmt::format("[qx, qy, qz, qw] has the norm {}, expected 1", rotation.norm()));
      }
      tag.oMt.linear() = rotation.normalized().toRotationMatrix();
    }
    tags.tags.push_back(tag);
  }
  if (tags.tags.empty()) target.fail("tags", "expected at least 1 tag");
  return tags;
}

std::vector<std::string> filesIn(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> files;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    files.push_back(it->path().filename().string());
  }
  if (error) throw InputError({folder, 0, ""}, "cannot be read: " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

/// The images of a numbered series, from time 0 at a constant rate. `none` is thrown when there are
/// none.
std::vector<ListedImage> numberedSeries(const std::string& folder, const NumberedName& name,
                                        double rate, const InputError& none) {
  std::map<long, std::string> byNumber;
  for (const std::string& file : filesIn(folder)) {
    const auto number = name.number(file);
    if (!number) continue;
    if (!byNumber.emplace(*number, file).second) {
      throw InputError({folder, 0, ""},
                       fmt::format("{} and {} have the same number", byNumber[*number], file));
    }
  }
  if (byNumber.empty()) throw none;
  std::vector<ListedImage> images;
  const long first = byNumber.begin()->first;
  for (const auto& [number, file] : byNumber) {
    const long expected = first + static_cast<long>(images.size());
    if (number != expected) {
      throw InputError({folder, 0, ""},
                       fmt::format("image number {} is missing ({} comes after number {})",
                                   expected, file, expected - 1));
    }
    images.push_back(
        {static_cast<double>(images.size()) / rate, (fs::path(folder) / file).string()});
  }
  return images;
}

/// The images of a folder that has nothing else.
std::vector<ListedImage> plainImageFolder(const std::string& folder, double fps) {
  std::optional<NumberedName> series;
  for (const std::string& file : filesIn(folder)) {
    const auto name = numberedImage(file);
    if (!name) continue;
    if (series && (name->before != series->before || name->after != series->after)) {
      throw InputError({folder, 0, ""},
                       fmt::format("has two series of images, {}*{} and {}*{}; expected one",
                                   series->before, series->after, name->before, name->after));
    }
    series = name;
  }
  const InputError none({folder, 0, ""},
                        "is not a sequence: it has no rgb.txt, associations.txt, mav0/cam0 or "
                        "tracks.csv, no images in sequence.yaml and no numbered images "
                        "(image.0001.pgm)");
  if (!series) throw none;
  if (fps <= 0) {
    throw InputError({folder, 0, "--fps"}, "missing; a folder of numbered images has no times");
  }
  return numberedSeries(folder, *series, fps, none);
}

/// Where a folder named in sequence.yaml is: in the sequence's folder or among ViSP's images.
std::string findImageFolder(const std::string& folder, const std::string& sequenceFolder) {
  static const std::string kPrefix = "ViSP-images/";
  const std::string stripped =
      folder.compare(0, kPrefix.size(), kPrefix) == 0 ? folder.substr(kPrefix.size()) : folder;
  std::vector<fs::path> candidates = {fs::path(sequenceFolder) / folder};
  if (const char* input = std::getenv("VISP_INPUT_IMAGE_PATH")) {
    for (const char* below : {"", "ViSP-images", "visp-images"}) {
      candidates.push_back(fs::path(input) / below / stripped);
    }
  }
  const std::string visp = DEPTHSERVO_VISP vpIoTools::getViSPImagesDataPath();
  if (!visp.empty()) candidates.push_back(fs::path(visp) / stripped);
  for (const fs::path& candidate : candidates) {
    std::error_code error;
    if (fs::is_directory(candidate, error)) return candidate.string();
  }
  return "";
}

/// Rows of (timestamp, id) tables, grouped by time; each (timestamp, id) once.
template <class Value, class MakeValue>
std::vector<std::pair<double, std::vector<Value>>> readGroups(TextTable& table,
                                                              const MakeValue& make) {
  std::vector<std::pair<double, std::vector<Value>>> groups;
  while (table.next()) {
    const int id = table.id(1);
    if (groups.empty() || groups.back().first != table.time()) groups.push_back({table.time(), {}});
    auto& values = groups.back().second;
    const auto place = std::lower_bound(values.begin(), values.end(), id,
                                        [](const Value& v, int wanted) { return v.id < wanted; });
    if (place != values.end() && place->id == id) {
      table.fail(1, fmt::format("id {} appears twice at {} s; remove one row", id, table.time()));
    }
    values.insert(place, make(id));
  }
  return groups;
}

/// The frame at this time, or the place where it belongs.
std::vector<SequenceFrame>::iterator frameAt(std::vector<SequenceFrame>& frames, double time_s) {
  return std::lower_bound(frames.begin(), frames.end(), time_s - kSameTime_s,
                          [](const SequenceFrame& f, double t) { return f.time_s < t; });
}

/// Gives each group to the frame of its time. Without images the groups make the frames; else
/// groups at other times are ignored, but for one file not all of them.
template <class Value>
void assignGroups(std::vector<std::pair<double, std::vector<Value>>> groups,
                  std::vector<Value> SequenceFrame::*member, bool hasImages,
                  const std::string& path, std::vector<SequenceFrame>& frames,
                  std::vector<std::string>& warnings) {
  std::size_t ignored = 0;
  if (!hasImages) {
    std::vector<SequenceFrame> merged;
    merged.reserve(frames.size() + groups.size());
    auto frame = frames.begin();
    for (const auto& group : groups) {
      while (frame != frames.end() && frame->time_s <= group.first + kSameTime_s) {
        merged.push_back(std::move(*frame++));
      }
      if (merged.empty() || merged.back().time_s < group.first - kSameTime_s) {
        merged.push_back({group.first, "", {}, {}});
      }
    }
    std::move(frame, frames.end(), std::back_inserter(merged));
    frames = std::move(merged);
  }
  for (auto& [time_s, values] : groups) {
    const auto frame = frameAt(frames, time_s);
    if (frame == frames.end() || frame->time_s > time_s + kSameTime_s ||
        !((*frame).*member).empty()) {
      ++ignored;
    } else {
      (*frame).*member = std::move(values);
    }
  }
  if (ignored == groups.size()) {
    throw InputError({path, 0, "timestamp"},
                     "no time is that of an image in rgb.txt; use the images' timestamps");
  }
  if (ignored > 0) {
    warnings.push_back(fmt::format("{}: {} of {} times are those of no image and are ignored", path,
                                   ignored, groups.size()));
  }
}

bool exists(const std::string& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

const std::vector<std::string>& settingsKeys() {
  static const std::vector<std::string> keys = {"name", "depth_scale", "target",
                                                "dots", "images",      "replay"};
  return keys;
}

SequenceTarget targetOf(const StrictMapping& settings) {
  SequenceTarget seen;
  if (settings.has("target")) {
    const StrictMapping target =
        settings.mapping("target", {"type", "points", "radius", "family", "tags"});
    const std::string type = target.has("type") ? target.text("type") : "dots";
    if (type != "dots" && type != "apriltag") target.fail("type", "expected dots or apriltag");
    const bool hasTags = type == "apriltag";
    for (const char* key : {"points", "radius"}) {
      if (hasTags && target.has(key)) target.fail(key, "is for type: dots");
    }
    for (const char* key : {"family", "tags"}) {
      if (!hasTags && target.has(key)) target.fail(key, "is for type: apriltag");
    }
    if (hasTags) {
      seen.tags = readTags(target);
      if (seen.tags->hasSizes()) seen.target.points = seen.tags->corners();
    } else {
      for (const auto& point : target.rows("points", 3, {-100, 100}, "m")) {
        seen.target.points.emplace_back(point[0], point[1], point[2]);
      }
      if (seen.target.points.empty()) target.fail("points", "expected at least 1 point");
    }
    if (target.has("radius")) seen.target.radius = target.number("radius", {0, 10}, "m");
  }
  if (settings.has("dots")) {
    for (const auto& dot : settings.rows("dots", 2, kPixels, "px")) {
      seen.dots.push_back({static_cast<int>(seen.dots.size()), dot[0], dot[1]});
    }
    if (!seen.target.points.empty() && seen.dots.size() != seen.target.points.size()) {
      settings.fail("dots", fmt::format("expected one for each of the {} points of the target, got "
                                        "{}",
                                        seen.target.points.size(), seen.dots.size()));
    }
  }
  if (settings.has("replay")) {
    seen.replay = {settings.file(),
                   std::make_shared<const detail::YamlValue>(settings.value("replay"))};
  }
  return seen;
}

}  // namespace

SequenceTarget readTarget(const std::string& path) {
  const detail::YamlValue root = detail::loadYaml(path);
  const StrictMapping settings(root, path, "", settingsKeys());
  SequenceTarget seen = targetOf(settings);
  if (seen.target.points.empty() && seen.dots.empty() && !seen.tags) {
    settings.fail("target",
                  "missing: expected target: {type: dots, points: [...]}, or dots: [...]");
  }
  return seen;
}

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

std::vector<PoseGap> gapsOf(const std::vector<CameraPose>& poses) {
  constexpr double kLeast_s = 0.04, kPeriods = 4;
  std::vector<double> periods;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    periods.push_back(poses[i].time_s - poses[i - 1].time_s);
  }
  if (periods.empty()) return {};
  std::vector<double> sorted = periods;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double most_s = std::max(kLeast_s, kPeriods * *middle);
  std::vector<PoseGap> gaps;
  for (std::size_t i = 0; i < periods.size(); ++i) {
    if (periods[i] > most_s) gaps.push_back({poses[i].time_s, poses[i + 1].time_s});
  }
  return gaps;
}

Sequence::Sequence(const std::string& folder, const SequenceOptions& options) : folder_(folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw InputError({folder, 0, ""}, exists(folder)
                                          ? "is not a folder; a sequence is a folder"
                                          : "there is no such folder" + didYouMeanFile(folder));
  }
  if (options.fps != 0 && !kRates.contains(options.fps)) {
    throw InputError({folder, 0, "--fps"},
                     detail::expectedNumber(kRates, "Hz", fmt::format("{}", options.fps)));
  }
  fs::path normal = fs::absolute(folder).lexically_normal();
  if (!normal.has_filename()) normal = normal.parent_path();
  name_ = normal.filename().string();

  const std::string settings = inFolder("sequence.yaml"), list = inFolder("rgb.txt"),
                    tracks = inFolder("tracks.csv"), truth = inFolder("truth.csv"),
                    depth = inFolder("depth.txt");
  if (exists(settings)) readSettings(settings, options);
  detail::DataSet set;
  if (exists(list)) {
    if (hasImages_) {
      throw InputError({settings, 0, "images"}, "the folder has rgb.txt as well; remove one");
    }
    if (options.fps > 0) {
      throw InputError({list, 0, "--fps"}, "is for folders of numbered images; rgb.txt has times");
    }
    useImages(readImageList(list));
  } else if (const auto mav0 = detail::eurocFolder(folder_); mav0 && !hasImages_) {
    if (options.fps > 0) {
      throw InputError({*mav0, 0, "--fps"}, "is for folders of numbered images; cam0 has times");
    }
    set = detail::readEuroc(*mav0);
    useImages(set.images);
  } else if (detail::isAssociated(folder_) && !hasImages_) {
    set = detail::readAssociated(folder_, options.fps);
    useImages(set.images);
  } else if (!hasImages_ && !exists(tracks)) {
    useImages(plainImageFolder(folder_, options.fps));
  }
  warnings_ = set.warnings;
  readCamera(options, set.camera);
  if (exists(tracks)) readTracks(tracks);
  if (exists(truth)) readTruth(truth);
  if (!set.depthImages.empty()) {
    useDepth(std::move(set.depthImages), inFolder("associations.txt"));
  } else if (exists(depth)) {
    useDepth(readImageList(depth), depth);
  }
  if (exists(inFolder("twist.csv"))) readOdometry(inFolder("twist.csv"));
  poses_ = std::move(set.poses);
  if (poses_.empty() && exists(inFolder("groundtruth.txt"))) {
    const bool isDownloaded = !exists(inFolder("camera.yaml"));
    poses_ = detail::readPoses(
        inFolder("groundtruth.txt"),
        isDownloaded ? detail::UnusablePoses::skip : detail::UnusablePoses::refuse, 1, warnings_);
  }
}

std::string Sequence::inFolder(const std::string& file) const {
  return (fs::path(folder_) / file).string();
}

void Sequence::readSettings(const std::string& path, const SequenceOptions& options) {
  const detail::YamlValue root = detail::loadYaml(path);
  const StrictMapping settings(root, path, "", settingsKeys());
  if (settings.has("name")) name_ = settings.text("name");
  if (settings.has("depth_scale")) {
    depthScale_ = settings.number("depth_scale", Range::above(0, 1e6), "1/m");
  }
  SequenceTarget seen = targetOf(settings);
  target_ = std::move(seen.target);
  tags_ = std::move(seen.tags);
  dots_ = std::move(seen.dots);
  replay_ = std::move(seen.replay);
  if (settings.has("images")) {
    const StrictMapping images = settings.mapping("images", {"folder", "pattern", "rate"});
    const std::string name = images.text("folder"), pattern = images.text("pattern");
    const double rate = options.fps > 0 ? options.fps : images.number("rate", kRates, "Hz");
    const auto numbered = parsePattern(pattern);
    if (!numbered) images.fail("pattern", "expected a file name with one %d or %04d");
    const std::string found = findImageFolder(name, folder_);
    if (found.empty()) {
      images.fail("folder", fmt::format("there is no folder {} in the sequence's folder, below "
                                        "VISP_INPUT_IMAGE_PATH or among ViSP's images; install "
                                        "visp-images-data",
                                        detail::quoted(name)));
    }
    useImages(numberedSeries(found, *numbered, rate,
                             InputError({path, images.value("pattern").line, "images.pattern"},
                                        fmt::format("no file like {} in {}", pattern, found))));
  }
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
  // A first image that cannot be read matters only to those who read images.
  if (hasImages_) {
    try {
      const detail::ImageSize size = detail::ImageFile(frames_[0].image).size();
      if (size.width == camera_.width && size.height == camera_.height) return;
    } catch (const InputError&) {
      return;
    }
    readImage(0);
  }
}

DEPTHSERVO_VISP vpImage<unsigned char> Sequence::readImage(std::size_t frame) const {
  const std::string& path = frames_[frame].image;
  const detail::ImageFile file(path);
  if (file.size().width != camera_.width || file.size().height != camera_.height) {
    throw InputError(
        {cameraSource_, 0, ""},
        fmt::format("the camera has {}x{} pixels, the image {} has {}x{}", camera_.width,
                    camera_.height, path, file.size().width, file.size().height));
  }
  return file.gray();
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
  std::vector<double> frameTimes, depthTimes;
  for (const SequenceFrame& frame : frames_) frameTimes.push_back(frame.time_s);
  for (const ListedImage& image : depthImages_) depthTimes.push_back(image.time_s);
  const auto partners = detail::associate(frameTimes, depthTimes);
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
  auto groups = readGroups<PixelPoint>(table, [&](int id) {
    const PixelPoint point{id, table.number(2, kPixels, "px"), table.number(3, kPixels, "px")};
    if (!camera_.canNormalise(point.u, point.v)) {
      table.fail(
          2, fmt::format("no ray of light reaches ({}, {}) through this lens (distortion of {})",
                         point.u, point.v, cameraSource_));
    }
    return point;
  });
  assignGroups(std::move(groups), &SequenceFrame::tracks, hasImages_, path, frames_, warnings_);
  hasTracks_ = true;
}

void Sequence::readTruth(const std::string& path) {
  TextTable table(path, TextTable::Style::csv, {"timestamp", "id", "Z"},
                  TextTable::Order::notDecreasing);
  auto groups = readGroups<TrueDepth>(table, [&](int id) {
    return TrueDepth{id, table.number(2, kDepths, "m")};
  });
  assignGroups(std::move(groups), &SequenceFrame::truth, hasImages_, path, frames_, warnings_);
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
