#include "cli/RobotPair.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <sstream>

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

/// Length of the first whole piece; 0: there is none yet.
std::size_t pieceIn(const std::string& bytes, bool isImages) {
  if (!isImages) {
    const std::size_t end = bytes.find('\n');
    return end == std::string::npos ? 0 : end + 1;
  }
  const std::size_t header = bytes.find("255\n");
  if (header == std::string::npos) return 0;
  std::istringstream lines(bytes.substr(0, header));
  std::string line;
  std::getline(lines, line);  // P5
  std::getline(lines, line);  // comment
  std::size_t width = 0, height = 0;
  lines >> width >> height;
  const std::size_t length = header + 4 + width * height;
  return bytes.size() < length ? 0 : length;
}

int exitCodeOf(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status); }

nlohmann::json jsonOrNull(const std::string& text) {
  return nlohmann::json::accept(text) ? nlohmann::json::parse(text) : nlohmann::json();
}

}  // namespace

RobotPair::RobotPair(std::string scenario) : scenario_(std::move(scenario)) {
  signal(SIGPIPE, SIG_IGN);
  writeRobot(
      "type: unicycle\ncamera_offset: [0.07, 0.02, 0.13]\n"
      "limits: {v: 0.5, w: 1, dv: 1, dw: 2}\nsafety: {give_up: 0.6}\n");
}

RobotPair::~RobotPair() {
  kill(servo_, SIGKILL);
  kill(robot_, SIGKILL);
  isOver_ = true;
  for (std::thread& relay : relays_) relay.join();
}

void RobotPair::kill(pid_t id, int signal) {
  if (id > 0) ::kill(id, signal);
}

double RobotPair::now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

void RobotPair::teach(const std::string& goalPose, const std::string& how) {
  record(scenario_ +
             " --set duration=0.02 --set expect=null --set target.twist=[] "
             "--set sensing.hidden=[] --set 'robot.initial=" +
             goalPose + "'",
         path("seen"));
  const Result taught = depthservo("teach --source " + path("seen/rgb/000001.png") + " --camera " +
                                   path("seen/camera.yaml") + " " + how + " --out " + path("goal"));
  ASSERT_EQ(taught.exitCode, 0) << taught.err;
}

pid_t RobotPair::launch(const std::string& command, const std::string& name,
                        const std::string& environment) const {
  const std::string line = "exec env " + environment + " " + std::string(DEPTHSERVO_TOOL) + " " + command + " >" +
                           path(name + ".json") + " 2>" + path(name + ".err") + " </dev/null";
  const pid_t id = fork();
  if (id == 0) {
    execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    _exit(127);
  }
  return id;
}

void RobotPair::start(const std::string& servoOptions, bool isLockstep) {
  const std::string lockstep = isLockstep ? " --lockstep" : "";
  const auto tapped = [&](const char* name, const Tap& tap, bool isImages, bool isFromServo) {
    const std::string robotSide = path(name), servoSide = path(std::string(name) + "2");
    EXPECT_EQ(mkfifo(robotSide.c_str(), 0600), 0);
    EXPECT_EQ(mkfifo(servoSide.c_str(), 0600), 0);
    const std::string& from = isFromServo ? servoSide : robotSide;
    const std::string& to = isFromServo ? robotSide : servoSide;
    relays_.emplace_back([=] { relay(from, to, isImages, tap); });
    return servoSide;
  };
  const std::string im = tapped("images", images, true, false),
                    tw = tapped("twists", twists, false, false);
  const Tap keeping = [this, given = commands](double time_s, std::string line) {
    keep(line);
    return given ? given(time_s, std::move(line)) : std::vector<std::string>{std::move(line)};
  };
  const std::string co = tapped("commands", keeping, false, true);
  robot_ =
      launch("robot " + scenario_ + lockstep + " --json --images " + path("images") + " --twist " +
                 path("twists") + " --command " + path("commands") + " --log " + path("robot.csv"),
             "robot");
  servo_ = launch("servo --goal " + path("goal") + " --robot " + path("robot.yaml") + lockstep +
                      " --json --source " + im + " --twist " + tw + " --command " + co + " " +
                      servoOptions,
                  "servo", servoEnvironment);
}

