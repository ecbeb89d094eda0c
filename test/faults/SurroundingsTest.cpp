// What surrounds the tool is not as usual: few files, little memory, another language, a clock that
// jumps, a second one in the same place, names of any kind, enormous input.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "faults/Faults.h"
#include "sequence/bagParts.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

namespace fs = std::filesystem;

const std::string kScenario = data("scenarios/unicycle-4dots.yaml") + " --set expect=null";
const std::string kPoints = kScenario + " --set sensing.source=geometry --set duration=0.2";

const char* const kSweep =
    "name: short\ntitle: A short one\nset: [sensing.source=geometry, duration=0.2, expect=null, "
    "camera.rate=10]\n"
    "axes: [{name: estimator, key: depth.estimator, values: [filter, constant]}]\n"
    "success: [timeout, converged]\nworst: 0\n";

class Surroundings : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_ / name; }
  void writeSweep() const {
    folder_.write("sweep.yaml",
                  kSweep + ("scenario: " + data("scenarios/unicycle-4dots.yaml")) + "\n");
  }

  /// A clear end: as usual, or told in one line. Libraries may fail before main.
  static void expectClearEnd(const Result& result) {
    const auto says = [&](const char* words) {
      return result.err.find(words) != std::string::npos;
    };
    const bool isBeforeMain =
        (result.exitCode == 127 && says("shared libraries")) ||
        (result.exitCode == 1 && says("Operating system error"));  // Fortran's
    const bool isGsl = result.exitCode == 134 && says("Default GSL error handler");  // ViSP's
    if (isBeforeMain || isGsl) return;
    EXPECT_TRUE(result.exitCode == 0 || result.exitCode == 2 || result.exitCode == 70)
        << result.exitCode << ": " << result.err;
    EXPECT_EQ(result.err.find("terminate"), std::string::npos) << result.err;
    if (result.exitCode == 0) return;
    EXPECT_GT(result.err.size(), 10u);
    EXPECT_EQ(result.err.find("no such"), std::string::npos) << "it is there: " << result.err;
  }

  TemporaryFolder folder_;
};

TEST_F(Surroundings, with_few_open_files_end_clearly) {
  record(kScenario + " --set duration=0.1", file("sequence"));
  writeSweep();
  int done = 0;
  for (int files = 4; files <= 9; ++files) {
    const std::string limit = fmt::format("prlimit --nofile={} env PATH=/nowhere", files),
                      n = std::to_string(files);
    for (const std::string& command :
         {"run " + kPoints + " --out " + file("run" + n),
          "replay " + file("sequence") + " --out " + file("replay" + n),
          "sweep " + file("sweep.yaml") + " --jobs 2 --out " + file("sweep" + n)}) {
      SCOPED_TRACE(limit + " " + command);
      const Result result = depthservo(command, limit);
      expectClearEnd(result);
      done += result.exitCode == 0;
    }
  }
  EXPECT_GT(done, 0) << "never enough";
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_NE(entry.path().filename().string()[0], '.') << entry.path();
  }
}

TEST_F(Surroundings, with_little_memory_end_clearly) {
  record(kScenario + " --set duration=0.1", file("sequence"));
  writeSweep();
  int done = 0, short_of = 0;
  for (int MB = 84; MB <= (areAllTried() ? 400 : 156); MB += areAllTried() ? 2 : 12) {
    const std::string limit = fmt::format("ulimit -v {};", 1024 * MB), n = std::to_string(MB);
    const bool starts = depthservo("--version", limit + "PATH=/nowhere").exitCode == 0;
    if (!starts) continue;  // its libraries alone take more: nothing of ours runs yet
    for (const std::string& command :
         {"run " + kPoints + " --out " + file("run" + n), "replay " + file("sequence"),
          "sweep " + file("sweep.yaml") + " --jobs 4 --out " + file("sweep" + n)}) {
      SCOPED_TRACE(limit + " " + command);
      const Result result = depthservo(command, limit + "PATH=/nowhere");
      expectClearEnd(result);
      done += result.exitCode == 0;
      short_of += result.exitCode == 70;
    }
  }
  EXPECT_GT(done, 0) << "never enough";
  EXPECT_TRUE(short_of > 0 || !areAllTried()) << "always enough";
}

