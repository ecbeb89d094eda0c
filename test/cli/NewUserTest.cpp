// What helps somebody who has just installed the tool: a scenario to begin with, pages, completion,
// quiet.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "cli/Tool.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) all.push_back(line);
  return all;
}

TEST(NewUser, every_new_scenario_reaches_its_goal) {
  const TemporaryFolder folder;
  for (const char* robot : {"unicycle", "omni", "free"}) {
    for (const char* target : {"dots", "apriltag"}) {
      for (const char* distance : {"1.5", "6"}) {
        const std::string file = folder / (std::string(robot) + target + distance + ".yaml");
        const Result written = depthservo("new " + file + " --robot " + robot + " --target " +
                                          target + " --distance " + distance);
        ASSERT_EQ(written.exitCode, 0) << written.err;
        const Result run = depthservo("run " + file + " --json --set sensing.source=geometry");
        EXPECT_EQ(run.json()["outcome"], "converged") << file << run.err;
      }
    }
  }
}

TEST(NewUser, new_without_a_terminal_takes_the_defaults_and_never_overwrites) {
  const TemporaryFolder folder;
  const std::string file = folder / "mine.yaml";
  EXPECT_EQ(depthservo("new " + file + " < /dev/null").exitCode, 0);
  expectRefused(depthservo("new " + file), {"mine.yaml"});
  expectRefused(depthservo("new " + (folder / "b.yaml").string() + " --robot unicyle"),
                {"--robot", "unicycle"});
  expectRefused(depthservo("new " + (folder / "b.yaml").string() + " --distance 60"),
                {"--distance", "1.5 to 6"});
  EXPECT_FALSE(std::ifstream(folder / "b.yaml").is_open());
}

TEST(NewUser, quiet_says_nothing_but_why_it_failed) {
  const std::string scenario =
      "run unicycle-4dots --set sensing.source=geometry --set duration=0.2 --set expect=null";
  const Result loud = depthservo(scenario + " --json"),
               quiet = depthservo(scenario + " --json --quiet");
  EXPECT_NE(loud.err, "");
  EXPECT_EQ(quiet.err, "");
  EXPECT_EQ(quiet.out, loud.out);
  expectRefused(depthservo("run unicycle-4dot --quiet"), {"did you mean 'unicycle-4dots'"});
  expectRefused(depthservo("run unicycle-4dots --quiet --sed"), {"--set"});
}

TEST(NewUser, near_words_are_named) {
  expectRefused(depthservo("replya x"), {"did you mean 'replay'"});
  expectRefused(depthservo("run unicycle-4dots.yml"), {"unicycle-4dots"});
  expectRefused(depthservo("describe manual"), {"man"});
}

TEST(NewUser, pages_and_completion_have_every_option_of_help) {
  const Result commands = depthservo("describe commands");
  const std::string bash = depthservo("describe bash").out, zsh = depthservo("describe zsh").out;
  EXPECT_EQ(zsh.rfind("#compdef depthservo\n", 0), 0u);
  ASSERT_GT(lines(commands.out).size(), 15u);
  for (const std::string& command : lines(commands.out)) {
    const std::string help = depthservo(command + " --help").out;
    const std::string page = depthservo("describe man " + command).out;
    EXPECT_NE(page.find(".SH OPTIONS"), std::string::npos) << command;
    for (const std::string& line : lines(help)) {
      const std::size_t at = line.find("--");
      if (at == std::string::npos || line.find_first_not_of(' ') > 3) continue;
      const std::string option = line.substr(at, line.find_first_of(" ,", at) - at);
      EXPECT_NE(bash.find(option), std::string::npos) << command << option;
      std::string inPage;
      for (const char c : option) inPage += c == '-' ? std::string("\\-") : std::string(1, c);
      EXPECT_NE(page.find(inPage), std::string::npos) << command << option;
    }
  }
}

TEST(NewUser, bash_completes_commands_options_values_and_names) {
  const TemporaryFolder folder;
  const std::string script = folder / "completion";
  std::ofstream(script) << depthservo("describe bash").out;
  const auto completed = [&](const std::string& words, int place) {
    const std::string command = "PATH=$(dirname " DEPTHSERVO_TOOL "):$PATH bash -c '. " + script +
                                "; COMP_WORDS=(depthservo " + words +
                                ") COMP_CWORD=" + std::to_string(place) +
                                "; _depthservo; echo ${COMPREPLY[*]}' > " + script + ".out";
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::ifstream stream(script + ".out");
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  EXPECT_EQ(completed("rep", 1), "replay report reproduce\n");
  EXPECT_EQ(completed("replay --pri", 2), "--prior\n");
  EXPECT_NE(completed("replay --tracker d", 3).find("dots"), std::string::npos);
  EXPECT_NE(completed("run unicycle-4dots-h", 2).find("unicycle-4dots-hidden"), std::string::npos);
}

}  // namespace
}  // namespace depthservo::test
