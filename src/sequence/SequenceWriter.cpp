#include "depthservo/sequence/SequenceWriter.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <yaml-cpp/yaml.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "depthservo/sequence/CommandStream.h"
#include "sequence/ImageFile.h"
#include "sequence/rowMeanings.h"
#include "sequence/twistLine.h"
#include "text/TextFile.h"
#include "text/TextTable.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

/// As many digits, up to 17, as it takes for the double to come back exactly.
std::string exact(double value) { return fmt::format("{}", value); }
std::string timeText(double time_s) { return fmt::format("{:.9f}", time_s); }

constexpr const char *kTaughtFolder = "taught", *kGoalFolder = "goal";

std::string cameraInfo(const PinholeCamera& camera) {
  const std::string fx = exact(camera.fx), fy = exact(camera.fy), cx = exact(camera.cx),
                    cy = exact(camera.cy);
  const LensDistortion& d = camera.distortion;
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: camera\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}, {}, {}, {}, {}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}, 0, {}, 0, 0, {}, {}, 0, 0, 0, 1, "
      "0]\n",
      camera.width, camera.height, fx, cx, fy, cy, exact(d.k1()), exact(d.k2()), exact(d.p1()),
      exact(d.p2()), exact(d.k3()), fx, cx, fy, cy);
}

std::string tagsYaml(const AprilTagTarget& target) {
  std::string text =
      fmt::format("target:\n  type: apriltag\n  family: {}\n  tags:\n", target.family);
  for (const AprilTagTarget::Tag& tag : target.tags) {
    const Eigen::Vector3d& p = tag.oMt.translation();
    const Eigen::Quaterniond q(tag.oMt.linear());
    const std::string size = tag.size ? fmt::format(", size: {}", exact(*tag.size)) : "";
    text += fmt::format("    - {{id: {}{}, xyz: [{}, {}, {}], quaternion: [{}, {}, {}, {}]}}\n",
                        tag.id, size, exact(p.x()), exact(p.y()), exact(p.z()), exact(q.x()),
                        exact(q.y()), exact(q.z()), exact(q.w()));
  }
  return text;
}

std::string boardYaml(const BoardTarget& board) {
  std::string text =
      fmt::format("target:\n  type: {}\n  columns: {}\n  rows: {}\n",
                  board.markers ? "charuco" : "chessboard", board.columns, board.rows);
  if (board.square) text += fmt::format("  square: {}\n", exact(*board.square));
  if (const auto& markers = board.markers) {
    text +=
        fmt::format("  marker: {}\n  dictionary: {}\n", exact(markers->size), markers->dictionary);
  }
  return text;
}

std::string sequenceYaml(const SequenceSettings& settings) {
  YAML::Emitter name;
  name << YAML::DoubleQuoted << settings.name;
  std::string text = settings.name.empty() ? "" : fmt::format("name: {}\n", name.c_str());
  if (settings.rows != RowMeaning::hold) {
    text += fmt::format("rows: {}\n", detail::wordOf(detail::rowMeanings(), settings.rows));
  }
  const auto list = [&](const auto& values, const auto& item) {
    std::string joined;
    for (const auto& value : values) joined += (joined.empty() ? "" : ", ") + item(value);
    return "[" + joined + "]";
  };
  if (settings.tags) {
    text += tagsYaml(*settings.tags);
  } else if (settings.board) {
    text += boardYaml(*settings.board);
  } else if (!settings.target.points.empty()) {
    text += "target:\n  type: dots\n  points: " +
            list(settings.target.points,
                 [](const Eigen::Vector3d& p) {
                   return fmt::format("[{}, {}, {}]", exact(p.x()), exact(p.y()), exact(p.z()));
                 }) +
            "\n  radius: " + exact(settings.target.radius) + "\n";
  }
  if (!settings.dots.empty()) {
    text += "dots: " +
            list(settings.dots,
                 [](const PixelPoint& dot) {
                   return fmt::format("[{}, {}]", exact(dot.u), exact(dot.v));
                 }) +
            "\n";
  }
  if (settings.taught) text += fmt::format("taught: {}\n", kTaughtFolder);
  if (!settings.replay.empty()) {
    text += "replay:\n";
    std::istringstream lines(settings.replay);
    for (std::string line; std::getline(lines, line);) text += "  " + line + "\n";
  }
  return text.empty() ? "{}\n" : text;
}

}  // namespace

double fileTime(double time_s) {
  // Below this the number of nanoseconds is exact, and so is their quotient: that of the text.
  constexpr double kExact_s = 4e6, kPerSecond = 1e9;
  const double scaled = time_s * kPerSecond, nanoseconds = std::nearbyint(scaled);
  const double rest = scaled - nanoseconds + std::fma(time_s, kPerSecond, -scaled);
  if (std::abs(time_s) < kExact_s && std::abs(rest) < 0.5) return nanoseconds / kPerSecond;
  return detail::toNumber(timeText(time_s)).value_or(time_s);
}

std::string lawCommandHeader(const std::vector<std::string>& velocityNames) {
  std::string header = "timestamp,at,rows";
  for (const std::string& name : velocityNames) header += ',' + shortName(name);
  return header + '\n';
}

std::string lawCommandLine(const LawCommand& command) {
  std::string line =
      fmt::format("{},{},{}", timeText(command.time_s), timeText(command.at_s), command.rows);
  for (const double velocity : command.velocities) line += ',' + exact(velocity);
  return line + '\n';
}