TEST_F(Surroundings, of_another_language_time_zone_or_home_change_no_byte) {
  const std::string place = file("locales/de_DE.UTF-8");
  fs::create_directory(folder_ / "locales");
  const bool hasGerman =
      std::system(("localedef -i de_DE -f UTF-8 " + place + " >/dev/null 2>&1").c_str()) == 0;
  const std::string german = "LOCPATH=" + file("locales") + " LC_ALL=de_DE.UTF-8 ";
  record(kScenario + " --set duration=0.1", file("sequence"));
  const auto made = [&](const std::string& name, const std::string& before) {
    fs::create_directory(folder_ / name);
    const std::string out = file(name) + "/";
    for (const std::string& command :
         {"run " + kPoints + " --out " + out + "run", "target dots --out " + out + "dots.pdf",
          "replay " + file("sequence") + " --out " + out + "replay --tum " + out + "tum.txt"}) {
      const Result result = depthservo(command, before);
      EXPECT_EQ(result.exitCode, 0) << before << command << "\n" << result.err;
    }
    Tree tree;
    for (auto& [path, bytes] : treeOf(file(name))) {
      tree[path] = path.find("report.html") == std::string::npos ? bytes : "";  // shows its place
    }
    return tree;
  };
  const Tree usual = made("usual", "PATH=/nowhere");
  EXPECT_GT(usual.size(), 10u);
  const auto expectUsual = [&](const std::string& name, const std::string& before) {
    for (const auto& [path, bytes] : made(name, before)) {
      EXPECT_TRUE(usual.count(path) == 1 && usual.at(path) == bytes) << name << "/" << path;
    }
  };
  expectUsual("empty", "/usr/bin/env -i PATH=/nowhere");
  expectUsual("homeless", "HOME=/nowhere XDG_CACHE_HOME=/nowhere PATH=/nowhere");
  expectUsual("elsewhere", "TZ=Asia/Kathmandu PATH=/nowhere");
  if (!hasGerman) GTEST_SKIP() << "localedef cannot make de_DE.UTF-8: Debian package locales";
  ASSERT_EQ(std::system((german + "/usr/bin/printf %.1f 1,5 >" + file("comma")).c_str()), 0);
  ASSERT_EQ(folder_.read("comma"), "1,5");
  expectUsual("german",
              german + "FAULTS_LOCALE=1 LD_PRELOAD=" DEPTHSERVO_INTERPOSED " PATH=/nowhere");
}

/// gnuplot reads the numbers that are written for it.
TEST_F(Surroundings, with_a_decimal_comma_draw_the_same_plots) {
  if (std::system("command -v gnuplot >/dev/null") != 0) GTEST_SKIP() << "no gnuplot";
  fs::create_directory(folder_ / "locales");
  const std::string place = file("locales/de_DE.UTF-8");
  if (std::system(("localedef -i de_DE -f UTF-8 " + place + " >/dev/null 2>&1").c_str()) != 0) {
    GTEST_SKIP() << "localedef cannot make de_DE.UTF-8: Debian package locales";
  }
  ASSERT_EQ(depthservo("run " + kPoints + " --out " + file("usual")).exitCode, 0);
  ASSERT_EQ(depthservo("run " + kPoints + " --out " + file("german"),
                       "LOCPATH=" + file("locales") + " LC_ALL=de_DE.UTF-8")
                .exitCode,
            0);
  for (const char* plot : {"depth.png", "error.png", "image.png"}) {
    EXPECT_GT(folder_.read(std::string("usual/") + plot).size(), 1000u);
    EXPECT_EQ(folder_.read(std::string("german/") + plot),
              folder_.read(std::string("usual/") + plot));
  }
}

TEST_F(Surroundings, with_a_clock_that_jumps_change_nothing_live) {
  record(kScenario + " --set duration=0.5", file("sequence"));
  ASSERT_EQ(mkfifo(file("twists").c_str(), 0600), 0);
  const auto live = [&](const std::string& out, const std::string& before) {
    const Result result = depthservo(
        "live --source '" + file("sequence") + "/rgb/%06d.png' --times " + file("sequence") +
            "/rgb.txt --start 99 --no-window --camera " + file("sequence") +
            "/camera.yaml --target " + file("sequence") + "/sequence.yaml --rows hold --twist " +
            file("twists") + " --out " + file(out),
        "cat " + file("sequence") + "/twist.csv >" + file("twists") + " & PATH=/nowhere " + before);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return folder_.read(out + "/features.csv");
  };
  const std::string usual = live("usual", "");
  EXPECT_GT(usual.size(), 1000u);
  for (const char* step_s : {"3600", "-86400", "0.5"}) {
    EXPECT_EQ(live("jumping" + std::string(step_s),
                   "LD_PRELOAD=" DEPTHSERVO_INTERPOSED " FAULTS_CLOCK=" + std::string(step_s)),
              usual)
        << step_s;
  }
}

