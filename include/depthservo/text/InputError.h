#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "depthservo/api.h"

namespace depthservo {

/// A file, an option or a folder that cannot be used, and what to do about it.
///
/// `what()` is one line of at most 1000 bytes, "file:line: key: message", without control
/// characters.
class DEPTHSERVO_API InputError : public std::runtime_error {
 public:
  /// Where the fault is.
  struct Place {
    std::string file;  ///< path as the user gave it
    int line = 0;      ///< from 1; 0: the file as a whole
    std::string key;   ///< YAML path ("camera.fx") or column ("vx"); may be empty
  };

  InputError(Place place, const std::string& message);

  const std::string& file() const { return place_.file; }
  int line() const { return place_.line; }
  const std::string& key() const { return place_.key; }
  const std::string& message() const { return message_; }

 private:
  Place place_;
  std::string message_;
};

/// The word among `valid` (not empty) that takes the fewest edits to reach from `word`: for "did
/// you mean".
DEPTHSERVO_API std::string nearestWord(const std::string& word,
                                       const std::vector<std::string>& valid);

}  // namespace depthservo
