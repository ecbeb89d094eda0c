#include "sequence/dataSets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "depthservo/sequence/SequenceWriter.h"
#include "sequence/ImageFile.h"
#include "sequence/cameraFiles.h"
#include "text/TextTable.h"

namespace depthservo::detail {
namespace {

namespace fs = std::filesystem;

constexpr Range kPositions{-1e7, 1e7};  // m

bool isThere(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

/// The pose in four columns from `quaternion` on (`w` of them is the scalar part) and three from
/// `position` on.
Eigen::Isometry3d readPose(const TextTable& table, std::size_t position, std::size_t quaternion,
                           std::size_t w) {
  const Range component{-1.1, 1.1};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 3; ++i) {
    pose.translation()(i) = table.number(position + static_cast<std::size_t>(i), kPositions, "m");
  }
  const std::size_t x = w == quaternion ? quaternion + 1 : quaternion;
  const Eigen::Quaterniond q(table.number(w, component, ""), table.number(x, component, ""),
                             table.number(x + 1, component, ""),
                             table.number(x + 2, component, ""));
  constexpr double kNormError = 0.02;
  if (std::abs(q.norm() - 1) > kNormError) {
    table.fail(quaternion,
               fmt::format("({}) is not a unit quaternion: its norm is {}",
                           w == quaternion ? "qw, qx, qy, qz" : "qx, qy, qz, qw", q.norm()));
  }
  pose.linear() = q.normalized().toRotationMatrix();
  return pose;
}

bool isUnusable(const TextTable& table) {
  for (std::size_t column = 1; column <= 7; ++column) {
    if (table.isNaN(column)) return true;
  }
  const Range any{-1e300, 1e300};
  for (std::size_t column = 4; column <= 7; ++column) {
    if (table.number(column, any, "") != 0) return false;
  }
  return true;
}

}  // namespace

std::vector<CameraPose> readPoses(const std::string& path, UnusablePoses unusable, double unit_s,
                                  std::vector<std::string>& warnings) {
  const bool skips = unusable == UnusablePoses::skip;
  TextTable table(path, TextTable::Style::spaces,
                  {"timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"},
                  skips ? TextTable::Order::notDecreasing : TextTable::Order::increasing);
  std::vector<CameraPose> poses;
  std::size_t skipped = 0, rows = 0;
  while (table.next()) {
    if (++rows == 1 && !table.hasBlanks()) {
      warnings.push_back(path +
                         ": its columns are separated by commas or semicolons, read as such");
    }
    if (skips && isUnusable(table)) {
      ++skipped;
      continue;
    }
    const double time_s = unit_s == 1 ? table.time() : fileTime(table.time() * unit_s);
    const CameraPose pose{time_s, readPose(table, 1, 4, 7)};
    if (!poses.empty() && poses.back().time_s == time_s) {
      poses.back() = pose;
      ++skipped;
    } else {
      poses.push_back(pose);
    }
  }
  if (poses.empty()) throw InputError({path, 0, ""}, "has no pose that can be used");
  if (skipped > 0) {
    warnings.push_back(fmt::format(
        "{}: {} of {} poses are NaN, without a rotation or of a time listed again, and are skipped",
        path, skipped, rows));
  }
  return poses;
}

bool isAssociated(const std::string& folder) {
  return isThere(fs::path(folder) / "associations.txt") && !isThere(fs::path(folder) / "rgb.txt");
}

namespace {

/// Two columns of images with their times as written.
struct Associations {
  struct Row {
    double time[2];
    std::string file[2];
  };
  std::vector<Row> rows;
  int image = 1;        // which of the two lists the images, not the depths; ICL-NUIM: the second
  bool isWhole = true;  // the times are whole numbers
};

Associations readAssociations(const std::string& folder, const std::string& path) {
  TextTable table(path, TextTable::Style::spaces,
                  {"timestamp", "depth", "timestamp of the image", "image"});
  Associations read;
  while (table.next()) {
    Associations::Row row{{table.time(), table.seconds(2)},
                          {(fs::path(folder) / std::string(table.text(1))).string(),
                           (fs::path(folder) / std::string(table.text(3))).string()}};
    if (read.rows.empty()) {
      const bool isDepth[2] = {ImageFile(row.file[0]).isDepth(), ImageFile(row.file[1]).isDepth()};
      if (isDepth[0] == isDepth[1]) {
        table.fail(1,
                   fmt::format("expected one depth image (16-bit gray PNG) and one image in a "
                               "row, got {} of them",
                               isDepth[0] ? "two depth images and none" : "two images and none"));
      }
      read.image = isDepth[0] ? 1 : 0;
    }
    const Associations::Row& first = read.rows.empty() ? row : read.rows.front();
    for (const int i : {0, 1}) {
      if (fs::path(row.file[i]).parent_path() != fs::path(first.file[i]).parent_path()) {
        table.fail(i == 0 ? 1 : 3,
                   fmt::format("{} is in another folder than {}; are columns swapped?",
                               detail::quoted(row.file[i]), detail::quoted(first.file[i])));
      }
      read.isWhole = read.isWhole && row.time[i] == std::floor(row.time[i]);
    }
    if (!read.rows.empty() && !(row.time[1] > read.rows.back().time[1])) {
      table.fail(2, "time does not increase; sort the file");
    }
    read.rows.push_back(std::move(row));
  }
  return read;
}

/// The file of the camera's poses; none: there is none.
std::optional<std::string> trajectoryOf(const std::string& folder) {
  std::vector<std::string> trajectories;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string(), ending = ".gt.freiburg";
    if (name.size() > ending.size() &&
        name.compare(name.size() - ending.size(), ending.size(), ending) == 0) {
      trajectories.push_back(entry.path().string());
    }
  }
  std::sort(trajectories.begin(), trajectories.end());
  if (trajectories.size() > 1) {
    throw InputError({folder, 0, ""},
                     fmt::format("has two ground truths, {} and {}; remove one",
                                 detail::quoted(trajectories[0]), detail::quoted(trajectories[1])));
  }
  if (!trajectories.empty()) return trajectories[0];
  const std::string own = (fs::path(folder) / "groundtruth.txt").string();
  return isThere(own) ? std::optional(own) : std::nullopt;
}

}  // namespace