/// Every second write and read of files and pipes: by a signal, or done in part.
TEST_F(Surroundings, that_interrupt_or_shorten_calls_change_no_byte) {
  record(kScenario + " --set duration=0.3", file("sequence"));
  ASSERT_EQ(mkfifo(file("twists").c_str(), 0600), 0);
  writeSweep();
  fs::copy(data("../test/sequence/bags/lz4.bag"), folder_ / "drive.bag");
  const std::string usual = " PATH=/nowhere ";
  const auto madeIn = [&](const std::string& place, const std::string& environment) {
    fs::create_directory(folder_ / place);
    const auto in = [&](const std::string& leaf) { return file(place + "/" + leaf); };
    const std::string live =
        "live --source '" + file("sequence") + "/rgb/%06d.png' --times " + file("sequence") +
        "/rgb.txt --no-window --camera " + file("sequence") + "/camera.yaml --target " +
        file("sequence") + "/sequence.yaml --rows hold --twist " + file("twists") + " --out ";
    const std::string rows = "cat " + file("sequence/twist.csv") + " >" + file("twists") + " & ";
    for (const auto& [command, before] : std::vector<std::pair<std::string, std::string>>{
             {live + in("live"), rows},
             {"run " + kPoints + " --mcap " + in("x.mcap") + " --out " + in("run"), ""},
             {"replay " + file("sequence") + " --out " + in("replay"), ""},
             {"sweep " + file("sweep.yaml") + " --jobs 1 --out " + in("sweep"), ""},
             {"replay " + file("drive.bag") + " --tracker klt --out " + in("bag"), ""}}) {
      const Result result = depthservo(command, before + environment);
      EXPECT_EQ(result.exitCode, 0) << command << "\n" << result.err;
    }
    Tree tree = treeOf(folder_ / place);
    for (auto& entry : tree) {  // it says where it is
      for (std::size_t at = 0; (at = entry.second.find(place + "/", at)) != std::string::npos;) {
        entry.second.erase(at, place.size());
      }
    }
    return tree;
  };
  const Tree expected = madeIn("usual", usual);
  EXPECT_GT(expected.size(), 10u);
  for (const std::string kind : {"often-interrupted", "often-short"}) {
    EXPECT_TRUE(madeIn(kind, usual + faultAt(0, kind, folder_.path().string(), "") + " ") ==
                expected)
        << kind;
  }
}

TEST_F(Surroundings, shared_by_two_at_once_give_the_folder_to_one) {
  writeSweep();
  const auto both = [&](const std::string& command) {
    const std::string one = std::string(DEPTHSERVO_TOOL) + " " + command + " 2>" + file("err");
    const std::string line = "(" + one + "1; echo $? >" + file("a") + ") & (" + one +
                             "2; echo $? >" + file("b") + "); wait";
    EXPECT_EQ(std::system(("PATH=/usr/bin:/bin; " + line).c_str()), 0);
    return folder_.read("a")[0] + std::string() + folder_.read("b")[0];
  };
  for (int i = 0; i < (areAllTried() ? 20 : 3); ++i) {
    const std::string n = std::to_string(i);
    for (const std::string& command :
         {"run " + kPoints + " --out " + file("run" + n),
          "record " + kPoints + " " + file("record" + n), "new " + file("new" + n + ".yaml")}) {
      const std::string codes = both(command);
      EXPECT_TRUE(codes == "02" || codes == "20")
          << command << ": " << codes << folder_.read("err1") << folder_.read("err2");
    }
    EXPECT_TRUE(fs::exists(folder_ / ("run" + n) / "report.html"));
    EXPECT_TRUE(fs::exists(folder_ / ("record" + n) / "tracks.csv"));
    const std::string sweep = "sweep " + file("sweep.yaml") + " --out " + file("sweep" + n);
    const std::string codes = both(sweep);
    EXPECT_NE(codes.find('0'), std::string::npos)
        << codes << folder_.read("err1") << folder_.read("err2");
    EXPECT_EQ(depthservo(sweep).exitCode, 0);
    EXPECT_EQ(readCsv(file("sweep" + n + "/runs.csv")).at("row").size(), 2u);
  }
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_NE(entry.path().filename().string()[0], '.') << entry.path();
  }
}

