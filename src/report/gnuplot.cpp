#include "report/gnuplot.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <iterator>

#include "text/TextFile.h"

namespace depthservo::gnuplot {

const char* colour(std::size_t index) { return kColours[index % std::size(kColours)]; }

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "NaN";
}

std::string dataBlock(const std::string& name, const std::vector<std::vector<double>>& columns) {
  std::string block = "$" + name + " << EOD\n";
  for (std::size_t row = 0; row < columns.front().size(); ++row) {
    for (const auto& column : columns) block += number(column[row]) + ' ';
    block += '\n';
  }
  return block + "EOD\n";
}

std::string quoted(std::string_view text) {
  std::string quoted = "'";
  while (!text.empty()) {
    const std::size_t length = detail::utf8Length(text);
    const auto first = static_cast<unsigned char>(text.front());
    const bool isControl = first < 0x20 || first == 0x7f;
    if (length == 0) {
      quoted += "\xef\xbf\xbd";
    } else if (isControl) {
      quoted += ' ';
    } else if (text.front() == '\'') {
      quoted += "''";
    } else {
      quoted += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return quoted + "'";
}

std::string page(const std::string& file, int width_px, int height_px) {
  return fmt::format(
      "set terminal pngcairo noenhanced size {},{} font 'DejaVu Sans,11' linewidth 1.4\n"
      "set output {}\n"
      "set border 3 linecolor rgb '#606060'\nset tics nomirror out scale 0.5 textcolor rgb "
      "'black'\n"
      "set grid linetype 1 linewidth 0.4 linecolor rgb '#D8D8D8'\n"
      "set key top right noautotitle samplen 2 spacing 1.1\n",
      width_px, height_px, gnuplot::quoted(file));
}

bool run(const std::filesystem::path& folder, const std::string& script) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
  }
  std::string arguments[] = {"gnuplot", "--default-settings", script};
  char* argv[] = {arguments[0].data(), arguments[1].data(), arguments[2].data(), nullptr};
  pid_t child = 0;
  const int failure = posix_spawnp(&child, argv[0], &actions, nullptr, argv, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) return false;
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return false;
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace depthservo::gnuplot
