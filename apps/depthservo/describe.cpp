#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "commands.h"
#include "observation.h"
#include "scenarioFile.h"

namespace depthservo {
namespace {

/// Subcommands that --help names.
std::vector<CLI::App*> commandsOf(CLI::App& app) {
  return app.get_subcommands([](const CLI::App* sub) { return !sub->get_group().empty(); });
}

std::vector<const CLI::Option*> optionsOf(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_positional(); });
}

std::string words(const CLI::App& command) {
  std::vector<std::string> all;
  for (const CLI::Option* option : optionsOf(command)) {
    for (const std::string& name : option->get_lnames()) all.push_back("--" + name);
  }
  return fmt::format("{}", fmt::join(all, " "));
}

/// The words that an option's text lists: "dots | apriltag (default) | klt".
std::string choices(const CLI::Option& option) {
  std::vector<std::string> found;
  const std::string& text = option.get_description();
  for (std::size_t at = 0, bar; (bar = text.find(" | ", at)) != std::string::npos; at = bar + 3) {
    const auto isWord = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-';
    };
    std::string before = text.substr(at, bar - at);
    if (const std::size_t comment = before.find(" ("); comment != std::string::npos)
      before.resize(comment);
    std::size_t first = before.size();
    while (first > 0 && isWord(before[first - 1])) --first;
    found.push_back(before.substr(first));
    const std::string after = text.substr(bar + 3);
    if (after.find(" | ") == std::string::npos) {
      found.push_back(after.substr(
          0, static_cast<std::size_t>(std::find_if_not(after.begin(), after.end(), isWord) -
                                      after.begin())));
    }
  }
  return fmt::format("{}", fmt::join(found, " "));
}

/// One function for bash, which zsh can use, too.
std::string completion(CLI::App& app) {
  std::vector<std::string> names;
  std::string options, values;
  for (const CLI::App* command : commandsOf(app)) {
    names.push_back(command->get_name());
    options += fmt::format("    {}) words='{}' ;;\n", command->get_name(), words(*command));
    for (const CLI::Option* option : optionsOf(*command)) {
      const std::string valid = choices(*option);
      if (valid.empty() || option->get_lnames().empty()) continue;
      values += fmt::format("    {}:--{}) words='{}' ;;\n", command->get_name(),
                            option->get_lnames().front(), valid);
    }
  }
  return fmt::format(R"(# Completion of depthservo, made by `depthservo describe bash`.
_depthservo() {{
  local command=${{COMP_WORDS[1]}} word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} words=
  if [[ $COMP_CWORD -eq 1 ]]; then
    COMPREPLY=($(compgen -W '{} {}' -- "$word"))
    return
  fi
  case $command:$before in
{}  esac
  if [[ -z $words && $word == -* ]]; then
    case $command in
{}    esac
  elif [[ -z $words ]]; then
    case $command in
      run|record|compare|robot) words=$(depthservo describe scenarios 2> /dev/null) ;;
      sweep) words=$(depthservo describe sweeps 2> /dev/null) ;;
    esac
    COMPREPLY=($(compgen -W "$words" -- "$word") $(compgen -f -- "$word"))
    return
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o filenames -F _depthservo depthservo
)",
                     fmt::join(names, " "), words(app), values, options);
}

std::string zshCompletion(CLI::App& app) {
  return "#compdef depthservo\nautoload -U +X bashcompinit && bashcompinit\n" + completion(app) +
         "_bash_complete -o filenames -F _depthservo\n";
}

/// For troff: nothing in it is a command or a hyphen to break a word at.
std::string escaped(const std::string& text) {
  std::string result;
  bool isLineStart = true;
  for (const char c : text) {
    if (isLineStart && (c == '.' || c == '\'')) result += "\\&";
    result += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
    isLineStart = c == '\n';
  }
  return result;
}

std::string manOption(const CLI::Option& option) {
  const std::string name =
      option.get_positional() ? option.get_name(true) : option.get_name(false, true);
  const std::string type = option.get_positional() || option.get_expected_max() == 0
                               ? ""
                               : " \\fI" + escaped(option.get_type_name()) + "\\fR";
  return fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", escaped(name), type,
                     escaped(option.get_description()));
}

std::string manOptions(const CLI::App& app) {
  std::string arguments, options;
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? arguments : options) += manOption(*option);
  }
  return (arguments.empty() ? "" : ".SH ARGUMENTS\n" + arguments) + ".SH OPTIONS\n" + options;
}

std::string manHead(const std::string& page, const std::string& what, const std::string& synopsis) {
  return fmt::format(
      ".TH {} 1 \"\" \"depthservo {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n.B "
      "{}\n",
      page, DEPTHSERVO_VERSION, escaped(page), escaped(what), escaped(synopsis));
}

/// The page of the whole tool, or of one subcommand.
std::string manPage(CLI::App& app, const std::string& name) {
  if (name.empty()) {
    const std::string& text = app.get_description();
    const std::size_t end = text.find(".\n");
    std::string page = manHead("depthservo", text.substr(0, end), "depthservo COMMAND [OPTIONS]");
    page += ".SH DESCRIPTION\n.nf\n" + escaped(text.substr(end + 3)) + "\n.fi\n.SH COMMANDS\n";
    for (const CLI::App* command : commandsOf(app)) {
      page += fmt::format(".TP\n\\fBdepthservo\\-{}\\fR(1)\n{}\n", escaped(command->get_name()),
                          escaped(command->get_description()));
    }
    return page + manOptions(app);
  }
  const std::vector<CLI::App*> commands = commandsOf(app);
  const auto found = std::find_if(commands.begin(), commands.end(),
                                  [&](const CLI::App* c) { return c->get_name() == name; });
  if (found == commands.end())
    refuseOption("describe man", fmt::format("'{}' is not a command", name));
  const CLI::App* command = *found;
  std::string synopsis = "depthservo " + name + " [OPTIONS]";
  for (const CLI::Option* option : command->get_options()) {
    if (option->get_positional()) {
      synopsis += option->get_required() ? " " + option->get_name(true)
                                         : " [" + option->get_name(true) + "]";
    }
  }
  return manHead("depthservo-" + name, command->get_description(), synopsis) +
         manOptions(*command) + ".SH SEE ALSO\n.BR depthservo (1)\n";
}

std::string commandNames(CLI::App& app) {
  std::string names;
  for (const CLI::App* command : commandsOf(app)) names += command->get_name() + "\n";
  return names;
}

}  // namespace

void addDescribe(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("describe",
                                         "This tool for others: its man pages, its completion for "
                                         "bash and zsh, names of what is shipped");
  struct Arguments {
    std::string what, command;
  };
  auto a = std::make_shared<Arguments>();
  command->add_option("WHAT", a->what, "bash | zsh | man | commands | scenarios | sweeps")
      ->required();
  command->add_option("COMMAND", a->command,
                      "Of man: the command of the page; none: the tool's own");
  command->callback([a, &app] {
    const std::vector<std::string> all{"bash", "zsh", "man", "commands", "scenarios", "sweeps"};
    if (std::find(all.begin(), all.end(), a->what) == all.end())
      refuseWord("describe", a->what, all);
    if (a->what == "scenarios" || a->what == "sweeps") {
      for (const std::string& name : shippedNames(a->what)) fmt::print("{}\n", name);
      return;
    }
    fmt::print("{}", a->what == "bash"       ? completion(app)
                     : a->what == "zsh"      ? zshCompletion(app)
                     : a->what == "commands" ? commandNames(app)
                                             : manPage(app, a->command));
  });
}

}  // namespace depthservo