/// Replay and compare: Names.of_folders_are_never_executed.
TEST_F(Surroundings, named_in_any_way_are_written_and_read) {
  record(kScenario + " --set duration=0.1", file("s"));
  record(data("scenarios/free-general.yaml") + " --set duration=1.2", file("drive"));
  for (const std::string name : {"a b", "it's \"quoted\" \\ $HOME",
                                 "Gr\xc3\xbc\xc3\x9f"
                                 "e \xe6\x97\xa5\xe6\x9c\xac",
                                 "line\nbreak", "-dash", "caf\xe9"}) {
    const std::string place = folder_ / name;
    fs::create_directory(place);
    const auto in = [&](const std::string& leaf) { return quoted(place + "/" + leaf); };
    fs::copy(folder_ / "s", place + "/s", fs::copy_options::recursive);
    std::ofstream(place + "/sweep.yaml")
        << kSweep << "scenario: " << data("scenarios/unicycle-4dots.yaml") << "\n";
    for (const std::string& command :
         {"run " + kPoints + " --out " + in("run"), "report " + in("run"),
          "record " + kPoints + " " + in("record"), "info " + in("s"),
          "sweep " + in("sweep.yaml") + " --out " + in("sweep"),
          "target dots --out " + in("dots.pdf"), "new " + in("new.yaml"),
          "calibrate " + quoted(file("drive")) + " --out " + in("profile.yaml"),
          "replay " + in("s") + " --baseline " + in("baseline.json") + " --update",
          "teach --source " + in("s/rgb/000001.png") + " --camera " + in("s/camera.yaml") +
              " --tracker dots --out " + in("goal")}) {
      const Result result = depthservo(command, "PATH=/nowhere");
      EXPECT_EQ(result.exitCode, 0) << command << "\n" << result.err;
    }
    for (const char* made : {"run/report.html", "record/tracks.csv", "sweep/runs.csv", "dots.pdf",
                             "new.yaml", "profile.yaml", "baseline.json", "goal/camera.yaml"}) {
      EXPECT_TRUE(fs::exists(place + "/" + made)) << place << " " << made;
    }
  }
}

double usedByChildren_s() {
  rusage usage;
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// Greatest resident memory of any child so far.
double greatestOfChildren_MB() {
  rusage usage;
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

TEST_F(Surroundings, with_long_tables_take_time_and_memory_in_proportion) {
  record(kPoints, file("s"));
  const std::string head = folder_.read("s/twist.csv");
  const auto replayed_s = [&](int rows) {
    {
      std::ofstream table(folder_ / "s/twist.csv", std::ios::binary);
      table << head;
      std::string block;
      for (int i = 0; i < rows; ++i) {
        block += fmt::format("{:.6f},0.1,0.01,0.2,0.001,0.02,0.003\n", 10 + 1e-5 * i);
        if (block.size() < 1 << 20) continue;
        table << block;
        block.clear();
      }
      table << block;
    }
    const double before_s = usedByChildren_s();
    const Result result = depthservo("replay " + file("s"), "PATH=/nowhere");
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return usedByChildren_s() - before_s;
  };
  const int few = areAllTried() ? 1000000 : 100000;
  const double little_s = replayed_s(few), much_s = replayed_s(10 * few);
  constexpr double kStartUp_s = 0.1;
  EXPECT_LT(much_s, 15 * (little_s + kStartUp_s));
  const double perRow = greatestOfChildren_MB() * 1048576 / (10.0 * few);
  EXPECT_LT(perRow, 400) << "bytes per row";
  RecordProperty("seconds", std::to_string(much_s));
  RecordProperty("bytes_per_row", std::to_string(perRow));
}

std::string bigEndian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i));
  return text;
}

std::string pngChunk(const std::string& typeAndData) {
  const auto crc =
      static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(typeAndData.data()),
                                       static_cast<uInt>(typeAndData.size())));
  return bigEndian(static_cast<std::uint32_t>(typeAndData.size() - 4), 4) + typeAndData +
         bigEndian(crc, 4);
}

