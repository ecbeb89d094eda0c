#pragma once

#include <string>

namespace depthservo {

/// Files whose keys are documented.
enum class KeySet {
  scenario,
  replay,  ///< section `replay` of sequence.yaml
  errors,  ///< file of --errors
  robot    ///< file of servo --robot
};

/// One line per key: name, unit, default, range, meaning. \param prefix of the keys wanted; empty:
/// all \throw InputError no key begins like this
std::string keysAsText(KeySet set, const std::string& prefix = "");

/// The table in doc/formats.md.
std::string keysAsMarkdown(KeySet set);

/// JSON schema (draft 7) for editors.
std::string scenarioSchema();

}  // namespace depthservo
