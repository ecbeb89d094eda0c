// `live` and `servo` for hours, through real pipes and as fast as they can: memory stays, time per
// image stays, and what comes out has the time of what went in. DEPTHSERVO_SOAK: how long, in
// simulated seconds.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <thread>

#include "cli/Tool.h"
#include "depthservo/sequence/Sequence.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

using Clock = std::chrono::steady_clock;

/// A camera that goes round in 10 s, for ever, before a plate with four dots.
const char* const kRound =
    "name: round\nseed: 1\nduration: 10\n"
    "camera: {width: 320, height: 240, fx: 300, fy: 300, cx: 159.5, cy: 119.5, rate: 30}\n"
    "target:\n  type: dots\n  points: [[-0.15, -0.15, 0], [0.15, -0.15, 0], [0.15, 0.15, 0], "
    "[-0.15, 0.15, 0]]\n"
    "  radius: 0.03\n"
    "robot:\n  type: free\n"
    "  initial: {xyz: [-1.2, 0, 0.13], rpy: [-1.5707963267948966, 0, -1.5707963267948966]}\n"
    "sensing: {source: image, tracker: dots}\nodometry: {rate: 100}\ndepth: {initial: 2}\n"
    "control:\n  law: profile\n  profile:\n    - until: 10\n      v: [0, 0, 0, 0, 0, 0]\n"
    "      amplitude: [0.08, 0, 0.08, 0, 0, 0]\n"
    "      omega: [0.6283185307179586, 0, 0.6283185307179586, 0, 0, 0]\n"
    "      phase: [0, 0, 1.5707963267948966, 0, 0, 0]\n";
constexpr int kRate = 30, kRowRate = 100, kPeriod_s = 10;
constexpr long kRoundImages = kRate * kPeriod_s, kRoundRows = kRowRate * kPeriod_s;

double simulated_s() {
  const char* given = std::getenv("DEPTHSERVO_SOAK");
  return given ? std::atof(given) : 120;
}

void writeWhole(int file, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = write(file, bytes.data() + done, bytes.size() - done);
    ASSERT_GT(count, 0) << "whoever read has gone";
    done += static_cast<std::size_t>(count);
  }
}

/// What the kernel says of a process.
struct Usage {
  double rss_KiB = 0, cpu_s = 0;
};
Usage usageOf(pid_t id) {
  const std::filesystem::path place = "/proc/" + std::to_string(id);
  Usage usage;
  long pages = 0;
  std::ifstream(place / "statm") >> pages >> pages;
  usage.rss_KiB = static_cast<double>(pages) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1024;
  for (const auto& thread : std::filesystem::directory_iterator(place / "task")) {
    double ran_ns = 0;
    std::ifstream(thread.path() / "schedstat") >> ran_ns;
    usage.cpu_s += ran_ns / 1e9;
  }
  return usage;
}