DataSet readAssociated(const std::string& folder, double fps) {
  const std::string path = (fs::path(folder) / "associations.txt").string();
  Associations read = readAssociations(folder, path);
  constexpr double kIclRate = 30;  // Hz
  if (!read.isWhole && fps > 0) {
    throw InputError({path, 0, "--fps"}, "is for frame numbers; these are times in seconds");
  }
  const double unit_s = read.isWhole ? 1 / (fps > 0 ? fps : kIclRate) : 1;
  const auto seconds = [&](double time) { return read.isWhole ? fileTime(time * unit_s) : time; };
  DataSet set;
  for (Associations::Row& row : read.rows) {
    set.images.push_back({seconds(row.time[read.image]), std::move(row.file[read.image])});
    set.depthImages.push_back(
        {seconds(row.time[1 - read.image]), std::move(row.file[1 - read.image])});
  }
  if (const auto trajectory = trajectoryOf(folder)) {
    set.poses = readPoses(*trajectory, UnusablePoses::skip, unit_s, set.warnings);
  }
  return set;
}

std::optional<std::string> eurocFolder(const std::string& folder) {
  for (const fs::path& candidate : {fs::path(folder) / "mav0", fs::path(folder)}) {
    std::error_code error;
    if (fs::is_directory(candidate / "cam0", error)) return candidate.string();
  }
  return std::nullopt;
}

DataSet readEuroc(const std::string& mav0) {
  const fs::path camera = fs::path(mav0) / "cam0",
                 truth = fs::path(mav0) / "state_groundtruth_estimate0";
  DataSet set;
  TextTable images((camera / "data.csv").string(), TextTable::Style::euroc,
                   {"timestamp", "filename"});
  while (images.next()) {
    set.images.push_back({images.time(), (camera / "data" / std::string(images.text(1))).string()});
  }
  const std::string sensor = (camera / "sensor.yaml").string();
  const CameraFile file = readCamera(sensor);
  if (!file.bMc) throw InputError({sensor, 0, "T_BS"}, "missing: the camera's place on the body");
  set.camera = file.camera;

  const fs::path states = truth / "data.csv";
  if (!isThere(states)) return set;
  const Eigen::Isometry3d bMs = isThere(truth / "sensor.yaml")
                                    ? readEurocPose((truth / "sensor.yaml").string())
                                    : Eigen::Isometry3d::Identity();
  const Eigen::Isometry3d sMc = bMs.inverse() * *file.bMc;
  TextTable table(
      states.string(), TextTable::Style::euroc,
      {"timestamp", "p_RS_R_x", "p_RS_R_y", "p_RS_R_z", "q_RS_w", "q_RS_x", "q_RS_y", "q_RS_z"});
  while (table.next()) set.poses.push_back({table.time(), readPose(table, 1, 4, 4) * sMc});
  return set;
}

}  // namespace depthservo::detail
