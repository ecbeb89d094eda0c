#include "sequence/frameFolder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "depthservo/sequence/SequenceWriter.h"
#include "sequence/ImageFile.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualRate = 30;  // Hz
constexpr TextLimits kPoseFiles{std::size_t{64} << 20, 4096};

/// "frame-000012.color.png" is the number 12 of the kind ".color.png"; -1: another name.
long numberIn(const std::string& file, const std::string& kind) {
  const std::string prefix = "frame-";
  if (file.size() <= prefix.size() + kind.size() || file.compare(0, prefix.size(), prefix) != 0 ||
      file.compare(file.size() - kind.size(), kind.size(), kind) != 0) {
    return -1;
  }
  const auto number =
      toInteger(file.substr(prefix.size(), file.size() - prefix.size() - kind.size()));
  return number && *number >= 0 && *number < 1'000'000'000 ? static_cast<long>(*number) : -1;
}

/// Files of the first of these kinds that there are, by number.
std::map<long, std::string> filesOf(const std::string& folder,
                                    const std::vector<std::string>& kinds) {
  std::error_code error;
  std::map<long, std::string> files;
  for (const std::string& kind : kinds) {
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const long number = numberIn(it->path().filename().string(), kind);
      if (number >= 0) files.emplace(number, it->path().string());
    }
    if (error) throw InputError({folder, 0, ""}, "cannot be read: " + error.message());
    if (!files.empty()) break;
  }
  return files;
}

std::vector<std::string> wordsIn(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// A pose of 12 or 16 numbers, row by row. Empty: one of them is not finite.
std::optional<Eigen::Isometry3d> poseOf(const std::vector<std::string>& words,
                                        const InputError::Place& place) {
  if (words.size() != 12 && words.size() != 16) {
    throw InputError(place, fmt::format("expected 12 or 16 numbers, a 3x4 or 4x4 matrix row by "
                                        "row, got {} words",
                                        words.size()));
  }
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto number = toNumber(words[i]);
    const std::string word = words[i].substr(words[i].find_first_not_of("+-") == 1);
    const bool isNone = word == "nan" || word == "inf" || word == "NaN" || word == "-nan(ind)";
    if (!number && isNone) return std::nullopt;
    if (!number) throw InputError(place, fmt::format("{} is not a number", detail::quoted(words[i])));
    T(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = *number;
  }
  constexpr double kRounded = 1e-3, kFarthest_m = 1e7;  // files hold few digits
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (!(R * R.transpose()).isIdentity(kRounded) || R.determinant() < 0 ||
      !T.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), kRounded) ||
      T.col(3).cwiseAbs().maxCoeff() > kFarthest_m) {
    throw InputError(place, "expected a pose: [R t; 0 0 0 1] with a rotation R, row by row");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = T.topRightCorner<3, 1>();
  pose.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  return pose;
}

}  // namespace

bool isFrameFolder(const std::string& folder) {
  return !filesOf(folder, {".color.png", ".color.jpg"}).empty();
}

DataSet readFrameFolder(const std::string& folder, double fps) {
  const double rate = fps > 0 ? fps : kUsualRate;
  DataSet set;
  const auto images = filesOf(folder, {".color.png", ".color.jpg"});
  const auto timeOf = [&](long number) {
    return fileTime(static_cast<double>(number - images.begin()->first) / rate);
  };
  for (const auto& [number, file] : images) set.images.push_back({timeOf(number), file});

  const auto depths = filesOf(folder, {".depth.png"});
  if (!depths.empty()) {
    const ImageSize image = ImageFile(images.begin()->second).size();
    const ImageSize depth = ImageFile(depths.begin()->second).size();
    if (depth.width == image.width && depth.height == image.height) {
      for (const auto& [number, file] : depths) set.depthImages.push_back({timeOf(number), file});
    } else {
      set.warnings.push_back(
          fmt::format("{}: the depth images have {}x{} pixels, the images {}x{}: they are left out",
                      folder, depth.width, depth.height, image.width, image.height));
    }
  }
  std::size_t unusable = 0;
  const auto poses = filesOf(folder, {".pose.txt"});
  for (const auto& [number, file] : poses) {
    const auto pose = poseOf(wordsIn(readTextFile(file, kPoseFiles)), {file, 0, ""});
    if (pose) set.poses.push_back({timeOf(number), *pose});
    unusable += !pose;
  }
  if (unusable > 0) {
    set.warnings.push_back(fmt::format("{}: {} of {} poses are not finite, and are skipped", folder,
                                       unusable, poses.size()));
  }
  return set;
}

std::vector<CameraPose> readPoseMatrices(const std::string& path,
                                         const std::vector<SequenceFrame>& frames) {
  std::istringstream lines(readTextFile(path, kPoseFiles));
  std::vector<CameraPose> poses;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::vector<std::string> words = wordsIn(line);
    if (words.empty() || words.front().front() == '#') continue;
    const auto pose = poseOf(words, {path, number, ""});
    if (!pose) throw InputError({path, number, ""}, "has a number that is not finite");
    if (poses.size() < frames.size())
      poses.push_back({frames[poses.size()].time_s, *pose});
    else
      throw InputError({path, number, ""}, fmt::format("expected one pose for each of the {} "
                                                       "images",
                                                       frames.size()));
  }
  if (poses.size() == frames.size()) return poses;
  throw InputError({path, number, ""}, fmt::format("expected one pose for each of the {} images, "
                                                   "got {}",
                                                   frames.size(), poses.size()));
}

}  // namespace depthservo::detail