class Soak : public testing::Test {
 protected:
  void SetUp() override {
    signal(SIGPIPE, SIG_IGN);
    folder_.write("round.yaml", kRound);
    record(path("round.yaml"), path("round"));
    const Sequence round(path("round"));
    for (long k = 0; k < kRoundImages; ++k) {
      const auto image = round.readImage(static_cast<std::size_t>(k));
      images_.push_back(fmt::format("{} {}\n255\n", image.getWidth(), image.getHeight()));
      images_.back().append(reinterpret_cast<const char*>(image.bitmap), image.getSize());
    }
    for (long k = 0; k < kRoundRows; ++k) {
      const Vector6d v = round.odometry()[static_cast<std::size_t>(k)].twist.vector();
      rows_.push_back(fmt::format("{},{},{},{},{},{}\n", v[0], v[1], v[2], v[3], v[4], v[5]));
    }
    for (const char* pipe : {"images", "twists", "commands"})
      ASSERT_EQ(mkfifo(path(pipe).c_str(), 0600), 0);
    commands_ = open(path("commands").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  }
  ~Soak() override {
    if (id_ > 0) kill(id_, SIGKILL);
    for (const int file : {imageFile_, twistFile_, commands_}) {
      if (file >= 0) close(file);
    }
  }

  std::string path(const std::string& name) const { return folder_ / name; }
  static double time(long image) { return static_cast<double>(image) / kRate; }
  long images() const { return std::lround(simulated_s() * kRate); }

  void launch(const std::string& arguments) {
    const std::string line =
        "exec " DEPTHSERVO_TOOL " " + arguments + " >" + path("out") + " 2>" + path("err");
    id_ = fork();
    if (id_ == 0) {
      execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      _exit(127);
    }
    twistFile_ = opened("twists");
    imageFile_ = opened("images");
    fcntl(imageFile_, F_SETPIPE_SZ, 1 << 20);
  }

  /// Rows up to an image, and the image.
  void feed(long image) {
    std::string rows;
    for (; fed_ * kRate <= image * kRowRate; ++fed_) {
      rows += fmt::format("{:.9f},", static_cast<double>(fed_) / kRowRate) +
              rows_[static_cast<std::size_t>(fed_ % kRoundRows)];
    }
    writeWhole(twistFile_, rows);
    writeWhole(imageFile_, fmt::format("P5\n# timestamp {:.9f}\n", time(image)) +
                               images_[static_cast<std::size_t>(image % kRoundImages)]);
    watch(image);
  }

  /// Until somebody has begun with the image that was fed.
  void waitTaken() const {
    int waiting = 1;
    while (ioctl(imageFile_, FIONREAD, &waiting) == 0 && waiting > 0) {
      ASSERT_EQ(waitpid(id_, nullptr, WNOHANG), 0) << folder_.read("err");
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  }

  /// Until the command of an image has come; its fields are checked.
  void waitCommand(long image) {
    for (;;) {
      const std::size_t end = lines_.find('\n');
      if (end == std::string::npos) {
        pollfd state{commands_, POLLIN, 0};
        ASSERT_GT(poll(&state, 1, 60'000), 0) << folder_.read("err");
        char bytes[4096];
        const ssize_t count = read(commands_, bytes, sizeof bytes);
        ASSERT_GT(count, 0) << folder_.read("err");
        lines_.append(bytes, static_cast<std::size_t>(count));
        continue;
      }
      const std::string line = lines_.substr(0, end);
      lines_.erase(0, end + 1);
      double number = 0, sent_s = 0, ttl_s = 0, image_s = 0;
      if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &number, &sent_s, &ttl_s, &image_s) < 4)
        continue;
      ASSERT_NEAR(image_s, time(image), 1e-6) << line;
      ASSERT_NEAR(sent_s, time(image), 1e-6) << line;
      return;
    }
  }

  int waitEnd() {
    close(imageFile_);
    close(twistFile_);
    imageFile_ = twistFile_ = -1;
    int status = 0;
    waitpid(id_, &status, 0);
    id_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  void expectSteady(const char* name) const {
    const double length_s = simulated_s(), first = rss_KiB_.at(60 / kWatched_s);
    const double last =
        *std::max_element(rss_KiB_.end() - static_cast<long>(rss_KiB_.size() / 10), rss_KiB_.end());
    const double early = perImage_us(1), late = perImage_us(9);
    std::cout << fmt::format(
        "{}: {} images, {:.0f} s simulated in {:.0f} s; RSS {:.0f} KiB after a minute, {:+.0f} KiB "
        "at the end; "
        "CPU per image {:.0f} us in the second tenth, {:.0f} us in the last: {:.3f}\n",
        name, images(), length_s, std::chrono::duration<double>(Clock::now() - begin_).count(),
        first, last - first, early, late, late / early);
    EXPECT_LT(last - first, 1024);
    const double most = length_s >= 3600 ? 1.25 : 2;  // of two minutes a tenth is 360 images
    EXPECT_LT(late, most * early);
    EXPECT_GT(late, early / most);
  }

  TemporaryFolder folder_;

 private:
  static constexpr int kWatched_s = 5;

  int opened(const char* pipe) const {
    int file = -1;
    while (file < 0 && waitpid(id_, nullptr, WNOHANG) == 0) {
      file = open(path(pipe).c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
      if (file < 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_GE(file, 0) << folder_.read("err");
    if (file >= 0) fcntl(file, F_SETFL, 0);
    return file;
  }

  void watch(long image) {
    if (image % kRate == 0) cpu_s_.push_back(usageOf(id_).cpu_s);
    if (image % (kRate * kWatched_s) == 0) rss_KiB_.push_back(usageOf(id_).rss_KiB);
  }
  /// In the quickest second of a tenth: that of other programs on the machine is no matter.
  double perImage_us(std::size_t tenth) const {
    const std::size_t seconds = cpu_s_.size() - 1;
    double least_s = HUGE_VAL;
    for (std::size_t k = tenth * seconds / 10; k < (tenth + 1) * seconds / 10; ++k) {
      least_s = std::min(least_s, cpu_s_.at(k + 1) - cpu_s_.at(k));
    }
    return 1e6 * least_s / kRate;
  }

  std::vector<std::string> images_, rows_;  // of one round
  pid_t id_ = -1;
  int imageFile_ = -1, twistFile_ = -1, commands_ = -1;
  long fed_ = 0;  // rows
  std::string lines_;
  std::vector<double> cpu_s_, rss_KiB_;
  Clock::time_point begin_ = Clock::now();
};

TEST_F(Soak, of_live_changes_nothing) {
  launch("live --source " + path("images") + " --twist " + path("twists") +
         " --rows hold --patience 60 --camera " + path("round/camera.yaml") + " --target " +
         path("round/sequence.yaml") + " --no-window --json --tum " + path("trajectory"));
  for (long k = 0; k < images(); ++k) {
    ASSERT_NO_FATAL_FAILURE(feed(k));
    ASSERT_NO_FATAL_FAILURE(waitTaken());
  }
  expectSteady("live");
  EXPECT_EQ(waitEnd(), 0) << folder_.read("err");
  const auto metrics = nlohmann::json::parse(folder_.read("out"))["metrics"];
  EXPECT_GE(metrics["frames"], 0.9 * static_cast<double>(images()))
      << "who is busy leaves some out";
  std::ifstream rows(path("trajectory"));
  std::string row;
  long count = 0;
  for (long k = 0; std::getline(rows, row);) {
    if (row[0] == '#') continue;
    const std::string stamp = row.substr(0, row.find(' '));
    while (k < images() && fmt::format("{:.9f}", time(k)) != stamp) ++k;
    ASSERT_LT(k, images()) << stamp << " is the time of no image after the one before";
    ++k;
    ++count;
  }
  EXPECT_EQ(count, metrics["frames"]);
}

/// It is armed, and what it commands is not done: it never arrives.
TEST_F(Soak, of_servo_changes_nothing) {
  record(path("round.yaml") +
             " --set duration=0.02 --set 'robot.initial={xyz: [-0.8, 0.1, 0.13], rpy: "
             "[-1.5707963267948966, 0, "
             "-1.5707963267948966]}'",
         path("there"));
  ASSERT_EQ(depthservo("teach --source " + path("there/rgb/000001.png") + " --camera " +
                       path("there/camera.yaml") + " --tracker dots --out " + path("goal"))
                .exitCode,
            0);
  launch("servo --lockstep --arm --json --rows hold --prior 1 --goal " + path("goal") +
         " --robot " + data("servo/omni.yaml") + " --source " + path("images") + " --twist " +
         path("twists") + " --command " + path("commands") + " --patience 60");
  for (long k = 0; k < images(); ++k) {
    ASSERT_NO_FATAL_FAILURE(feed(k));
    ASSERT_NO_FATAL_FAILURE(waitCommand(k));
  }
  expectSteady("servo");
  EXPECT_EQ(waitEnd(), 4) << "without a camera it stops for safety" << folder_.read("err");
  const auto told = nlohmann::json::parse(folder_.read("out"));
  EXPECT_GE(told["images"]["taken"], images() - 1) << "the first may come before its odometry";
  EXPECT_EQ(told["images"]["skipped"], 0);
  EXPECT_EQ(told["commands"]["not_written"], 0);
}

}  // namespace
}  // namespace depthservo::test
