#include "refusal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "depthservo/scenario/Scenario.h"

namespace depthservo {
namespace {

std::vector<std::string> subcommands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  return names;
}

/// Every word that may stand at this place: an option of the subcommand in use, or without one the
/// subcommands too.
std::vector<std::string> validWords(const CLI::App& app) {
  const bool isInside = !app.get_subcommands().empty();
  std::vector<std::string> words = isInside ? std::vector<std::string>() : subcommands(app);
  for (const CLI::Option* option :
       (isInside ? *app.get_subcommands().front() : app).get_options()) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  }
  return words;
}

/// How to set the scenario keys whose last part is called like this option; empty: there are none.
std::string settingsFor(const std::string& option, const std::vector<std::string>& extras) {
  const std::size_t equals = option.find('=');
  std::string name = option.substr(2, equals == std::string::npos ? equals : equals - 2);
  std::replace(name.begin(), name.end(), '-', '_');
  const std::string value = equals != std::string::npos ? option.substr(equals + 1)
                            : extras.size() > 1         ? extras[1]
                                                        : "VALUE";
  std::vector<std::string> settings;
  for (const std::string& key : Scenario::keys()) {
    const std::size_t dot = key.rfind('.');
    if ((dot == std::string::npos ? key : key.substr(dot + 1)) == name) {
      settings.push_back(fmt::format("--set {}={}", key, value));
    }
  }
  return fmt::format("{}", fmt::join(settings, " or "));
}

/// The option that this argument follows, as if it were one of its values; null: there is none.
const CLI::Option* optionBefore(const std::string& word, const CLI::App& command,
                                const std::vector<std::string>& arguments) {
  auto at = std::find(arguments.rbegin(), arguments.rend(), word);
  if (at != arguments.rend()) ++at;
  at = std::find_if(at, arguments.rend(),
                    [](const std::string& a) { return a.rfind("--", 0) == 0; });
  if (at == arguments.rend()) return nullptr;
  const CLI::Option* option = command.get_option_no_throw(at->substr(0, at->find('=')));
  return option && option->get_items_expected_max() > 0 ? option : nullptr;
}

std::string tooMany(const std::string& word, const CLI::App& command,
                    const std::vector<std::string>& arguments) {
  const CLI::Option* option = optionBefore(word, command, arguments);
  if (!option) {
    return fmt::format("'{}' is one argument too many (see depthservo {} --help)", word,
                       command.get_name());
  }
  constexpr int kAnyNumber = 1000;
  const std::string name = option->get_name();
  return fmt::format(
      "'{}' is one value too many: {} takes {}{}", word, name, option->get_type_name(),
      option->get_items_expected_max() < kAnyNumber ? std::string()
                                                    : fmt::format("; repeat {} for each", name));
}

}  // namespace

std::string refusal(const CLI::App& app, const CLI::ParseError& error,
                    const std::vector<std::string>& arguments) {
  const bool isInside = !app.get_subcommands().empty();
  const std::vector<std::string> extras = app.remaining(true);
  if (!extras.empty()) {
    const std::string& word = extras.front();
    const bool isOption = word.rfind("--", 0) == 0;
    if (isInside) {
      const CLI::App& command = *app.get_subcommands().front();
      if (!isOption && word.rfind('-', 0) != 0) return tooMany(word, command, arguments);
      const std::string settings = isOption && command.get_option_no_throw("--set")
                                       ? settingsFor(word, extras)
                                       : std::string();
      if (!settings.empty()) {
        return fmt::format("'{}' is a key of the scenario: write {}", word, settings);
      }
    }
    return fmt::format("'{}' is not known here; did you mean '{}'?", word,
                       nearestWord(word, validWords(app)));
  }
  if (!isInside) {
    return fmt::format("expected one of: {} (see depthservo --help)",
                       fmt::join(subcommands(app), ", "));
  }
  std::string text = error.what();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return fmt::format("{} (see depthservo {} --help)", text,
                     app.get_subcommands().front()->get_name());
}

}  // namespace depthservo
