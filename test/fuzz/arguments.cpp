// Command lines of every subcommand, an argument a line; nothing is done of what they ask for.
#include "Target.h"
#include "commands.h"
#include "depthservo/text/InputError.h"
#include "refusal.h"

namespace depthservo::fuzz {
namespace {

const Target kArguments("arguments", [](const std::string& bytes) {
  std::vector<std::string> words{""};
  for (const char c : bytes) {
    if (c == '\0') return;
    if (c == '\n') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  CLI::App app{"", "depthservo"};
  app.require_subcommand(1);
  int exitCode = 0;
  for (const auto add : kSubcommands) add(app, exitCode);
  struct Understood {};
  app.parse_complete_callback([] { throw Understood{}; });  // before it would be done
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const Understood&) {
  } catch (const CLI::Success&) {  // --help
  } catch (const CLI::ParseError& error) {
    throw InputError({"arguments", 0, ""}, refusal(app, error, words));
  }
});

}  // namespace
}  // namespace depthservo::fuzz