/// Images of 60000 x 60000 pixels, in few bytes.
std::map<std::string, std::string> bombs() {
  const std::string header =
      "IHDR" + bigEndian(60000, 4) + bigEndian(60000, 4) + std::string("\x08\0\0\0\0", 5);
  return {
      {"png", "\x89PNG\r\n\x1a\n" + pngChunk(header) + pngChunk("IDAT\x78\x9c") + pngChunk("IEND")},
      {"jpeg", std::string("\xff\xd8\xff\xc0\0\x0b\x08", 7) + bigEndian(60000, 2) +
                   bigEndian(60000, 2) + std::string("\x01\x01\x11\0", 4) +
                   std::string("\xff\xda\0\x08\x01\x01\0\0\x3f\0", 10) + "\xff\xd9"},
      {"pgm", "P5\n60000 60000\n255\n\x01\x02"}};
}

/// One line, and no memory for what the header promises: with the 3.6 GB of it this would end
/// otherwise.
TEST_F(Surroundings, with_images_that_promise_gigabytes_are_refused_by_their_header) {
  const std::string limit = "ulimit -v 1500000;";
  record(kScenario + " --set duration=0.1", file("s"));
  for (const auto& [format, bytes] : bombs()) {
    SCOPED_TRACE(format);
    folder_.write("s/rgb/000001.png", bytes);
    folder_.write("bomb." + format, bytes);
    for (const std::string& command :
         {"replay " + file("s"), "noise " + file("s"), "compare " + file("s"),
          "teach --source " + file("bomb." + format) + " --camera " + file("s/camera.yaml") +
              " --tracker dots --out " + file("goal")}) {
      const Result result = depthservo(command, limit);
      EXPECT_EQ(result.exitCode, 2) << command << "\n" << result.err;
      EXPECT_NE(result.err.find("60000"), std::string::npos) << command << "\n" << result.err;
    }
  }
}

TEST_F(Surroundings, with_bags_of_images_that_promise_gigabytes_are_refused) {
  const auto bag = [&](const std::string& type, const std::string& message) {
    folder_.write(
        "bomb.mcap",
        McapParts::file(McapParts::channel(1, "/image", type) +
                        McapParts::channel(2, "/info", "sensor_msgs/msg/CameraInfo") +
                        McapParts::channel(3, "/twist", "geometry_msgs/msg/TwistStamped") +
                        McapParts::message(2, 1, infoMessage(1)) +
                        McapParts::message(3, 1, twistStamped(1, "camera", {0, 0, 0, 0, 0, 0})) +
                        McapParts::message(1, 1, message) +
                        McapParts::message(3, 2, twistStamped(2, "camera", {0, 0, 0, 0, 0, 0}))));
    const Result result =
        depthservo("replay " + file("bomb.mcap") + " --tracker klt", "ulimit -v 1500000;");
    EXPECT_EQ(result.exitCode, 2) << result.err;
    EXPECT_NE(result.err.find("bomb.mcap"), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  for (const auto& [format, bytes] : bombs()) {
    if (format == "pgm") continue;  // no CompressedImage has it
    const std::string err =
        bag("sensor_msgs/msg/CompressedImage", Cdr().header(1, "camera").text(format).blob(bytes));
    EXPECT_NE(err.find("60000"), std::string::npos) << format << ": " << err;
  }
  bag("sensor_msgs/msg/Image", Cdr()
                                   .header(1, "camera")
                                   .number(60000u)
                                   .number(60000u)
                                   .text("mono8")
                                   .number(std::uint8_t{0})
                                   .number(60000u)
                                   .blob("few"));
}

/// A disk that is full behind `>`, or whoever read has gone.
TEST_F(Surroundings, that_take_no_output_are_told) {
  for (const std::string& command :
       {"run " + kPoints + " --json", std::string("keys"), std::string("--help"),
        std::string("--version"),
        std::string("gains --law observer --fps 30 --kappa 0.1 --json")}) {
    const std::string line =
        std::string(DEPTHSERVO_TOOL) + " " + command + " >/dev/full 2>" + file("err");
    const int status = std::system(line.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 2) << command;
    EXPECT_NE(folder_.read("err").find("standard output: cannot be written: No space"),
              std::string::npos)
        << command << folder_.read("err");
  }
}

/// `ulimit -f`: the system sends a signal, too.
TEST_F(Surroundings, with_a_limit_for_files_leave_nothing) {
  const Result result = depthservo("run " + kPoints + " --out " + file("run"), "ulimit -f 4;");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.err.find("run/"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("File too large"), std::string::npos) << result.err;
  EXPECT_TRUE(folder_.isEmpty());
}

}  // namespace
}  // namespace depthservo::test
