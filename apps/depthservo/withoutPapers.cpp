
#include "commands.h"
#include "depthservo/text/InputError.h"

namespace depthservo {

void addReproduce(CLI::App& app, int& /*exitCode*/) {
  CLI::App* command = app.add_subcommand("reproduce", "The papers' simulations; not in this build");
  command->allow_extras();
  command->callback([] {
    throw InputError({"reproduce", 0, ""},
                     "this build has no papers; configure it with -DDEPTHSERVO_PAPERS=ON");
  });
}

}  // namespace depthservo