std::vector<LawCommand> readLawCommands(const std::string& file,
                                        const std::vector<std::string>& velocityNames) {
  constexpr detail::Range kVelocities{-1e6, 1e6};
  std::vector<std::string> columns{"timestamp", "at", "rows"};
  for (const std::string& name : velocityNames) columns.push_back(shortName(name));
  detail::TextTable table(file, detail::TextTable::Style::csv, columns);
  std::vector<LawCommand> commands;
  while (table.next()) {
    LawCommand command{table.time(), table.seconds(1), static_cast<std::size_t>(table.id(2)),
                       Velocities(static_cast<Eigen::Index>(velocityNames.size()))};
    for (std::size_t i = 0; i < velocityNames.size(); ++i) {
      command.velocities[static_cast<Eigen::Index>(i)] =
          table.number(3 + i, kVelocities, "m/s, rad/s");
    }
    commands.push_back(std::move(command));
  }
  return commands;
}

namespace {

const std::string& named(const std::string& folder) {
  if (folder.empty()) throw InputError({"(no name)", 0, ""}, "a sequence needs a folder");
  return folder;
}

}  // namespace

SequenceWriter::SequenceWriter(const std::string& folder) : folder_(named(folder)), made_(folder_) {
  std::error_code error;
  if (!fs::create_directory(made_.path() / "rgb", error)) {
    throw InputError({folder, 0, ""}, "cannot be written: " + error.message());
  }
}

SequenceWriter::~SequenceWriter() = default;

std::ofstream& SequenceWriter::file(const std::string& name, const std::string& header) {
  const auto [it, isNew] = files_.try_emplace(name);
  if (isNew) {
    it->second.open(made_.path() / name, std::ios::binary);
    it->second << header;
  }
  check(it->second, name);
  return it->second;
}

void SequenceWriter::check(const std::ofstream& out, const std::string& name) const {
  if (!out) throw notWritten(fs::path(folder_) / name);
}

void SequenceWriter::addImage(double time_s, const DEPTHSERVO_VISP vpImage<unsigned char>& image) {
  made_.stopIfInterrupted();
  const std::string name = fmt::format("rgb/{:06}.png", ++images_);
  constexpr int kFastCompression = 1;
  const std::string bytes = detail::pngOf(
      image.bitmap, {static_cast<int>(image.getWidth()), static_cast<int>(image.getHeight())},
      kFastCompression);
  std::ofstream out(made_.path() / name, std::ios::binary);
  out << bytes;
  check(out, name);
  out.close();
  check(out, name);
  file("rgb.txt", "# timestamp path\n") << timeText(time_s) << ' ' << name << '\n';
}

void SequenceWriter::addTrack(double time_s, const PixelPoint& point) {
  file("tracks.csv", "timestamp,id,u,v\n")
      << fmt::format("{},{},{},{}\n", timeText(time_s), point.id, exact(point.u), exact(point.v));
}

void SequenceWriter::addTruth(double time_s, const TrueDepth& depth) {
  file("truth.csv", "timestamp,id,Z\n")
      << fmt::format("{},{},{}\n", timeText(time_s), depth.id, exact(depth.Z));
}

void SequenceWriter::addOdometry(double time_s, const Twist& twist) {
  file("twist.csv", std::string(detail::kTwistHeader) + "\n") << detail::twistLine(time_s, twist);
}

void SequenceWriter::addPose(double time_s, const Eigen::Isometry3d& wMc) {
  made_.stopIfInterrupted();
  std::ofstream& out = file("groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n");
  const Eigen::Quaterniond q(wMc.linear());
  out << timeText(time_s);
  for (const double value : {wMc.translation().x(), wMc.translation().y(), wMc.translation().z(),
                             q.x(), q.y(), q.z(), q.w()}) {
    out << ' ' << exact(value);
  }
  out << '\n';
}

void SequenceWriter::addCommand(const LawCommand& command,
                                const std::vector<std::string>& velocityNames) {
  file("commands.csv", lawCommandHeader(velocityNames)) << lawCommandLine(command);
}

/// What has a folder of its own.
void SequenceWriter::writeBelow(const SequenceSettings& settings) const {
  if (settings.taught) {
    SequenceWriter taught((made_.path() / kTaughtFolder).string());
    taught.addImage(0, settings.taught->image);
    int id = 0;
    for (const Eigen::Vector2d& p : settings.taught->points) {
      taught.addTrack(0, {id++, p.x(), p.y()});
    }
    taught.finish({kTaughtFolder, settings.camera, {}, {}, ""});
  }
  if (settings.goal.empty()) return;
  SequenceWriter goal((made_.path() / kGoalFolder).string());
  for (std::size_t i = 0; i < settings.goal.size(); ++i) {
    goal.addTrack(0, settings.goal[i]);
    goal.addTruth(0, {settings.goal[i].id, settings.goalZ[i]});
  }
  goal.finish({kGoalFolder, settings.camera, {}, {}, ""});
}

void SequenceWriter::finish(const SequenceSettings& settings) {
  try {
    writeBelow(settings);
  } catch (const InputError& error) {
    throw made_.named(error);
  }
  if (!settings.robot.empty()) file("robot.yaml", settings.robot);
  file("camera.yaml", cameraInfo(settings.camera));
  file("sequence.yaml", sequenceYaml(settings));
  for (auto& [name, out] : files_) {
    out.close();
    check(out, name);
  }
  files_.clear();
  std::error_code error;
  if (images_ == 0) fs::remove(made_.path() / "rgb", error);
  made_.keep();
}

}  // namespace depthservo