/// Copies pieces from one pipe to another until its reader or its writer has gone.
void RobotPair::relay(const std::string& from, const std::string& to, bool isImages,
                      const Tap& tap) {
  const int in = open(from.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  int out = -1;
  while (out < 0 && !isOver_) {
    out = open(to.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (out < 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (out >= 0) fcntl(out, F_SETFL, 0);
  fcntl(out, F_SETPIPE_SZ, 1 << 20);
  std::string bytes;
  double first_s = 0;
  while (!isOver_ && out >= 0) {
    pollfd state{in, POLLIN, 0};
    std::vector<std::string> pieces;
    if (poll(&state, 1, 10) > 0) {
      char part[65536];
      const ssize_t count = read(in, part, sizeof part);
      if (count == 0) break;
      if (count > 0) bytes.append(part, static_cast<std::size_t>(count));
    }
    while (const std::size_t length = pieceIn(bytes, isImages)) {
      if (first_s == 0) first_s = now_s();
      std::string piece = bytes.substr(0, length);
      bytes.erase(0, length);
      const auto passed =
          tap ? tap(now_s() - first_s, std::move(piece)) : std::vector{std::move(piece)};
      for (const std::string& each : passed) {
        std::size_t done = 0;
        while (done < each.size()) {
          const ssize_t n = write(out, each.data() + done, each.size() - done);
          if (n < 0) break;  // its reader has gone; what comes is looked at all the same
          done += static_cast<std::size_t>(n);
        }
      }
    }
  }
  if (out >= 0) close(out);
  close(in);
}

void RobotPair::keep(const std::string& line) {
  std::istringstream fields(line);
  std::string field;
  std::vector<double> values;
  while (std::getline(fields, field, ',')) values.push_back(std::strtod(field.c_str(), nullptr));
  if (values.size() < 6 || values[0] < 1) return;  // the header
  written_.push_back({values[1], values[4], values[5]});
}

void RobotPair::wait() {
  const double end_s = now_s() + 60;
  int status = 0;
  for (pid_t* id : {&servo_, &robot_}) {
    pid_t ended = 0;
    while ((ended = waitpid(*id, &status, WNOHANG)) == 0 && now_s() < end_s) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (ended == 0) {
      ADD_FAILURE() << (id == &servo_ ? "the servo" : "the robot") << " does not end";
      ::kill(*id, SIGKILL);
      waitpid(*id, &status, 0);
    }
    *id = -1;
    (id == &servo_ ? servoExit : robotExit) = exitCodeOf(status);
  }
  isOver_ = true;
  for (std::thread& relay : relays_) relay.join();
  relays_.clear();
  servo = jsonOrNull(folder_.read("servo.json"));
  robot = jsonOrNull(folder_.read("robot.json"));
  words = folder_.read("servo.err") + folder_.read("robot.err");
}

std::vector<RobotPair::Row> RobotPair::log() const {
  const auto columns = readCsv(path("robot.csv"));
  std::vector<Row> rows;
  for (std::size_t i = 0; i < columns.at("timestamp").size(); ++i) {
    const auto value = [&](const char* column) { return std::stod(columns.at(column)[i]); };
    if (columns.at("expired")[i].empty()) break;  // cut by a kill
    rows.push_back({value("timestamp"), value("v"), value("w"), columns.at("expired")[i] == "1"});
  }
  return rows;
}

double RobotPair::stoppedAfter(double cause_s) const {
  double stopped_s = cause_s;
  for (const Row& row : log()) {
    if (std::abs(row.v) > 1e-9 || std::abs(row.w) > 1e-9) stopped_s = row.time_s;
  }
  return stopped_s - cause_s;
}

double RobotPair::speedAt(double time_s) const {
  double v = 0;
  for (const Row& row : log()) {
    if (row.time_s <= time_s) v = row.v;
  }
  return v;
}

}  // namespace depthservo::test
